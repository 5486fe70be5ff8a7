"""What speaks against poses, on the small knee with poses that are known to be right or wrong."""

from copy import copy
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from PolyPoseLib.data.tracking.track import TrackedFrame
from PolyPoseLib.geometry.rigid import about, perturbation
from PolyPoseLib.registration.fit.levels import Observation
from PolyPoseLib.rendering.rigid import Body
from PolyPoseLib.tracking import recovery
from PolyPoseLib.tracking.assessment import AGAINST, WEAK, assess, distance_mm, overlaps
from PolyPoseLib.tracking.comparison import better_poses
from PolyPoseLib.tracking.contradicted import with_contradictions
from PolyPoseLib.tracking.frame_fit import FOLLOWING, Frame, is_blank, with_limited_rotations
from PolyPoseLib.tracking.gaps import bridged
from PolyPoseLib.tracking.intervals import half_width
from PolyPoseLib.tracking.jumps import with_jumps
from PolyPoseLib.tracking.recovery import fit_again


def moved(patient, poses, k, step) -> np.ndarray:
    """The poses with one of them perturbed by degrees and mm of the scene."""
    step = np.r_[np.radians(step[:3]), step[3:]]
    poses = poses.copy()
    poses[k] = about(perturbation(step), patient.scene.centres[k]) @ poses[k]
    return poses


def test_the_scene_is_larger_and_poses_come_back(patient, knee):
    assert 1 < patient.factor < 8
    there = patient.enlarged(knee.poses[2])
    assert np.allclose(patient.at_true_size(there), knee.poses[2])
    covariance = patient.covariances_at_true_size(np.eye(6))
    assert np.allclose(np.diag(covariance)[3:], patient.factor**-2)


def test_right_poses_are_above_suspicion(patient, frame, right):
    found = assess(patient, frame.fit(right, FOLLOWING, patient.moving), right, ())
    assert found.suspects == found.lost == ()
    assert found.doubts == ((), (), ())
    assert (found.residuals < 0.1).all()


def test_a_wrong_pose_is_suspect_and_found_again(patient, frame, right):
    """The tibia is started too far away for the fit, and the restarts bring it back."""
    wrong = moved(patient, right, 1, [0, 14, 20, 16, -12, 0])
    found = assess(patient, frame.fit(wrong, FOLLOWING, patient.moving), None, ())
    assert distance_mm(patient, found.fit.poses[1], right[1], 1) > 5
    assert 1 in found.suspects
    again = fit_again(frame, found.fit.poses, found.suspects, [right])
    taken = better_poses(frame, found.fit.poses, again.poses, patient.moving)
    assert taken[1]
    assert distance_mm(patient, again.poses[1], right[1], 1) < 2.0


@pytest.mark.parametrize("k", range(3))
@pytest.mark.parametrize("sign", [-1, 1])
def test_each_structure_keeps_the_better_of_two_poses(patient, frame, right, k, sign):
    """Whichever is the first; another structure is wrong in the other."""
    other = (k + 1) % 3
    here = moved(patient, right, k, [0, 0, 0, 6 * sign, 6, 0])
    there = moved(patient, right, other, [0, 0, 0, 0, 6, -6 * sign])
    taken = better_poses(frame, here, there, [0, 1, 2])
    assert taken[k]
    assert not taken[other]
    assert not better_poses(frame, right, right, [0, 1, 2]).any()
    assert not better_poses(frame, here, there, [other])[k]


def test_a_pose_that_an_xray_contradicts_has_a_wide_interval(patient, frame, right, knee):
    """However sharp the optimum is; what was lost has the interval of a lost pose already."""
    wrong = moved(patient, right, 1, [0, 0, 0, 25, 10, 0])
    found = assess(patient, frame.fit(wrong, FOLLOWING[-1:], [0]), None, ())
    assert any(line.startswith(AGAINST) for line in found.doubts[1]) and not found.doubts[0]
    sharp = np.tile(np.eye(6) * 1e-6, (3, 1, 1))
    lines = (), (WEAK, f'{AGAINST} the camera "a"'), (WEAK,)
    kept = TrackedFrame(3, knee.poses[3], sharp, np.zeros(3), lines, ("forward",) * 3)
    (widened,) = with_contradictions(patient, [kept])
    assert np.array_equal(widened.covariances[[0, 2]], sharp[[0, 2]])
    assert np.linalg.eigvalsh(widened.covariances[1][3:, 3:])[0] > (9.9 / patient.factor) ** 2
    lost = replace(kept, sources=("forward", "none", "forward"))
    assert np.array_equal(with_contradictions(patient, [lost])[0].covariances, sharp)


def test_a_bone_inside_another_one_is_seen(patient, right):
    assert overlaps(patient, right) == {}
    inside = right.copy()
    centre = (np.linalg.inv(right[0]) @ np.r_[patient.scene.centres[0], 1.0])[:3]
    inside[2, :3, 3] = patient.scene.centres[2] - inside[2, :3, :3] @ centre
    assert 0 in overlaps(patient, inside)[2]


def test_pictures_without_contrast_are_blank(frame):
    seen = frame.observations[0]
    rng = np.random.default_rng(0)
    shape = seen.image.shape
    assert not is_blank(seen)
    for image in (np.zeros(shape), np.full(shape, 3.0), rng.normal(2.0, 0.3, shape)):
        assert is_blank(Observation(image.astype(np.float32), seen.mask, seen.camera))
    assert is_blank(replace(seen, mask=np.zeros(shape, bool)))


@pytest.mark.parametrize("degrees", [20.0, 164.0, 172.0, 180.0])
def test_soft_tissue_follows_bones_up_to_half_a_turn(patient, frame, right, degrees):
    """A bone that is turned too far keeps its centroid and its axis, and no frame is refused for it."""
    centres = patient.scene.centres
    turned = moved(patient, np.stack([np.eye(4)] * 3), 1, [0, degrees * 0.6, degrees * 0.8, 0, 0, 0])
    found = with_limited_rotations(turned, centres)
    angle = np.degrees(np.arccos(np.clip((np.trace(found[1, :3, :3]) - 1) / 2, -1, 1)))
    assert angle == pytest.approx(min(degrees, 165.0), abs=1e-6)
    assert np.allclose(found[1, :3, :3] @ centres[1] + found[1, :3, 3], centres[1])
    assert np.array_equal(found[[0, 2]], turned[[0, 2]])
    if degrees > 170:
        frame.fit(moved(patient, right, 1, [0, 0, degrees, 0, 0, 0]), FOLLOWING[:1], patient.moving)


@pytest.mark.parametrize("radii", [(6, 9, 14), (12, 5, 8)])
def test_half_the_smallest_width_of_an_ellipsoid(radii):
    size = 2 * max(radii) + 5
    index = np.stack(np.meshgrid(*[np.arange(size) - size // 2] * 3, indexing="ij"), -1)[..., ::-1]
    voxels = (np.linalg.norm(index / np.array(radii), axis=-1) < 1).astype(np.float32)
    body = Body(voxels, np.diag([1.5, 1.5, 1.5, 1.0]), np.zeros(3))
    assert half_width(body) == pytest.approx(1.5 * min(radii), rel=0.1)


def test_one_view_is_uncertain_along_its_beam(patient, frame, right, knee):
    """Of the first camera alone: more along the beam than across it, and the place across is no worse for it."""
    alone = Frame(patient, 3)
    alone.observations, alone.shown = alone.observations[:1], [0]
    found = assess(patient, alone.fit(right, FOLLOWING, patient.moving), right, ())
    both = assess(patient, frame.fit(right, FOLLOWING, patient.moving), right, ())
    for k in range(3):
        in_fixed = np.linalg.inv(right[k]) @ np.r_[patient.scene.centres[k], 1.0]
        beam = right[k, :3, :3] @ (in_fixed[:3] - alone.observations[0].camera.source)
        beam /= np.linalg.norm(beam)
        shift = found.covariances[k][3:, 3:]
        along = np.sqrt(beam @ shift @ beam)
        across = np.sqrt((np.trace(shift) - along**2) / 2)
        assert along > 3 * across
        assert along > 3 * np.sqrt(beam @ both.covariances[k][3:, 3:] @ beam)
        away = found.fit.poses[k] @ np.linalg.inv(right[k])
        error = away[:3, :3] @ patient.scene.centres[k] + away[:3, 3] - patient.scene.centres[k]
        assert abs(error @ beam) < 3 * along


def test_lost_poses_lie_between_those_beside_them_relative_to_the_reference(patient, knee_track):
    frames = list(knee_track.frames)
    for n in (1, 2, 4):
        sources = ("forward", "none", "forward")
        poses = frames[n].poses.copy()
        poses[1] = np.eye(4)
        frames[n] = replace(frames[n], sources=sources, poses=poses)
    found = bridged(patient, frames)
    for n in (1, 2, 4):
        error = distance_mm(
            patient, patient.enlarged(found[n].poses[1]), patient.enlarged(knee_track.frames[n].poses[1]), 1
        )
        assert error < 10.0
        assert np.sqrt(found[n].covariances[1, 3, 3]) > 10
        assert np.array_equal(found[n].poses[[0, 2]], knee_track.frames[n].poses[[0, 2]])
    relative = [found[n].poses[1] @ np.linalg.inv(found[n].poses[0]) for n in (3, 4)]
    assert np.allclose(*relative)


def test_a_pose_that_jumps_out_of_line_is_flagged(patient, knee_track):
    first, frames = knee_track.frames[0], []
    for n in range(12):
        poses = first.poses.copy()
        poses[:, :3, 3] += [0.1 * n, -0.05 * n**2, 0.3 * n]
        frames.append(replace(first, frame=n, poses=poses))
    assert with_jumps(patient, frames) == frames
    shifted = frames[5].poses.copy()
    shifted[1, :3, 3] += [0, 0, 9.0]
    frames[5] = replace(frames[5], poses=shifted)
    found = with_jumps(patient, frames)
    assert "9.0 mm from the middle" in found[5].doubts[1][-1]
    assert all(found[n].doubts[k] == () for n in range(12) for k in (0, 2))
    assert all(found[n].doubts[1] == () for n in (0, 1, 2, 3, 7, 8, 9, 10, 11))


def test_what_stands_still_is_not_moved_by_restarts_of_all_others(patient, right):
    """Wherever it is in frames beside it; all others are moved as one."""
    fixed = copy(patient)
    fixed.still, fixed.moving = [2], [0, 1]
    elsewhere = moved(patient, right, 2, [5.0, 0, 0, 9.0, 0, 0])
    starts = []

    def fit(start, _levels, free):
        assert free == fixed.moving
        starts.append(start)
        residuals = np.full(3, 1.0 / len(starts))  # whatever comes later is better
        return SimpleNamespace(poses=start, agreement=SimpleNamespace(residuals=residuals))

    best = recovery._moved_as_one(SimpleNamespace(patient=fixed, fit=fit), [right, elsewhere])
    assert all(np.array_equal(each[2], right[2]) for each in (*starts, best))
    assert len({np.round(each[0], 6).tobytes() for each in starts}) == len(starts) - 1
    assert distance_mm(patient, best[0], right[0], 0) > 5
