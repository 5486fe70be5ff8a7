"""Whole sequences, small ones, against a truth that shares neither renderer nor soft tissue with the tracking."""

from dataclasses import replace

import numpy as np
import pytest
from moving_knee import NAMES, SMALL, KneeOptions, MovingKnee
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.tracking.track_options import TrackOptions
from PolyPoseLib.errors import CancelledError, InputError
from PolyPoseLib.geometry.rigid import perturbation_between
from PolyPoseLib.tracking.follow import track

FORWARD = TrackOptions(threads=1, backward=False)


def errors(knee, found) -> tuple[np.ndarray, np.ndarray]:
    """(F, K) mm at the centroid and degrees."""
    steps = np.array(
        [
            [
                perturbation_between(pose, true, centre)
                for pose, true, centre in zip(
                    frame.poses, knee.poses[frame.frame], found.centroids, strict=True
                )
            ]
            for frame in found.frames
        ]
    )
    return np.linalg.norm(steps[..., 3:], axis=-1), np.degrees(np.linalg.norm(steps[..., :3], axis=-1))


def with_images(sequence, view, **changed):
    """The sequence with other images of a view, by frame; a number makes a blank one."""
    views = list(sequence.views)
    views[view] = replace(views[view], images=Changed(views[view].images, changed))
    return replace(sequence, views=tuple(views))


class Changed:
    """Images of which some are others; keys are "f" and the number."""

    def __init__(self, images, changed):
        self.images, self.changed = images, {int(name[1:]): image for name, image in changed.items()}
        self.count = images.count

    def read(self, index):
        image, mask = self.images.read(index)
        other = self.changed.get(index)
        if other is None:
            return image, mask
        return (np.full_like(image, other) if np.isscalar(other) else other), mask


def test_bones_are_followed_and_their_errors_lie_within_the_intervals(knee, knee_track):
    mm, degrees = errors(knee, knee_track)
    assert np.sqrt((mm[:, :2] ** 2).mean()) < 0.4
    assert np.sqrt((degrees[:, :2] ** 2).mean()) < 0.8
    assert mm[:, 2].max() < 2.0
    deviations = np.sqrt(np.trace(knee_track.covariances[..., 3:, 3:], axis1=2, axis2=3))
    assert (mm < 3.5 * deviations).all()
    assert {source for frame in knee_track.frames for source in frame.sources} <= {
        "forward",
        "backward",
        "restart",
    }
    assert knee_track.names == NAMES
    assert knee_track.reference == "femur"
    assert not knee_track.smoothed
    assert knee_track.distrust == ()
    assert (knee_track.numbers == np.arange(SMALL["frames"])).all()
    assert all(frame.cpu_seconds > 0 for frame in knee_track.frames)


def test_an_interrupted_run_goes_on_as_if_it_had_not_been(knee_sequence):
    sequence = replace(knee_sequence, options=replace(FORWARD, last=3))
    whole, kept = track(sequence), []

    def stop():
        return len(kept) >= 2

    with pytest.raises(CancelledError):
        track(sequence, cancel=stop, keep=kept.append)
    assert [each.frame for each in kept] == [0, 1]
    later = []
    resumed = track(sequence, done=kept, keep=later.append)
    assert [each.frame for each in later] == [2, 3]
    for once, twice in zip(whole.frames, resumed.frames, strict=True):
        assert np.array_equal(once.poses, twice.poses)
        assert np.array_equal(once.covariances, twice.covariances)
        assert once.doubts == twice.doubts


def test_progress_counts_frames(knee_sequence):
    steps = []
    track(replace(knee_sequence, options=replace(FORWARD, last=2)), progress=steps.append)
    mine = [(each.iteration, each.of) for each in steps if each.stage == "tracking"]
    assert mine == [(0, 3), (1, 3), (2, 3), (3, 3)]
    assert all(each.similarity is None or -1 <= each.similarity <= 1 for each in steps)


def test_the_rigs_world_may_be_any(knee, knee_sequence):
    """A rig's world that is turned by 170 degrees and far away gives the same poses behind that motion."""
    world = np.eye(4)
    world[:3, :3] = Rotation.from_rotvec(np.radians([100.0, -120.0, 70.0])).as_matrix()
    world[:3, 3] = (800, -500, 1200)
    turned = replace(
        knee_sequence,
        views=tuple(
            replace(view, camera=view.camera.with_extrinsic(view.camera.extrinsic @ world))
            for view in knee_sequence.views
        ),
        initial_poses={name: pose @ world for name, pose in knee_sequence.initial_poses.items()},
        options=replace(FORWARD, last=2),
    )
    found = track(turned)
    plain = track(replace(knee_sequence, options=replace(FORWARD, last=2)))
    for n in range(3):
        for k in range(3):
            away = perturbation_between(
                plain.frames[n].poses[k] @ world, found.frames[n].poses[k], plain.centroids[k]
            )
            assert away @ np.linalg.solve(plain.frames[n].covariances[k], away) < 3.0
            assert np.linalg.norm(away[3:]) < 0.2


def test_a_frame_that_no_camera_shows_is_bridged_and_said_to_be(knee, knee_sequence):
    both = with_images(with_images(knee_sequence, 0, f2=1.5), 1, f2=0.0)
    found = track(replace(both, options=replace(FORWARD, last=3)))
    mm, _ = errors(knee, found)
    assert set(found.frames[2].sources) == {"none"}
    assert all("no camera" in lines[0] for lines in found.frames[2].doubts)
    assert (mm[[1, 3]] < 2.0).all()
    assert (mm[2] < 4.0).all()
    deviations = np.sqrt(found.covariances[2, :, 3, 3])
    assert (deviations > 5.0).all()
    assert sum("was lost in 1 of 4 frames (2)" in each for each in found.warnings) == 3


def test_a_camera_without_exposure_is_left_out_and_intervals_along_the_other_beam_grow(
    knee, knee_sequence, knee_track
):
    found = track(replace(with_images(knee_sequence, 0, f2=0.7), options=replace(FORWARD, last=3)))
    mm, _ = errors(knee, found)
    widest = [np.linalg.eigvalsh(each.frames[2].covariances[0][3:, 3:])[-1] for each in (knee_track, found)]
    assert widest[1] > 4 * widest[0]
    deviations = np.sqrt(np.trace(found.covariances[2, :, 3:, 3:], axis1=1, axis2=2))
    assert (mm[2] < 3.5 * deviations).all()
    assert (mm[3] < 2.0).all()


def test_what_stands_still_keeps_its_pose(knee, knee_sequence):
    given = replace(knee_sequence, still=("femur",), options=replace(FORWARD, last=1))
    found = track(given)
    assert found.frames[1].sources[0] == found.frames[0].sources[0] == "given"
    assert np.array_equal(found.frames[1].poses[0], knee_sequence.initial_poses["femur"])
    assert np.linalg.eigvalsh(found.covariances[1, 0])[0] > 0
    free = {name: pose for name, pose in knee_sequence.initial_poses.items() if name != "femur"}
    found = track(replace(given, initial_poses=free))
    assert found.frames[0].sources[0] == "forward"
    assert np.array_equal(found.frames[0].poses[0], found.frames[1].poses[0])


def test_what_stands_still_is_where_it_was_after_a_frame_that_no_camera_shows(knee_sequence):
    blank = with_images(with_images(knee_sequence, 0, f1=0.5), 1, f1=0.5)
    free = {name: pose for name, pose in knee_sequence.initial_poses.items() if name != "femur"}
    for poses in (knee_sequence.initial_poses, free):
        found = track(replace(blank, still=("femur",), initial_poses=poses, options=replace(FORWARD, last=2)))
        first, *later = found.frames
        assert first.sources[0] != "none" and later[0].sources[1] == "none" and later[1].sources[1] != "none"
        for frame in later:
            assert np.array_equal(frame.poses[0], first.poses[0])
            assert np.array_equal(frame.covariances[0], first.covariances[0])
            assert (frame.sources[0], frame.doubts[0]) == (first.sources[0], ())


def test_what_stands_still_at_a_given_pose_needs_no_picture(knee_sequence):
    away = knee_sequence.initial_poses["patella"].copy()
    away[:3, 3] += 4000.0
    poses = {**knee_sequence.initial_poses, "patella": away}
    given = replace(knee_sequence, still=("patella",), initial_poses=poses, options=replace(FORWARD, last=1))
    assert [frame.sources[2] for frame in track(given).frames] == ["given", "given"]


@pytest.mark.parametrize("mm", [0.0, 12.0])
def test_a_given_pose_of_what_stands_still_is_compared_with_the_first_frame(knee_sequence, mm):
    """No frame is flagged, as somebody vouches for it; a warning says where the X-rays contradict it."""
    pose = knee_sequence.initial_poses["tibia"].copy()
    pose[:3, 3] += (mm, -mm, mm)
    poses = {**knee_sequence.initial_poses, "tibia": pose}
    given = replace(knee_sequence, still=("tibia",), initial_poses=poses, options=replace(FORWARD, last=0))
    found = track(given)
    told = [line for line in found.warnings if line.startswith('"tibia" stands still at the pose')]
    assert len(told) == (mm > 0)
    assert found.frames[0].doubts[1] == ()
    assert not any("stands still" in line for line in found.warnings if line not in told)


def test_a_camera_that_looks_elsewhere_is_named(knee_sequence):
    left, right = knee_sequence.views
    around = np.diag([-1.0, 1.0, -1.0, 1.0])
    away = replace(right, camera=right.camera.with_extrinsic(around @ right.camera.extrinsic))
    options = replace(FORWARD, last=0)
    lines = track(replace(knee_sequence, views=(left, away), options=options)).warnings
    assert sum("No structure projects" in line and f'"{right.name}"' in line for line in lines) == 1
    lines = track(replace(knee_sequence, options=options)).warnings
    assert not any("No structure projects" in line for line in lines)


def test_something_must_move(knee_sequence):
    with pytest.raises(InputError, match='"still" names every structure'):
        replace(knee_sequence, still=NAMES)


def test_images_of_another_size_than_the_calibrations_are_refused(knee_sequence):
    wrong = with_images(knee_sequence, 1, f1=np.zeros((50, 60), np.float32))
    with pytest.raises(InputError, match="50 x 60 pixels"):
        track(replace(wrong, options=replace(FORWARD, last=1)))


def test_frames_of_another_run_are_refused(knee_sequence, knee_track):
    with pytest.raises(InputError, match="another sequence"):
        track(replace(knee_sequence, options=FORWARD), done=knee_track.frames[2:4])


def test_a_first_frame_without_exposure_is_refused(knee_sequence):
    blank = with_images(with_images(knee_sequence, 0, f0=0.0), 1, f0=0.0)
    with pytest.raises(InputError, match="first"):
        track(replace(blank, options=FORWARD))


@pytest.mark.long
def test_everything_that_jumps_is_found_again():
    knee = MovingKnee(2, KneeOptions(**{**SMALL, "flexion_deg": 6.0}, jump_mm=18.0))
    found = track(knee.sequence())
    mm, _ = errors(knee, found)
    assert (mm[:, :2] < 1.5).all()


@pytest.mark.long
def test_the_first_frame_may_be_registered():
    """The rig's world is turned against the CT's by 4 degrees, 9 mm away, and nobody says where bones are."""
    knee = MovingKnee(3, KneeOptions(**{**SMALL, "frames": 1, "pixels": 160}))
    world = np.eye(4)
    world[:3, :3] = Rotation.from_rotvec(np.radians([2.0, -3.0, 2.0])).as_matrix()
    world[:3, 3] = (5, -4, 6)
    sequence = knee.sequence(start="registration")
    views = tuple(
        replace(view, camera=view.camera.with_extrinsic(view.camera.extrinsic @ world))
        for view in sequence.views
    )
    found = track(replace(sequence, views=views, initial_poses={}))
    mm, _ = errors(_Turned(knee, world), found)
    assert (mm[:, :2] < 1.5).all()


class _Turned:
    def __init__(self, knee, world):
        self.poses = knee.poses @ world
