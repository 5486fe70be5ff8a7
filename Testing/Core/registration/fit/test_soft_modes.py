"""Modes of the soft tissue's own motion: the same at points and on grids, as smooth and as large as their prior says."""

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
    """Squared exponential: correlation exp(-1/2) at the length scale; what is left out of it is less than a tenth."""
    modes = modes_of(seed)
    inner = modes.affine[:3, :3] @ (np.array(SHAPE[::-1]) / 2) + modes.affine[:3, 3]
    axis = modes.affine[:3, seed] / np.linalg.norm(modes.affine[:3, seed])
    places = inner + np.outer([-LENGTH_MM / 2, LENGTH_MM / 2], axis)
    values = modes.at(np.r_[inner[None], places]).astype(float)
    covariance = values * modes.variances @ values.T
    assert np.sqrt(covariance[0, 0]) == pytest.approx(DEVIATION_MM, rel=0.3)
    correlation = covariance[1, 2] / np.sqrt(covariance[1, 1] * covariance[2, 2])
    assert correlation == pytest.approx(np.exp(-0.5), abs=0.1)


def test_a_small_grid_has_few_modes_and_a_large_one_more():
    counts = [SoftModes.covering(np.diag([s, s, s, 1.0]), SHAPE).count for s in (1.0, 6.0, 12.0, 20.0)]
    assert counts == sorted(counts) and 1 <= counts[0] < counts[-1] < 1000
