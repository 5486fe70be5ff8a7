"""Folds are smoothed away, nothing else moves, and what is held stays."""

import numpy as np
import pytest
from bones_case import grid_affine

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.warp.dense import jacobian_determinant
from PolyPoseLib.warp.unfold import unfolded

SHAPE = (34, 36, 38)


def bumpy(seed: int, height_mm: float) -> DisplacementField:
    """A field that pushes tissue around one place inside, so far that it folds where height_mm is large."""
    rng = np.random.default_rng(seed)
    affine = grid_affine(seed, (3.0, 3.0, 3.0))
    k, j, i = np.meshgrid(*[np.arange(n) for n in SHAPE], indexing="ij")
    middle = rng.uniform(14, 20, 3)
    squared = (k - middle[0]) ** 2 + (j - middle[1]) ** 2 + (i - middle[2]) ** 2
    way = rng.normal(size=3)
    vectors = height_mm * np.exp(-squared / 8)[..., None] * way / np.linalg.norm(way)
    return DisplacementField(vectors.astype(np.float32), affine)


def nothing_held(points):
    return np.zeros(len(points), bool)


@pytest.mark.parametrize("seed", range(5))
def test_folds_go_and_the_rest_stays(seed):
    field = bumpy(seed, 25.0)
    assert (jacobian_determinant(field) <= 0).any()
    smoothed = unfolded(field, nothing_held)
    assert jacobian_determinant(smoothed).min() > 0
    changed = np.linalg.norm(smoothed.vectors - field.vectors, axis=-1) > 0
    assert changed.mean() < 0.1
    assert not changed[0].any() and not changed[:, :, -1].any()


@pytest.mark.parametrize("seed", range(3))
def test_held_nodes_do_not_move(seed):
    field = bumpy(seed, 25.0)
    rng = np.random.default_rng(seed)
    held = rng.random(SHAPE) < 0.3
    back = np.linalg.inv(field.affine)

    def hold(points):
        index = np.rint(points @ back[:3, :3].T + back[:3, 3]).astype(int)
        return held[index[:, 2], index[:, 1], index[:, 0]]

    smoothed = unfolded(field, hold)
    np.testing.assert_array_equal(smoothed.vectors[held], field.vectors[held])
    assert (jacobian_determinant(smoothed) <= 0).sum() < (jacobian_determinant(field) <= 0).sum()


def test_a_field_without_folds_comes_back_itself():
    field = bumpy(1, 2.0)
    assert unfolded(field, nothing_held) is field


def test_a_field_at_the_border_and_a_thin_one():
    field = bumpy(0, 25.0)
    cut = DisplacementField(np.ascontiguousarray(field.vectors[16:]), field.affine)
    before, after = (jacobian_determinant(each) <= 0 for each in (cut, unfolded(cut, nothing_held)))
    assert after.sum() <= before.sum()
    thin = DisplacementField(np.ascontiguousarray(field.vectors[:2]), field.affine)
    assert unfolded(thin, nothing_held) is thin
