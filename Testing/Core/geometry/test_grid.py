"""Grids of voxels: what block means, borders and covering grids keep, over random grids of either handedness."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.grid import (
    Grid,
    block_factors,
    bounding_box,
    covering_grid,
    grown_box,
    require_grid,
)


@st.composite
def grids(draw: st.DrawFn) -> Grid:
    """Up to 12 voxels a side, any orientation, spacing from 0.5 to 3 mm."""
    rng = np.random.default_rng(draw(st.integers(0, 1 << 32)))
    shape = tuple(draw(st.integers(1, 12)) for _ in range(3))
    affine = np.eye(4)
    axes = Rotation.random(random_state=rng).as_matrix() * draw(st.sampled_from([1, -1]))
    affine[:3, :3] = axes @ np.diag(rng.uniform(0.5, 3, 3))
    affine[:3, 3] = rng.normal(0, 100, 3)
    return Grid(rng.random(shape).astype(np.float32), affine)


def centre_of_mass(grid: Grid) -> np.ndarray:
    """(3,) LPS mm."""
    k, j, i = np.indices(grid.voxels.shape)
    index = np.stack([(grid.voxels * axis).sum() for axis in (i, j, k)]) / grid.voxels.sum()
    return grid.affine[:3, :3] @ index + grid.affine[:3, 3]


def mass(grid: Grid) -> float:
    return grid.voxels.sum() * abs(np.linalg.det(grid.affine[:3, :3]))


def positions(grid: Grid) -> np.ndarray:
    """(k, j, i, 3) LPS mm of the voxels' centres."""
    k, j, i = np.indices(grid.voxels.shape)
    return np.stack([i, j, k], axis=-1) @ grid.affine[:3, :3].T + grid.affine[:3, 3]


@given(grids(), st.floats(0.5, 10))
def test_block_means_keep_mass(grid: Grid, target_mm: float) -> None:
    assert mass(grid.coarsened(target_mm)) == pytest.approx(mass(grid), rel=1e-5)


@given(grids(), st.floats(0.5, 10), st.integers(0, 2))
def test_block_means_of_a_coordinate_are_the_coordinates_of_the_blocks(
    grid: Grid, target_mm: float, axis: int
) -> None:
    coordinate = positions(grid)[..., axis].astype(np.float32)
    coarse = Grid(coordinate, grid.affine).coarsened(target_mm)
    factors = block_factors(grid.affine, target_mm)[::-1]
    full = tuple(slice(size // factor) for size, factor in zip(coordinate.shape, factors, strict=True))
    np.testing.assert_allclose(coarse.voxels[full], positions(coarse)[..., axis][full], atol=1e-3)


@given(grids())
def test_a_border_of_zeros_comes_and_goes(grid: Grid) -> None:
    back = grid.padded().without_zeros()
    np.testing.assert_array_equal(back.voxels, grid.without_zeros().voxels)
    np.testing.assert_allclose(back.affine, grid.without_zeros().affine, atol=1e-9)
    np.testing.assert_allclose(centre_of_mass(back), centre_of_mass(grid), atol=1e-3)


def test_without_zeros_of_nothing_is_one_voxel() -> None:
    empty = Grid(np.zeros((3, 4, 5), np.float32), np.eye(4)).without_zeros()
    assert empty.voxels.shape == (1, 1, 1)
    np.testing.assert_array_equal(empty.affine, np.eye(4))


@given(st.integers(0, 1 << 32), st.lists(st.integers(1, 6), min_size=1, max_size=3))
def test_a_bounding_box_holds_the_mask_and_touches_it_on_all_sides(seed: int, shape: list[int]) -> None:
    mask = np.random.default_rng(seed).random(shape) > 0.8
    box = bounding_box(mask)
    if box is None:
        assert not mask.any()
        return
    assert mask[box].sum() == mask.sum()
    for axis in range(mask.ndim):
        inside = np.moveaxis(mask[box], axis, 0)
        assert inside[0].any() and inside[-1].any()


@given(
    st.lists(
        st.tuples(st.integers(1, 9), st.integers(0, 8), st.integers(1, 9), st.integers(0, 4)),
        min_size=1,
        max_size=3,
    )
)
def test_a_grown_box_holds_what_lies_within_the_margin(sides: list[tuple[int, int, int, int]]) -> None:
    shape = tuple(size for size, *_rest in sides)
    box = tuple(
        slice(min(start, size - 1), min(start + length, size)) for size, start, length, _margin in sides
    )
    margins = [margin for *_rest, margin in sides]
    wanted = np.zeros(shape, bool)
    near = [
        [n for n in range(size) if side.start - margin <= n < side.stop + margin]
        for size, side, margin in zip(shape, box, margins, strict=True)
    ]
    wanted[np.ix_(*near)] = True
    found = np.zeros(shape, bool)
    grown = grown_box(box, margins, shape)
    found[grown] = True
    np.testing.assert_array_equal(found, wanted)
    assert all(0 <= side.start < side.stop <= size for side, size in zip(grown, shape, strict=True))
    assert grown_box(box, 2, shape) == grown_box(box, [2] * len(shape), shape)


@given(grids(), st.floats(0.5, 8), st.floats(0, 20), st.booleans())
def test_a_covering_grid_covers_all_voxels_and_the_margin(
    grid: Grid, spacing_mm: float, margin_mm: float, keep_coarser: bool
) -> None:
    affine, shape = covering_grid(grid.affine, grid.voxels.shape, spacing_mm, margin_mm, keep_coarser)
    own = np.linalg.norm(grid.affine[:3, :3], axis=0)
    found = np.linalg.norm(affine[:3, :3], axis=0)
    np.testing.assert_allclose(found, np.maximum(own, spacing_mm) if keep_coarser else spacing_mm)
    size = np.array(grid.voxels.shape[::-1])
    corners = np.array([np.full(3, -0.5) - margin_mm / own, size - 0.5 + margin_mm / own])
    corners = corners @ grid.affine[:3, :3].T + grid.affine[:3, 3]
    index = (corners - affine[:3, 3]) @ np.linalg.inv(affine[:3, :3]).T
    assert (index[0] >= -1e-6).all() and (index[1] <= np.array(shape[::-1]) - 1 + 1e-6).all()


@pytest.mark.parametrize("spacing_mm", [0, -1, np.nan, np.inf])
def test_an_impossible_spacing_is_refused(spacing_mm: float) -> None:
    with pytest.raises(InputError, match="spacing"):
        covering_grid(np.eye(4), (2, 2, 2), spacing_mm)


@pytest.mark.parametrize(
    ("affine", "word"),
    [
        (np.eye(3), "4x4"),
        (np.full((4, 4), np.nan), "finite"),
        (np.diag([1.0, 1, 0, 1]), "singular"),
        (np.eye(4) + 0.1 * np.eye(4, k=1), "right angles"),
    ],
)
def test_an_affine_that_is_no_grid_is_refused_by_name(affine: np.ndarray, word: str) -> None:
    with pytest.raises(InputError, match=word) as error:
        require_grid(affine, "the CT")
    assert "the CT" in str(error.value)
