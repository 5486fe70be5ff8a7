"""Scores of tracks: errors that were put in come out, lost frames are told apart, right intervals hold 95 of 100."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from PolyPoseLib.cli._track_scores import track_tables
from PolyPoseLib.data.tracking.track import Track, TrackedFrame
from PolyPoseLib.data.tracking.track_truth import TrackTruth
from PolyPoseLib.errors import InputError
from PolyPoseLib.evaluation.tracks import AXES, held, score_track
from PolyPoseLib.geometry.camera import Camera, look_at
from PolyPoseLib.io.json_records import json_text

NAMES = ("femur", "tibia")
K = np.array([[1000.0, 0, 99.5], [0, 1000.0, 99.5], [0, 0, 1]])
SURE = np.tile(np.diag([1e-4] * 3 + [0.01] * 3), (2, 1, 1))


def drawn_poses(rng, count, degrees=180.0, mm=100.0):
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3] = Rotation.from_rotvec(
        np.radians(degrees) * rng.uniform(-0.5, 0.5, (count, 3))
    ).as_matrix()
    poses[:, :3, 3] = mm * rng.normal(size=(count, 3))
    return poses


def truth_of(rng, frames=20):
    poses = drawn_poses(rng, frames * 2).reshape(frames, 2, 4, 4)
    points = {name: rng.normal(0, 20, (200, 3)) for name in NAMES}
    centroids = np.array([points[name].mean(0) for name in NAMES])
    cameras = {
        "front": Camera(K, look_at([0, -900, 0], [0, 0, 0]), 200, 200),
        "side": Camera(K, look_at([900, 0, 0], [0, 0, 0]), 200, 200),
    }
    return TrackTruth(NAMES, "femur", 30.0, poses, centroids, points, cameras)


def perturbed(pose, centroid, delta):
    """The pose turned by delta[:3] (rad) and shifted by delta[3:] (mm) about a centroid in the CT."""
    motion = np.eye(4)
    motion[:3, :3] = Rotation.from_rotvec(delta[:3]).as_matrix()
    motion[:3, 3] = centroid - motion[:3, :3] @ centroid + delta[3:]
    return motion @ pose


def track_of(truth, deltas, covariances=None, doubts=None, sources=None, numbers=None):
    """A track whose poses are off by deltas (F, 2, 6)."""
    frames = []
    for n, delta in enumerate(deltas):
        number = n if numbers is None else numbers[n]
        poses = np.stack([perturbed(truth.poses[number, k], truth.centroids[k], delta[k]) for k in range(2)])
        frames.append(
            TrackedFrame(
                number,
                poses,
                SURE if covariances is None else covariances[n],
                np.zeros(2),
                ((), ()) if doubts is None else doubts[n],
                ("forward", "forward") if sources is None else sources[n],
                2.0,
            )
        )
    return Track(NAMES, "femur", truth.centroids, tuple(frames), 30.0, truth.cameras)


def unit(rng):
    vector = rng.normal(size=3)
    return vector / np.linalg.norm(vector)


@pytest.mark.parametrize("seed", range(10))
def test_a_shift_and_a_turn_that_were_put_in_come_out(seed):
    rng = np.random.default_rng(seed)
    truth = truth_of(rng)
    shift, turn = rng.uniform(0, 2), rng.uniform(0, 3)
    deltas = np.array(
        [[np.r_[np.radians(turn) * unit(rng), shift * unit(rng)] for _ in range(2)] for _ in range(20)]
    )
    scores = score_track(track_of(truth, deltas), truth)
    for name in NAMES:
        each = scores["structures"][name]
        for key in ("rms", "median", "worst"):
            assert each["centroid_mm"][key] == pytest.approx(shift, abs=1e-9)
            assert each["rotation_deg"][key] == pytest.approx(turn, abs=1e-7)
    assert scores["summary"]["centroid_rms_mm"] == pytest.approx(shift)
    assert scores["summary"]["rotation_rms_deg"] == pytest.approx(turn)
    assert scores["summary"]["cpu_seconds_per_frame"] == 2.0


@pytest.mark.parametrize("seed", range(5))
def test_target_errors_are_distances_of_points_in_the_rig(seed):
    rng = np.random.default_rng(seed)
    truth = truth_of(rng, 6)
    deltas = rng.normal(0, 1, (6, 2, 6)) * ([0.03] * 3 + [1.0] * 3)
    track = track_of(truth, deltas)
    each = score_track(track, truth)["structures"]["tibia"]
    errors = []
    for frame in range(6):
        points = np.c_[truth.points["tibia"], np.ones(200)]
        true, found = (
            points @ np.linalg.inv(pose).T for pose in (truth.poses[frame, 1], track.poses[frame, 1])
        )
        errors.append(np.linalg.norm((true - found)[:, :3], axis=1))
    assert each["tre_mm"]["rms"] == pytest.approx(np.sqrt(np.mean(np.square(errors))))
    assert each["tre_mm"]["worst_point"] == pytest.approx(np.max(errors))
    per_frame = np.sqrt(np.mean(np.square(errors), axis=1))
    assert each["tre_mm"]["worst"] == pytest.approx(per_frame.max())
    assert each["tre_mm"]["median"] == pytest.approx(np.median(per_frame))


def test_lost_frames_are_told_apart():
    rng = np.random.default_rng(3)
    truth = truth_of(rng, 6)
    deltas = np.zeros((6, 2, 6))
    deltas[[1, 2], 0, 3] = 8.0
    doubts = [((), ())] * 6
    doubts[2] = (("jumped",), ())
    doubts[3] = (("residual",), ())
    sources = [("forward", "backward")] * 6
    sources[4] = ("none", "forward")
    scores = score_track(track_of(truth, deltas, doubts=doubts, sources=sources), truth)
    femur = scores["structures"]["femur"]
    assert (femur["lost_in_silence"], femur["lost_and_said"], femur["false_alarms"]) == ([1], [2, 4], [3])
    assert (femur["frames"], femur["none"]) == (6, 1)
    assert femur["tre_mm"]["worst"] == pytest.approx(8.0)
    assert femur["centroid_mm"]["rms"] == pytest.approx(
        np.sqrt(2 * 64 / 5)
    )  # without the frame that has no pose
    assert femur["relied_on"]["centroid_mm"]["rms"] == pytest.approx(np.sqrt(64 / 3))
    tibia = scores["structures"]["tibia"]
    assert not any(tibia[key] for key in ("lost_in_silence", "lost_and_said", "false_alarms", "none"))
    summary = scores["summary"]
    assert [summary[key] for key in ("lost_in_silence", "lost_and_said", "false_alarms")] == [1, 2, 1]


@pytest.mark.parametrize("seed", range(3))
def test_errors_drawn_from_the_covariances_lie_inside_in_95_of_100(seed):
    rng = np.random.default_rng(seed)
    frames = 1500
    truth = truth_of(rng, frames)
    factors = rng.normal(0, 1, (frames, 2, 6, 6)) * (np.r_[[2e-3] * 3, [0.3] * 3])[:, None]
    covariances = factors @ np.swapaxes(factors, -1, -2)
    deltas = np.einsum("fkij,fkj->fki", factors, rng.normal(size=(frames, 2, 6)))
    right = score_track(track_of(truth, deltas, covariances), truth)
    boastful = score_track(track_of(truth, deltas, covariances / 9), truth)
    for name in NAMES:
        coverage = right["structures"][name]["coverage"]
        shares = [coverage[part] for part in ("pose", "rotation", "translation")]
        shares += [coverage["axes"][axis] for axis in AXES]
        shares += [beam["along_coverage"] for beam in right["structures"][name]["beams"].values()]
        # Five standard deviations of a share of 1500.
        assert np.abs(np.array(shares) - 0.95).max() < 5 * np.sqrt(0.95 * 0.05 / frames)
        assert boastful["structures"][name]["coverage"]["pose"] < 0.2
    expected = chi2.cdf(chi2.ppf(0.95, 6) / 9, 6)
    assert boastful["summary"]["coverage"] == pytest.approx(expected, abs=0.02)


def test_a_covariance_that_is_none_holds_nothing():
    good = np.diag([1.0, 4.0])
    broken = [
        np.diag([1.0, 0.0]),
        np.diag([1.0, -1.0]),
        np.full((2, 2), np.nan),
        np.array([[1.0, 2], [2, 1]]),
    ]
    covariances = np.array([good, *broken])
    assert held(np.zeros((5, 2)), covariances).tolist() == [True, False, False, False, False]
    edge = np.sqrt(chi2.ppf(0.95, 2))
    for angle in np.linspace(0, 6, 7):
        on = edge * np.array([[np.cos(angle), 2 * np.sin(angle)]])
        assert held(0.999 * on, good[None]).all() and not held(1.001 * on, good[None]).any()


@pytest.mark.parametrize("seed", range(5))
def test_displacements_along_a_beam_are_along_it(seed):
    rng = np.random.default_rng(seed)
    truth = truth_of(rng, 12)
    deltas = np.zeros((12, 2, 6))
    for frame in range(12):
        for k in range(2):
            pose = truth.poses[frame, k]
            place = np.linalg.inv(pose) @ np.r_[truth.centroids[k], 1]
            ray = place[:3] - truth.cameras["front"].source
            ray /= np.linalg.norm(ray)
            deltas[frame, k, 3:] = pose[:3, :3] @ (-2.5 * ray)  # the bone 2.5 mm farther from the source
    scores = score_track(track_of(truth, deltas), truth)
    for name in NAMES:
        beams = scores["structures"][name]["beams"]
        assert beams["front"]["along_mm"] == pytest.approx(2.5) and beams["front"]["across_mm"] < 1e-9
        assert beams["side"]["across_mm"] > 1.5
        assert beams["front"]["along_coverage"] == 0


@pytest.mark.parametrize("seed", range(5))
def test_an_error_of_the_whole_rig_does_not_touch_relative_motion(seed):
    rng = np.random.default_rng(seed)
    truth = truth_of(rng, 8)
    off = drawn_poses(rng, 1, 4.0, 2.0)[0]
    frames = [
        TrackedFrame(n, truth.poses[n] @ off, SURE, np.zeros(2), ((), ()), ("forward",) * 2) for n in range(8)
    ]
    scores = score_track(Track(NAMES, "femur", truth.centroids, tuple(frames), 30.0, truth.cameras), truth)
    relative = scores["relative"]["tibia"]
    assert relative["centroid_mm"]["worst"] < 1e-9 and relative["rotation_deg"]["worst"] < 1e-5
    assert scores["structures"]["tibia"]["rotation_deg"]["rms"] > 0.1
    assert "femur" not in scores["relative"]


def test_relative_motion_has_the_turn_of_both():
    rng = np.random.default_rng(1)
    truth = truth_of(rng, 5)
    deltas = np.zeros((5, 2, 6))
    deltas[:, 1, 0] = np.radians(3.0)
    relative = score_track(track_of(truth, deltas), truth)["relative"]["tibia"]
    assert relative["rotation_deg"]["rms"] == pytest.approx(3.0)


def test_a_part_of_the_frames_is_scored_at_its_own_numbers():
    rng = np.random.default_rng(2)
    truth = truth_of(rng, 20)
    deltas = np.zeros((4, 2, 6))
    deltas[2, 0, 4] = 7.0
    scores = score_track(track_of(truth, deltas, numbers=[5, 7, 11, 19]), truth)
    assert scores["structures"]["femur"]["lost_in_silence"] == [11]
    assert scores["structures"]["tibia"]["tre_mm"]["worst"] < 1e-9


def test_a_track_without_any_pose_is_scored():
    rng = np.random.default_rng(4)
    truth = truth_of(rng, 3)
    scores = score_track(track_of(truth, np.zeros((3, 2, 6)), sources=[("none", "none")] * 3), truth)
    assert scores["summary"]["lost_and_said"] == 6 and np.isnan(scores["summary"]["rms_mm"])
    assert "NaN" not in json_text(scores) and "lost and said 6" in track_tables(scores)


def test_tracks_of_something_else_are_refused():
    rng = np.random.default_rng(5)
    truth = truth_of(rng, 3)
    track = track_of(truth, np.zeros((3, 2, 6)))
    other = Track(("femur", "ulna"), "femur", track.centroids, track.frames, 30.0, {})
    with pytest.raises(InputError, match='no structure "ulna"'):
        score_track(other, truth)
    long = track_of(truth_of(rng, 9), np.zeros((9, 2, 6)))
    with pytest.raises(InputError, match="last frame is 8"):
        score_track(long, truth)
    with pytest.raises(InputError, match="last frame is none"):
        score_track(Track(NAMES, "femur", track.centroids, (), 30.0, {}), truth)


def test_tables_name_every_structure_and_view():
    rng = np.random.default_rng(6)
    truth = truth_of(rng, 4)
    scores = score_track(track_of(truth, rng.normal(0, 0.01, (4, 2, 6))), truth)
    text = track_tables(scores)
    for word in (*NAMES, "front", "side", "lost in silence", "inside 95 %", "CPU s a frame"):
        assert word in text
