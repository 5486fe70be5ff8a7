"""Modes of the soft tissue's own motion: the same at points and on grids, as smooth and large as their prior says."""

import numpy as np
import pytest
from bones_case import grid_affine

from PolyPoseLib.registration.fit.soft_modes import DEVIATION_MM, LENGTH_MM, SoftModes

SHAPE = (20, 24, 28)


def modes_of(seed):
    return SoftModes.covering(grid_affine(seed, (12.0, 10.0, 14.0)), SHAPE)


def nodes(affine, shape):
    index = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), -1).reshape(-1, 3)[:, ::-1]
    return index @ affine[:3, :3].T + affine[:3, 3]


@pytest.mark.parametrize("seed", range(4))
def test_a_grid_holds_the_sum_of_the_modes_at_its_nodes(seed):
    modes = modes_of(seed)
    coefficients = np.random.default_rng(seed).normal(size=(modes.count, 3))
    other = modes.affine.copy()
    other[:3, :3] *= 0.7
    other[:3, 3] += modes.affine[:3, :3] @ [1.5, 3.0, 2.0]
    for affine, shape in ((modes.affine, SHAPE), (other, (9, 11, 7))):
        expected = modes.at(nodes(affine, shape)) @ coefficients
        found = modes.on_grid(coefficients, affine, shape)
        assert np.allclose(found.reshape(-1, 3), expected, atol=2e-4 * np.abs(expected).max())


@pytest.mark.parametrize("seed", range(3))
def test_displacements_drawn_from_the_prior_have_its_size_and_length(seed):
    """Squared exponential: correlation exp(-1/2) at the length scale, but for what the few modes leave out."""
    modes = modes_of(seed)
    rng = np.random.default_rng(seed)
    index = rng.uniform(0.25, 0.75, (300, 3)) * SHAPE[::-1]
    places = index @ modes.affine[:3, :3].T + modes.affine[:3, 3]
    axis = modes.affine[:3, seed] / np.linalg.norm(modes.affine[:3, seed])
    here, there = (modes.at(places + sign * LENGTH_MM / 2 * axis).astype(float) for sign in (-1, 1))
    variance = ((here**2 + there**2) / 2 @ modes.variances).mean()
    covariance = (here * there @ modes.variances).mean()
    assert 0.6 * DEVIATION_MM < np.sqrt(variance) < DEVIATION_MM  # larger at the box's borders
    assert covariance / variance == pytest.approx(np.exp(-0.5), abs=0.12)


def test_a_small_grid_has_few_modes_and_a_large_one_more():
    counts = [SoftModes.covering(np.diag([s, s, s, 1.0]), SHAPE).count for s in (1.0, 6.0, 12.0, 20.0)]
    assert counts == sorted(counts) and 1 <= counts[0] < counts[-1] < 1000
