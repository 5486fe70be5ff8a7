"""The harmonic extension: discrete Laplace equation, maximum principle, exact data, exact linear fields."""

import numpy as np
import pytest

from PolyPoseLib.simulation.harmonic import interpolate_axis, jacobian_determinants, solve_laplace


def random_problem(seed, shape=(22, 37, 40), share=0.02):
    rng = np.random.default_rng(seed)
    known = rng.random(shape) < share
    values = rng.normal(0, 10, (3, *shape)).astype(np.float32)
    return values, known


@pytest.mark.parametrize("seed", range(3))
def test_known_nodes_keep_their_values_and_the_maximum_principle_holds(seed):
    values, known = random_problem(seed)
    field = solve_laplace(values, known, np.array([3.0, 2.0, 2.5]), tolerance=1e-5, iterations=500)
    assert np.array_equal(field[:, known], values[:, known])
    for component, given in zip(field, values, strict=True):
        assert given[known].min() - 1e-2 <= component.min() and component.max() <= given[known].max() + 1e-2


@pytest.mark.parametrize("seed", range(3))
def test_free_nodes_are_the_weighted_mean_of_their_neighbours(seed):
    values, known = random_problem(seed)
    spacing = np.array([3.0, 2.0, 2.5])
    field = solve_laplace(values, known, spacing, tolerance=1e-6, iterations=1000)
    padded = np.pad(field, [(0, 0), (1, 1), (1, 1), (1, 1)], mode="edge")
    total, weight = np.zeros_like(field), 0.0
    for axis, step in enumerate(spacing, start=1):
        for shift in (1, -1):
            rolled = np.roll(padded, shift, axis)[:, 1:-1, 1:-1, 1:-1]
            total += rolled / step**2
            weight += 1 / step**2
    assert np.abs(total / weight - field)[:, ~known].max() < 1e-2


def test_a_constant_stays_and_nothing_known_gives_zero():
    known = np.zeros((20, 40, 36), bool)
    assert not solve_laplace(np.ones((3, *known.shape), np.float32), known, np.ones(3)).any()
    known[3, 4, 5] = True
    field = solve_laplace(np.full((3, *known.shape), 7, np.float32), known, np.ones(3), 1e-6, 2000)
    assert np.allclose(field, 7, atol=1e-2)


def test_a_linear_field_between_two_plates_is_exact():
    shape = (40, 33, 35)
    ramp = np.broadcast_to(np.arange(shape[0], dtype=np.float32)[:, None, None], shape)
    known = np.zeros(shape, bool)
    known[[0, -1]] = True
    field = solve_laplace(np.stack([ramp, -ramp, 2 * ramp]), known, np.array([2.0, 1.0, 1.0]), 1e-6, 1000)
    assert np.allclose(field[0], ramp, atol=0.02) and np.allclose(field[2], 2 * ramp, atol=0.04)


def test_the_multigrid_start_does_not_change_the_answer():
    values, known = random_problem(5, (34, 36, 38), 0.01)
    loose = solve_laplace(values, known, np.ones(3), tolerance=1e-3)
    tight = solve_laplace(values, known, np.ones(3), tolerance=1e-7, iterations=3000)
    assert np.abs(loose - tight).max() < 0.2


def test_interpolation_along_an_axis_is_linear_and_clamped():
    rng = np.random.default_rng(0)
    field = rng.normal(size=(3, 5, 4)).astype(np.float32)
    position = np.array([-1.0, 0.0, 1.25, 3.9, 4.0, 9.0])
    expected = np.stack(
        [np.interp(np.clip(position, 0, 4), np.arange(5), field[a, :, b]) for a in range(3) for b in range(4)]
    )
    got = interpolate_axis(field, position, 1)
    assert np.allclose(np.moveaxis(got, 1, -1).reshape(12, -1), expected, atol=1e-6)


@pytest.mark.parametrize("handedness", [1, -1])
def test_the_determinant_of_an_affine_map_is_its_own_in_any_grid(handedness):
    from scipy.spatial.transform import Rotation

    affine = np.eye(4)
    affine[:3, :3] = Rotation.random(random_state=1).as_matrix() @ np.diag([handedness * 2.0, 3.0, 1.5])
    matrix = np.array([[1.1, 0.2, 0], [0, 0.9, 0.1], [0.3, 0, 1.2]])
    kji = np.stack(np.meshgrid(*map(np.arange, (5, 6, 7)), indexing="ij"), -1)
    points = kji[..., ::-1] @ affine[:3, :3].T
    vectors = points @ (matrix - np.eye(3)).T
    assert np.allclose(jacobian_determinants(vectors, affine), np.linalg.det(matrix), atol=1e-4)
