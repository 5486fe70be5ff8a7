"""Helical axes: screws that are known, and intervals against random draws."""

import numpy as np
import pytest
from joint_case import random_rigid, rigid
from scipy.spatial.transform import Rotation

from PolyPoseLib.geometry.rigid import about, perturbation
from PolyPoseLib.kinematics.helical import LEAST_TURN_DEG, helical_axes
from PolyPoseLib.kinematics.relative_motion import RelativeMotion


def screw(degrees, direction, point, shift):
    """Rotation about an axis through a point and a shift along it."""
    direction = np.asarray(direction, float) / np.linalg.norm(direction)
    motion = about(
        rigid(Rotation.from_rotvec(np.radians(degrees) * direction), (0, 0, 0)), np.asarray(point, float)
    )
    motion[:3, 3] += shift * direction
    return motion


def motion_of(poses, covariance=None):
    poses = np.asarray(poses)
    return RelativeMotion(
        poses, np.broadcast_to(np.zeros((6, 6)) if covariance is None else covariance, (len(poses), 6, 6))
    )


@pytest.mark.parametrize("seed", range(5))
def test_a_screw_is_found_again(seed):
    rng = np.random.default_rng(seed)
    start = random_rigid(rng, 100, 80)
    direction, point = rng.normal(size=3), rng.uniform(-50, 50, 3)
    direction /= np.linalg.norm(direction)
    turns = np.array([5.0, 40.0, 120.0, 179.0])
    shifts = np.array([-3.0, 0.0, 7.0, 2.0])
    poses = [start, *(screw(t, direction, point, s) @ start for t, s in zip(turns, shifts, strict=True))]
    found = helical_axes(motion_of(poses), np.zeros(5, int))
    np.testing.assert_allclose(found.angles_deg[1:], turns, atol=1e-8)
    np.testing.assert_allclose(found.shifts_mm[1:], shifts, atol=1e-7)
    np.testing.assert_allclose(found.directions[1:], np.tile(direction, (4, 1)), atol=1e-8)
    foot = point + direction * (
        direction @ (start[:3, 3] - point)
    )  # of the perpendicular from the distal origin
    np.testing.assert_allclose(found.points_mm[1:], np.tile(foot, (4, 1)), atol=1e-6)
    assert found.angles_deg[0] == found.shifts_mm[0] == found.angles_95_deg[0] == 0
    assert np.isnan(found.directions[0]).all() and np.isnan(found.points_mm[0]).all()


def test_from_frame_to_frame():
    steps = [screw(t, (0, 0, 1), (10, 0, 0), 1.0) for t in (0.0, 3.0, 6.0, 6.5)]
    found = helical_axes(motion_of(steps), np.array([0, 0, 1, 2]))
    np.testing.assert_allclose(found.angles_deg, (0, 3, 3, 0.5), atol=1e-9)
    np.testing.assert_allclose(found.directions[2], (0, 0, 1), atol=1e-9)
    assert LEAST_TURN_DEG > 0.5 and np.isnan(found.directions[3]).all()
    assert found.shifts_mm[3] == pytest.approx(0.0, abs=1e-9)


def test_intervals_are_those_of_random_draws():
    """Both frames' errors, drawn about the distal origin, spread the parameters as the intervals say."""
    rng = np.random.default_rng(3)
    start = random_rigid(rng, 30, 60)
    end = screw(35, (1, 2, -1), (30, -10, 5), 4.0) @ start
    root = rng.normal(size=(6, 6)) * (np.array([0.003] * 3 + [0.25] * 3) / 2)[:, None]
    covariance = root @ root.T
    count = 3000
    before, after = np.empty((count, 4, 4)), np.empty((count, 4, 4))
    for poses, pose in ((before, start), (after, end)):
        for n, error in enumerate(rng.multivariate_normal(np.zeros(6), covariance, count)):
            poses[n] = about(perturbation(error), pose[:3, 3]) @ pose
    drawn = helical_axes(motion_of([*before, *after]), np.r_[np.arange(count), np.arange(count)])
    said = helical_axes(motion_of([start, end], covariance), np.zeros(2, int))
    take = slice(count, None)
    np.testing.assert_allclose(1.96 * drawn.angles_deg[take].std(), said.angles_95_deg[1], rtol=0.06)
    np.testing.assert_allclose(1.96 * drawn.shifts_mm[take].std(), said.shifts_95_mm[1], rtol=0.06)
    widest = np.degrees(np.sqrt(np.linalg.eigvalsh(np.cov(drawn.directions[take].T))[-1]))
    np.testing.assert_allclose(1.96 * widest, said.directions_95_deg[1], rtol=0.06)
    flat = np.eye(3) - np.outer(said.directions[1], said.directions[1])
    across = np.sqrt(np.linalg.eigvalsh(flat @ np.cov(drawn.points_mm[take].T) @ flat)[-1])
    np.testing.assert_allclose(1.96 * across, said.points_95_mm[1], rtol=0.06)


def test_lost_frames_have_no_axis():
    poses = np.array([screw(t, (0, 1, 0), (0, 0, 0), 0) for t in (0, 10, 20)])
    poses[1] = np.nan
    found = helical_axes(motion_of(poses), np.zeros(3, int))
    assert np.isnan(found.angles_deg).tolist() == [False, True, False]
    stepped = helical_axes(motion_of(poses), np.array([0, 0, 1]))
    assert np.isnan(stepped.angles_deg).tolist() == [False, True, True]
