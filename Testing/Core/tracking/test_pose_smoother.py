"""The smoother against the whole least-squares problem solved at once, and on motions that are known."""

import itertools

import numpy as np
import pytest
import torch
from numpy.testing import assert_allclose
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.tracking.track import TrackedFrame
from PolyPoseLib.geometry import se3
from PolyPoseLib.registration.uncertainty.covariance import PoseUncertainty
from PolyPoseLib.tracking import smoother
from PolyPoseLib.tracking.smoother import UNKNOWN_VELOCITY, Motion, likeliest_motion, smooth, smoothed_frames

SEEDS = range(4)
CENTRE = np.array([12.0, -30.0, 45.0])


def spread(rng, scale) -> np.ndarray:
    """A random covariance (6, 6) with correlations, of rotations in rad and translations in mm."""
    mixed = rng.normal(size=(6, 9))
    return (mixed @ mixed.T / 9) * np.outer(scale, scale)


def rigid(rotation: np.ndarray, translation: np.ndarray) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = Rotation.from_rotvec(rotation).as_matrix(), translation
    return pose


def about_centre(step: np.ndarray) -> np.ndarray:
    """Rotation about CENTRE, then a shift."""
    motion = rigid(step[:3], step[3:])
    motion[:3, 3] += CENTRE - motion[:3, :3] @ CENTRE
    return motion


def between(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """(6,) the rotation and shift about CENTRE that lead from one pose to another."""
    motion = second @ np.linalg.inv(first)
    rotation = Rotation.from_matrix(motion[:3, :3]).as_rotvec()
    return np.r_[rotation, motion[:3, :3] @ CENTRE + motion[:3, 3] - CENTRE]


def bending(rng, count, noise) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """True poses of a smooth motion, observed ones, and the covariances of their errors."""
    phase = np.linspace(0, 2 * np.pi, count)
    wave = rng.normal(size=(6, 2)) * np.r_[np.full(3, 0.3), np.full(3, 12.0)][:, None]
    truth = np.stack([about_centre(wave @ [np.sin(t), np.cos(t)]) for t in phase])
    covariances = np.stack([spread(rng, np.r_[np.full(3, noise / 50), np.full(3, noise)]) for _ in phase])
    observed = np.stack(
        [
            about_centre(np.linalg.cholesky(c) @ rng.normal(size=6)) @ t
            for t, c in zip(truth, covariances, strict=True)
        ]
    )
    return truth, observed, covariances


@pytest.mark.parametrize("seed", SEEDS)
def test_shifts_without_rotation_are_the_solution_of_the_whole_linear_problem(seed):
    rng = np.random.default_rng(seed)
    count, density = 12, 40.0
    times = np.cumsum(rng.uniform(0.02, 0.06, count))
    seen = np.ones(count, bool)
    seen[rng.choice(np.arange(1, count), 3, replace=False)] = False
    shifts = rng.normal(0, 3, (count, 3))
    poses = np.stack([rigid(np.zeros(3), shift) for shift in shifts])
    covariances = np.zeros((count, 6, 6))
    for covariance in covariances:
        covariance[:3, :3] = 1e-12 * np.eye(3)  # shifts and rotations are then independent
        covariance[3:, 3:] = spread(rng, np.ones(6))[:3, :3]
    result = smooth(poses, covariances, seen, times, CENTRE, Motion(np.array([1e-9, density]), 1.0))

    information = np.zeros((6 * count, 6 * count))
    vector = np.zeros(6 * count)
    before = np.diag(np.r_[np.full(3, 100.0), np.full(3, UNKNOWN_VELOCITY[1])] ** -2.0)
    information[:6, :6] += before
    vector[:6] += before @ np.r_[shifts[0], np.zeros(3)]
    for n in range(count):
        place = slice(6 * n, 6 * n + 3)
        if seen[n]:
            weight = np.linalg.inv(covariances[n, 3:, 3:])
            information[place, place] += weight
            vector[place] += weight @ shifts[n]
        if n:
            passed = times[n] - times[n - 1]
            step = np.kron([[1, passed], [0, 1]], np.eye(3))
            noise = np.kron([[passed**3 / 3, passed**2 / 2], [passed**2 / 2, passed]], density * np.eye(3))
            jump = np.zeros((6, 6 * count))
            jump[:, 6 * n - 6 : 6 * n], jump[:, 6 * n : 6 * n + 6] = -step, np.eye(6)
            information += jump.T @ np.linalg.solve(noise, jump)
    covariance = np.linalg.inv(information)
    solution = (covariance @ vector).reshape(count, 6)
    assert_allclose(result.poses[:, :3, 3], solution[:, :3], atol=1e-4)
    assert_allclose(result.poses[:, :3, :3], np.broadcast_to(np.eye(3), (count, 3, 3)), atol=1e-9)
    assert_allclose(result.velocities[:, 3:], solution[:, 3:], rtol=1e-3, atol=1e-3)
    own = np.stack([covariance[6 * n : 6 * n + 3, 6 * n : 6 * n + 3] for n in range(count)])
    assert_allclose(result.covariances[:, 3:, 3:], own, rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("seed", SEEDS)
def test_rotating_poses_are_the_least_squares_solution_on_the_group(seed):
    """Small errors around a large motion, where one linearisation is exact enough."""
    rng = np.random.default_rng(seed)
    count, passed = 7, 0.1
    _, observed, covariances = bending(rng, count, 0.02)
    times = passed * np.arange(count)
    motion = Motion(np.array([30.0, 3e5]), 1.0)
    result = smooth(observed, covariances, np.ones(count, bool), times, CENTRE, motion)
    density = np.repeat(motion.acceleration, 3)
    root = np.linalg.cholesky(
        np.linalg.inv(np.kron([[passed**3 / 3, passed**2 / 2], [passed**2 / 2, passed]], np.diag(density)))
    ).T
    whitening = [np.linalg.cholesky(np.linalg.inv(each)).T for each in covariances]
    scale = np.r_[np.full(3, 1e-3), np.full(3, 0.05)]

    def poses_of(x):
        return [about_centre(scale * d) @ o for d, o in zip(x.reshape(2, count, 6)[0], observed, strict=True)]

    def residuals(x):
        poses, velocities = poses_of(x), x.reshape(2, count, 6)[1] * [1, 1, 1, 40, 40, 40]
        parts = [w @ between(p, o) for w, p, o in zip(whitening, poses, observed, strict=True)]
        for n in range(count - 1):
            # The group's exponential by many small steps of the velocity, each about the centre.
            moved = poses[n]
            small = about_centre(velocities[n] * passed / 2048)
            moved = np.linalg.matrix_power(small, 2048) @ moved
            gap = np.r_[between(moved, poses[n + 1]), velocities[n + 1] - velocities[n]]
            parts.append(root @ gap)
        parts.append(velocities[0] / np.repeat(UNKNOWN_VELOCITY, 3))
        return np.concatenate(parts)

    steps = [between(a, b) / passed for a, b in itertools.pairwise(observed)]
    start = np.stack([np.zeros((count, 6)), np.stack([*steps, steps[-1]]) / [1, 1, 1, 40, 40, 40]])
    solution = poses_of(least_squares(residuals, start.ravel(), x_scale="jac").x)
    deviations = np.sqrt(np.diagonal(result.covariances, axis1=1, axis2=2))
    for found, expected, deviation in zip(result.poses, solution, deviations, strict=True):
        assert (np.abs(between(expected, found)) < 0.25 * deviation).all()


@pytest.mark.parametrize("seed", SEEDS)
def test_a_smooth_motion_is_found_better_than_its_frames_and_within_its_intervals(seed):
    rng = np.random.default_rng(seed)
    truth, observed, covariances = bending(rng, 60, 1.0)
    times = np.arange(60) / 30
    seen = np.ones(60, bool)
    motion = likeliest_motion(observed, covariances, seen, times, CENTRE)
    result = smooth(observed, covariances, seen, times, CENTRE, motion)
    before = np.stack([between(a, b) for a, b in zip(truth, observed, strict=True)])
    after = np.stack([between(a, b) for a, b in zip(truth, result.poses, strict=True)])
    for part in (slice(0, 3), slice(3, 6)):
        assert np.linalg.norm(after[:, part]) < 0.7 * np.linalg.norm(before[:, part])
    ratio = [e @ np.linalg.solve(c, e) / 6 for e, c in zip(after, result.covariances, strict=True)]
    assert 0.3 < np.mean(ratio) < 1.6
    assert motion.share > 0.3


@pytest.mark.parametrize("seed", SEEDS)
def test_an_error_that_all_frames_share_is_not_averaged_away(seed):
    rng = np.random.default_rng(seed)
    truth, _, covariances = bending(rng, 60, 1.0)
    common = np.linalg.cholesky(covariances.mean(axis=0)) @ rng.normal(size=6)
    observed = np.stack([about_centre(common) @ each for each in truth])
    times, seen = np.arange(60) / 30, np.ones(60, bool)
    motion = likeliest_motion(observed, covariances, seen, times, CENTRE)
    result = smooth(observed, covariances, seen, times, CENTRE, motion)
    assert motion.share < 0.2
    trace = np.trace(result.covariances[:, 3:, 3:], axis1=1, axis2=2)
    assert (trace > 0.7 * np.trace(covariances[:, 3:, 3:], axis1=1, axis2=2)).all()


@pytest.mark.parametrize("seed", SEEDS)
def test_the_rigs_world_does_not_matter(seed):
    """Another world to the right of every pose, up to half a turn away, moves the smoothed poses with it."""
    rng = np.random.default_rng(seed)
    _, observed, covariances = bending(rng, 20, 1.0)
    other = rigid(rng.normal(size=3), rng.normal(0, 300, 3))
    times, seen, motion = np.arange(20) / 30, rng.random(20) < 0.8, Motion(np.array([1.0, 900.0]), 0.5)
    here = smooth(observed, covariances, seen, times, CENTRE, motion)
    there = smooth(observed @ other, covariances, seen, times, CENTRE, motion)
    assert_allclose(there.poses, here.poses @ other, atol=1e-8)
    assert_allclose(there.covariances, here.covariances, rtol=1e-8, atol=1e-12)


@pytest.mark.parametrize("lost", [range(15, 19), range(28, 40), range(8)])
def test_frames_that_were_lost_stay_as_they_are_bridged(lost):
    """A velocity carried on through frames that nothing is seen in ends anywhere."""
    rng = np.random.default_rng(3)
    truth, observed, covariances = bending(rng, 40, 0.5)
    covariances[lost] = PoseUncertainty.unseen().covariance
    for n in lost:
        observed[n] = observed[(lost[0] or lost[-1] + 2) - 1]
    frames = [
        TrackedFrame(
            n,
            observed[n][None],
            covariances[n][None],
            np.zeros(1),
            ((),),
            ("none" if n in lost else "forward",),
        )
        for n in range(40)
    ]
    found = smoothed_frames(frames, CENTRE[None], 30.0)
    for n in lost:
        assert np.array_equal(found[n].poses, frames[n].poses)
        assert np.array_equal(found[n].covariances, frames[n].covariances)
    assert [each.sources for each in found] == [each.sources for each in frames]
    assert all(np.array_equal(each.poses[0], observed[n]) for n, each in enumerate(frames))
    seen = [n for n in range(40) if n not in lost]
    before, after = (
        np.mean([np.linalg.norm(between(truth[n], each[n].poses[0])[3:]) for n in seen])
        for each in (frames, found)
    )
    assert after < before


@pytest.mark.parametrize("seed", range(20))
def test_its_exponentials_are_those_of_the_torch_module(seed):
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    angle = [0.0, 1e-9, 0.3, 3.0][seed % 4]
    vector = np.r_[angle * axis / np.linalg.norm(axis), rng.normal(0, 50, 3)]
    tensor = torch.from_numpy(vector)
    motion = smoother._exp(vector)
    assert_allclose(motion, se3.exp(tensor).numpy(), atol=1e-9)
    assert_allclose(smoother._log(motion), vector, atol=1e-7)
    assert_allclose(smoother._adjoint(vector), se3.adjoint(se3.exp(tensor)).numpy(), atol=1e-9)
    assert_allclose(smoother._left_jacobian(vector), se3.left_jacobian(tensor).numpy(), atol=1e-9)
