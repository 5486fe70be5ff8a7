"""Harmonic infill against a direct solution of Laplace's equation."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from scipy.sparse import lil_matrix
from scipy.sparse.linalg import spsolve

from PolyPoseLib.warp.infill import fill_harmonic


def solve_directly(values, wanted, ignored, spacing) -> np.ndarray:
    """The same equations, assembled voxel by voxel and solved by a sparse factorisation."""
    unknown = {tuple(v): n for n, v in enumerate(np.argwhere(wanted))}
    matrix, right = lil_matrix((len(unknown), len(unknown))), np.zeros(len(unknown))
    for voxel, row in unknown.items():
        for axis in range(3):
            for sign in (-1, 1):
                other = list(voxel)
                other[axis] += sign
                other = tuple(other)
                if min(other) < 0 or other[axis] >= values.shape[axis] or ignored[other]:
                    continue
                weight = 1 / spacing[2 - axis] ** 2
                matrix[row, row] += weight
                if other in unknown:
                    matrix[row, unknown[other]] -= weight
                else:
                    right[row] += weight * values[other]
    out = values.astype(float)
    out[wanted] = spsolve(matrix.tocsc(), right)
    return out


def case(seed, shape=(13, 18, 22)):
    rng = np.random.default_rng(seed)
    values = gaussian_filter(rng.normal(0, 1, shape), 2) * 2000
    wanted = gaussian_filter(rng.normal(0, 1, shape), 2) > 0.04
    return values, wanted


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("spacing", [(1.0, 1.0, 1.0), (0.7, 0.7, 2.5), (3.0, 1.0, 1.0)])
def test_close_to_the_direct_solution(seed, spacing):
    values, wanted = case(seed)
    ignored = np.zeros_like(wanted)
    exact = solve_directly(values, wanted, ignored, spacing)
    found = fill_harmonic(values, wanted, None, np.array(spacing))
    error = np.abs(found - exact)[wanted] / np.ptp(values[~wanted])
    assert error.mean() < 0.005
    assert error.max() < 0.05
    assert np.array_equal(found[~wanted], values[~wanted].astype(np.float32))


def test_ignored_voxels_bring_nothing_in():
    values, wanted = case(4)
    ignored = np.zeros_like(wanted)
    ignored[:, 8:10, 5:9] = True
    ignored &= ~wanted
    bright = np.where(ignored, 5000.0, values)
    found = fill_harmonic(bright, wanted, ignored, np.ones(3))
    known = ~(wanted | ignored)
    assert found[wanted].max() <= values[known].max() + 1e-3
    assert found[wanted].min() >= values[known].min() - 1e-3
    exact = solve_directly(bright, wanted, ignored, (1.0, 1.0, 1.0))
    assert np.abs(found - exact)[wanted].mean() < 0.005 * np.ptp(values[known])
    assert np.array_equal(found[ignored], bright[ignored].astype(np.float32))


def test_linear_images_are_found_again():
    """A linear function is harmonic."""
    k, j, i = np.meshgrid(np.arange(30), np.arange(28), np.arange(26), indexing="ij")
    values = 3.0 * i - 2.0 * j + 5.0 * k
    wanted = np.zeros(values.shape, dtype=bool)
    wanted[8:20, 6:22, 7:19] = True
    found = fill_harmonic(np.where(wanted, 1e4, values), wanted, None, np.array([1.0, 1.0, 2.0]))
    assert np.abs(found - values)[wanted].mean() < 1.0
    assert np.abs(found - values)[wanted].max() < 4.0


def test_nothing_known_and_nothing_wanted():
    assert not fill_harmonic(np.ones((4, 5, 6)), np.ones((4, 5, 6), bool), None, np.ones(3)).any()
    values = np.random.default_rng(0).normal(size=(4, 5, 6))
    assert np.array_equal(
        fill_harmonic(values, np.zeros((4, 5, 6), bool), None, np.ones(3)), values.astype(np.float32)
    )


def test_enclosed_voxels_get_a_finite_value():
    """A voxel walled in by ignored ones has no boundary of its own."""
    wanted, ignored = np.zeros((2, 9, 9, 9), dtype=bool)
    ignored[3:6, 3:6, 3:6] = True
    wanted[4, 4, 4] = True
    ignored &= ~wanted
    found = fill_harmonic(np.full((9, 9, 9), 40.0), wanted, ignored, np.ones(3))
    assert found[4, 4, 4] == pytest.approx(40, abs=1e-3)
