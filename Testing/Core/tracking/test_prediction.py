"""Predictions from motions that are known."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.tracking.track import TrackedFrame
from PolyPoseLib.geometry.rigid import about, perturbation, perturbation_between, rigid_inverse
from PolyPoseLib.tracking.prediction import between_poses, predicted_poses

SEEDS = range(6)
CENTRES = np.array([[10.0, -20.0, 30.0], [40.0, 5.0, -60.0]])


def frame(number, poses, sources=("forward", "forward"), deviation=1e-5) -> TrackedFrame:
    covariances = np.stack([deviation**2 * np.eye(6)] * len(poses))
    return TrackedFrame(number, np.stack(poses), covariances, np.zeros(2), ((), ()), sources)


def somewhere(rng) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_rotvec(rng.normal(size=3)).as_matrix()
    pose[:3, 3] = rng.normal(0, 200, 3)
    return pose


def stepped(poses, steps) -> list[np.ndarray]:
    return [
        about(perturbation(step), centre) @ pose
        for step, pose, centre in zip(steps, poses, CENTRES, strict=True)
    ]


@pytest.mark.parametrize("seed", SEEDS)
def test_an_even_motion_is_carried_on(seed):
    rng = np.random.default_rng(seed)
    first = [somewhere(rng), somewhere(rng)]
    steps = rng.normal(size=(2, 6)) * [0.1, 0.1, 0.1, 5, 5, 5]
    second = stepped(first, steps)
    third = stepped(second, steps)
    found = predicted_poses([frame(0, first), frame(1, second)], CENTRES, 0, True)
    assert_allclose(found, third, atol=1e-4)
    stays = predicted_poses([frame(0, first), frame(1, second)], CENTRES, 0, False)
    assert_allclose(stays, second, atol=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_what_was_lost_goes_with_the_reference(seed):
    rng = np.random.default_rng(seed)
    relative = somewhere(rng)
    past = []
    for n in range(4):
        base = somewhere(rng)
        sources = ("forward", "forward" if n == 0 else "none")
        past.append(frame(n, [base, relative @ base if n == 0 else somewhere(rng)], sources))
    found = predicted_poses(past, CENTRES, 0, False)
    assert_allclose(found[1] @ rigid_inverse(found[0]), relative, atol=1e-8)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_step_that_is_mostly_error_is_hardly_carried_on(seed):
    """In the direction in which poses are uncertain, as along the beam of one view."""
    rng = np.random.default_rng(seed)
    first = [somewhere(rng), somewhere(rng)]
    steps = np.zeros((2, 6))
    steps[:, 3], steps[:, 5] = 2.0, 3.0
    before, last = frame(0, first), frame(1, stepped(first, steps))
    for each in (before, last):
        each.covariances[:, 5, 5] = 30.0**2
    found = predicted_poses([before, last], CENTRES, 0, True)
    for k in range(2):
        carried = perturbation_between(last.poses[k], found[k], CENTRES[k])
        assert carried[3] == pytest.approx(2.0, abs=0.05)
        assert -3.0 <= carried[5] <= 0.05


def test_predictions_of_predictions_stay_rotations():
    """Rounding grows by a factor with every product; after some dozens of frames a camera would refuse the pose."""
    rng = np.random.default_rng(0)
    poses = [somewhere(rng), somewhere(rng)]
    steps = rng.normal(size=(2, 6)) * [0.05, 0.05, 0.05, 2, 2, 2]
    past = [frame(0, poses), frame(1, stepped(poses, steps))]
    for n in range(2, 400):
        past = [past[-1], frame(n, list(predicted_poses(past, CENTRES, 0, True)))]
    rotations = past[-1].poses[:, :3, :3]
    assert_allclose(rotations @ np.swapaxes(rotations, 1, 2), np.stack([np.eye(3)] * 2), atol=1e-12)
    assert_allclose(np.linalg.det(rotations), 1.0)


@pytest.mark.parametrize("seed", SEEDS)
def test_between_two_poses_the_centre_goes_straight_and_the_rotation_evenly(seed):
    rng = np.random.default_rng(seed)
    first, centre = somewhere(rng), CENTRES[0]
    step = rng.normal(size=6) * [0.5, 0.5, 0.5, 30, 30, 30]
    second = about(perturbation(step), centre) @ first
    for share in (0.0, 0.3, 1.0):
        found = between_poses(first, second, share, centre)
        assert_allclose(perturbation_between(first, found, centre), share * step, atol=1e-8)


def test_a_place_that_one_camera_saw_alone_is_taken_from_the_frames_before():
    """Along its beam, where it is uncertain by more than bones move; across it the frame itself counts."""
    rng = np.random.default_rng(1)
    poses = [somewhere(rng), somewhere(rng)]
    away = np.zeros((2, 6))
    away[:, 3], away[:, 5] = 2.0, 25.0
    frames = [frame(0, poses), frame(1, poses), frame(2, stepped(poses, away))]
    frames[2].covariances[:, 5, 5] = 20.0**2
    for moves_on in (False, True):
        found = predicted_poses(frames, CENTRES, 0, moves_on)
        for k in range(2):
            step = perturbation_between(poses[k], found[k], CENTRES[k])
            assert step[3] == pytest.approx(4.0 if moves_on else 2.0, abs=0.1)
            assert abs(step[5]) < 3.0
