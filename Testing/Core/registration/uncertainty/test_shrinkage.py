"""Poses are shrunk by what motions of one patient tell of each other."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from PolyPoseLib.geometry.rigid import about, perturbation, perturbation_between
from PolyPoseLib.registration.uncertainty.covariance import PoseUncertainty
from PolyPoseLib.registration.uncertainty.local_minima import LEVER_MM
from PolyPoseLib.registration.uncertainty.shrinkage import (
    ALONE,
    LENGTH_MM,
    POSE_STATED,
    SIZE_STATED,
    likeliest_poses,
    shrunk_poses,
)

SEEDS = range(8)
SHARP = np.diag([np.radians(0.3)] * 3 + [0.3] * 3) ** 2
VAGUE = np.diag([np.radians(10.0)] * 3 + [10.0] * 3) ** 2


def centres_of(rng: np.random.Generator, count: int) -> np.ndarray:
    return rng.uniform(-150, 150, (count, 3))


def whole(blocks: list[np.ndarray]) -> np.ndarray:
    covariance = np.zeros((6 * len(blocks), 6 * len(blocks)))
    for n, block in enumerate(blocks):
        covariance[6 * n : 6 * n + 6, 6 * n : 6 * n + 6] = block
    return covariance


def motions(rng: np.random.Generator, centres: np.ndarray, size_mm: float) -> np.ndarray:
    """(K, 4, 4) motions about the centres, rotations by a lever."""
    deltas = rng.normal(0, size_mm, (len(centres), 6)) / ([LEVER_MM] * 3 + [1.0] * 3)
    return posed(deltas, centres)


def posed(deltas: np.ndarray, centres: np.ndarray) -> np.ndarray:
    return np.array([about(perturbation(d), c) for d, c in zip(deltas, centres, strict=True)])


def deltas_of(poses: np.ndarray, centres: np.ndarray) -> np.ndarray:
    return np.array([perturbation_between(np.eye(4), p, c) for p, c in zip(poses, centres, strict=True)])


def prior_of_size_1(centres: np.ndarray) -> np.ndarray:
    distance = np.linalg.norm(centres[:, None] - centres[None], axis=2)
    alike = ALONE * np.eye(len(centres)) + (1 - ALONE) * np.exp(-((distance / LENGTH_MM) ** 2) / 2)
    return np.kron(alike, np.diag([LEVER_MM**-2.0] * 3 + [1.0] * 3))


@pytest.mark.parametrize("seed", SEEDS)
def test_where_nothing_moved_nothing_moves(seed: int) -> None:
    """Errors as large as stated, over SIZE_STATED, are no motion."""
    rng = np.random.default_rng(seed)
    centres = centres_of(rng, 30)
    blocks = [SHARP if rng.random() < 0.5 else VAGUE for _ in centres]
    deltas = np.array([rng.multivariate_normal(np.zeros(6), block / SIZE_STATED**2) for block in blocks])
    shrunk, _ = shrunk_poses(posed(deltas, centres), centres, whole(blocks))
    before, after = (np.abs(each[:, 3:]).max() for each in (deltas, deltas_of(shrunk, centres)))
    assert before > 3.0 and after < 0.05 * before


@pytest.mark.parametrize("seed", SEEDS)
def test_an_error_of_all_bones_is_no_motion_where_it_is_stated_as_such(seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    centres = centres_of(rng, 20)
    common = np.kron(np.ones((20, 20)), np.diag([0.0] * 3 + [4.0] * 3))
    covariance = whole([SHARP] * 20) + common
    shift = np.r_[np.zeros(3), rng.normal(0, 2.0 / SIZE_STATED, 3)]
    found = posed(np.tile(shift, (20, 1)), centres)
    shared, _ = shrunk_poses(found, centres, covariance)
    alone, _ = shrunk_poses(found, centres, whole([SHARP + common[:6, :6]] * 20))
    left, taken = (np.abs(deltas_of(each, centres)).max() for each in (shared, alone))
    assert left < 0.2 * np.abs(shift).max() and left < taken


@pytest.mark.parametrize("seed", SEEDS)
def test_bones_that_the_x_rays_show_stay_where_they_are(seed: int) -> None:
    rng = np.random.default_rng(200 + seed)
    centres = centres_of(rng, 8)
    found = motions(rng, centres, 6.0)
    shrunk, size = shrunk_poses(found, centres, whole([SHARP] * 8))
    np.testing.assert_allclose(deltas_of(shrunk, centres), deltas_of(found, centres), atol=0.02)
    assert 3.0 < size < 12.0


@pytest.mark.parametrize("seed", SEEDS)
def test_a_bone_that_hardly_shows_goes_with_its_neighbours(seed: int) -> None:
    rng = np.random.default_rng(300 + seed)
    centres = rng.uniform(-30, 30, (9, 3))
    shift = rng.normal(0, 1, 3)
    shift *= 8.0 / np.linalg.norm(shift)
    deltas = np.tile(np.r_[np.zeros(3), shift], (9, 1))
    astray = rng.normal(0, 1, 3)
    deltas[0, 3:] += 8.0 * astray / np.linalg.norm(astray)
    unseen = np.diag([np.radians(60.0)] * 3 + [60.0] * 3) ** 2
    shrunk, _ = shrunk_poses(posed(deltas, centres), centres, whole([unseen] + [SHARP] * 8))
    assert np.linalg.norm(deltas_of(shrunk, centres)[0, 3:] - shift) < 2.5


@pytest.mark.parametrize("seed", SEEDS)
def test_the_size_is_the_likeliest_by_scipys_density(seed: int) -> None:
    rng = np.random.default_rng(400 + seed)
    count = 5
    centres = centres_of(rng, count)
    root = rng.normal(0, 1, (6 * count, 6 * count)) * np.tile([0.01] * 3 + [1.0] * 3, count)[:, None]
    covariance = root @ root.T + whole([SHARP] * count)
    found = motions(rng, centres, 3.0)
    deltas = deltas_of(found, centres).reshape(-1)
    unit = prior_of_size_1(centres)

    def likelihood(size_mm: float) -> float:
        spread = size_mm**2 * unit + covariance / SIZE_STATED**2
        return float(multivariate_normal(np.zeros(6 * count), spread).logpdf(deltas))

    size = shrunk_poses(found, centres, covariance)[1]
    assert likelihood(size) >= max(likelihood(size * factor) for factor in (0.5, 0.9, 1.1, 2.0)) - 1e-6


@pytest.mark.parametrize("seed", SEEDS)
def test_bones_alike_are_shrunk_as_textbooks_say(seed: int) -> None:
    """The mean of a Gaussian given another one; none of the bones moves by more than the common size."""
    rng = np.random.default_rng(500 + seed)
    centres = centres_of(rng, 4)
    covariance = whole([VAGUE / 25] * 4)
    deltas = np.tile([0.05, -0.05, 0.05, 2.5, -2.5, 2.5], (4, 1)) * rng.uniform(0.8, 1.0, (4, 1))
    shrunk, size = shrunk_poses(posed(deltas, centres), centres, covariance)
    own = np.sqrt(((deltas * ([LEVER_MM] * 3 + [1.0] * 3)) ** 2).mean(axis=1))
    if own.max() < size:
        unit = prior_of_size_1(centres)
        errors = covariance / POSE_STATED**2
        expected = size**2 * unit @ np.linalg.inv(size**2 * unit + errors) @ deltas.reshape(-1)
        np.testing.assert_allclose(deltas_of(shrunk, centres).reshape(-1), expected, rtol=1e-5, atol=1e-7)
    else:  # still between rest and what was found
        assert (np.abs(deltas_of(shrunk, centres)) <= np.abs(deltas) + 1e-6).all()


@pytest.mark.parametrize("seed", SEEDS)
def test_one_bone_that_moved_far_is_hardly_pulled_back(seed: int) -> None:
    """An arm among ribs: its interval is wide, and yet it stays where the X-rays have it."""
    rng = np.random.default_rng(600 + seed)
    centres = centres_of(rng, 20)
    deltas = deltas_of(motions(rng, centres, 1.0), centres)
    far = rng.normal(0, 1, 6)
    deltas[0] = 30.0 * far / np.linalg.norm(far) / ([LEVER_MM] * 3 + [1.0] * 3)
    wide = np.diag([np.radians(4.0)] * 3 + [4.0] * 3) ** 2
    shrunk, size = shrunk_poses(posed(deltas, centres), centres, whole([wide] + [SHARP] * 19))
    change = (deltas_of(shrunk, centres)[0] - deltas[0]) * ([LEVER_MM] * 3 + [1.0] * 3)
    assert size < 4.0 and np.linalg.norm(change) < 0.5


@pytest.mark.parametrize("seed", SEEDS)
def test_a_contradicted_bone_goes_with_its_neighbours_whatever_its_curvature_was(seed: int) -> None:
    """What is stated of it may be less than its curvature says, which is of a wrong place."""
    rng = np.random.default_rng(700 + seed)
    centres = rng.uniform(-30, 30, (6, 3))
    bodies = [SimpleNamespace(centre=centre) for centre in centres]
    deltas = np.tile(np.r_[np.zeros(3), rng.normal(0, 2.0, 3)], (6, 1))
    deltas[2, 3:] += 6.0
    root = rng.normal(0, 1, (36, 36)) * np.tile([0.01] * 3 + [1.0] * 3, 6)[:, None]
    root[12:18] *= 50
    covariance = root @ root.T / 50 + whole([SHARP] * 6)
    stated = {k: PoseUncertainty(SHARP + covariance[6 * k : 6 * k + 6, 6 * k : 6 * k + 6]) for k in range(6)}
    stated[2] = PoseUncertainty.doubted()
    joint = SimpleNamespace(
        poses=posed(deltas, centres), problem=SimpleNamespace(free_poses=list(range(6)), bodies=bodies)
    )
    poses = likeliest_poses(joint, covariance, stated, [2])  # pyright: ignore[reportArgumentType]
    assert np.isfinite(poses).all()
    before, after = (
        np.linalg.norm(each[2, 3:] - np.median(each[:, 3:], axis=0))
        for each in (deltas, deltas_of(poses, centres))
    )
    assert after < before
