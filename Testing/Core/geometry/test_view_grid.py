"""Grids of views cover what they promise; standard views look where their names say."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.standard_views import STANDARD_VIEWS, standard_view_rotation
from PolyPoseLib.geometry.view_grid import rotation_between, turn, view_grid


@pytest.mark.parametrize("centres", [["AP"], ["LL"], list(STANDARD_VIEWS)])
def test_every_rotation_in_reach_has_a_neighbour(centres):
    rng = np.random.default_rng(0)
    rotations = np.stack([standard_view_rotation(name) for name in centres])
    grid = view_grid(rotations, np.radians(45), np.radians(8), np.radians(9))
    tried = np.concatenate(
        [turn(roll) @ grid.rotations[grid.allowed[:, r]] for r, roll in enumerate(grid.rolls)]
    )
    for _ in range(60):
        axis = rng.normal(size=3)
        wanted = (
            Rotation.from_rotvec(np.radians(rng.uniform(0, 38)) * axis / np.linalg.norm(axis)).as_matrix()
            @ rotations[int(rng.integers(len(rotations)))]
        )
        angles = Rotation.from_matrix(tried @ wanted.T).magnitude()
        assert np.degrees(angles.min()) < 8
    assert np.abs(np.linalg.det(tried) - 1).max() < 1e-9


def test_a_grid_smaller_than_its_spacing_holds_its_centre():
    centre = standard_view_rotation("AP")
    grid = view_grid(centre[None], np.radians(0.5), np.radians(8), np.radians(9))
    tried = [
        turn(roll) @ r
        for d, r in enumerate(grid.rotations)
        for n, roll in enumerate(grid.rolls)
        if grid.allowed[d, n]
    ]
    assert min(Rotation.from_matrix(r @ centre.T).magnitude() for r in tried) < np.radians(1)


@pytest.mark.parametrize("seed", range(10))
def test_rotation_between_is_the_smallest(seed):
    start, end = Rotation.random(2, random_state=seed).as_matrix()[:, 0]
    rotation = rotation_between(start, end)
    np.testing.assert_allclose(rotation @ start, end, atol=1e-12)
    assert Rotation.from_matrix(rotation).magnitude() == pytest.approx(np.arccos(start @ end))
    np.testing.assert_allclose(rotation_between(start, -start) @ start, -start, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "beam", "columns"),
    [
        ("AP", (0, 1, 0), (-1, 0, 0)),
        ("PA", (0, -1, 0), (1, 0, 0)),
        ("LL", (1, 0, 0), (0, 1, 0)),
        ("RL", (-1, 0, 0), (0, -1, 0)),
    ],
)
def test_standard_views_look_where_their_names_say(name, beam, columns):
    rotation = standard_view_rotation(name)
    np.testing.assert_allclose(rotation[2], beam, atol=1e-9)
    np.testing.assert_allclose(rotation[1], (0, 0, -1), atol=1e-9)
    np.testing.assert_allclose(np.abs(rotation[0]), np.abs(columns), atol=1e-9)
    assert np.linalg.det(rotation) == pytest.approx(1)


def test_unknown_views_are_refused():
    with pytest.raises(InputError, match="standard_view"):
        standard_view_rotation("oblique")
