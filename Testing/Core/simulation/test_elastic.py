"""Elastic tissue: rigid motions cost nothing, uniform strain is exact, and known nodes are kept."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from PolyPoseLib.simulation.elastic import element_stiffness, solve_elastic

SHAPE, SPACING = (9, 10, 11), np.array([4.0, 5.0, 6.0])


def places() -> np.ndarray:
    """(3, k, j, i) of the nodes, mm along (i, j, k)."""
    k, j, i = np.meshgrid(*[np.arange(n) * s for n, s in zip(SHAPE, SPACING, strict=True)], indexing="ij")
    return np.stack([i, j, k])


def border() -> np.ndarray:
    known = np.ones(SHAPE, bool)
    known[1:-1, 1:-1, 1:-1] = False
    return known


def solve(values, known, tissue=None):
    tissue = np.ones(SHAPE, bool) if tissue is None else tissue
    return solve_elastic(values, known, tissue, SPACING, tolerance=1e-8)


def test_an_element_has_six_motions_without_force():
    stiffness = element_stiffness(SPACING)
    np.testing.assert_allclose(stiffness, stiffness.T, atol=1e-9)
    values = np.linalg.eigvalsh(stiffness)
    assert (values > -1e-9 * values[-1]).all()
    corners = np.array([(k, j, i) for k in (0, 1) for j in (0, 1) for i in (0, 1)]) * SPACING
    for axis in np.eye(3):
        shift = np.tile(axis, 8)
        turn = np.cross(axis, corners[:, ::-1]).ravel()
        for motion in (shift, turn):
            assert np.abs(stiffness @ motion).max() < 1e-9 * np.abs(stiffness).max() * np.abs(motion).max()


@pytest.mark.parametrize("seed", range(4))
def test_uniform_strain_is_exact(seed):
    """The patch test: a linear displacement at the border is linear inside."""
    rng = np.random.default_rng(seed)
    linear = np.tensordot(rng.normal(0, 0.05, (3, 3)), places(), 1) + rng.normal(0, 3, (3, 1, 1, 1))
    found = solve(linear.astype(np.float32), border())
    assert np.abs(found - linear).max() < 1e-3


def test_a_free_body_turns_with_what_holds_it():
    """Unlike under Laplace's equation, tissue around a bone that turns a little turns with it as far as the skin."""
    known = np.zeros(SHAPE, bool)
    known[3:6, 3:7, 4:7] = True
    turn = Rotation.from_rotvec([0.01, -0.02, 0.015]).as_matrix() - np.eye(3)
    rigid = np.tensordot(turn, places(), 1)
    found = solve(np.where(known, rigid, 0).astype(np.float32), known)
    assert np.abs(found - rigid).max() < 0.02 * np.abs(rigid).max()


def test_air_does_not_hold_tissue_back():
    known = np.zeros(SHAPE, bool)
    known[:, :, 0], known[:, :, -1] = True, True
    values = np.zeros((3, *SHAPE), np.float32)
    values[1][:, :, 0] = 5.0
    tissue = np.ones(SHAPE, bool)
    tissue[:, :, 7:] = False
    found = solve(values, known, tissue)
    assert found[1][:, :, 6].mean() > 4.5
    np.testing.assert_array_equal(found[:, known], values[:, known])


def test_nothing_known_moves_nothing():
    known = np.zeros(SHAPE, bool)
    assert not solve(np.ones((3, *SHAPE), np.float32), known).any()
