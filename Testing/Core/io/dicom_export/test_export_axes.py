"""Axes of a grid are exchanged and reversed without moving a value."""

import numpy as np
import pytest
from segment_files import random_affine

from PolyPoseLib.io.dicom_export.axes import reordered


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("more", [(), (3,)])
def test_every_value_stays_at_its_place(seed, more):
    rng = np.random.default_rng(seed)
    values = rng.random((3, 4, 5, *more))
    affine, like = random_affine(rng, oblique=False), random_affine(rng, oblique=False)
    moved, turned = reordered(values, affine, like)
    assert np.allclose(turned[:3, :3] / np.linalg.norm(turned[:3, :3], axis=0), np.sign(like[:3, :3]))
    inverse = np.linalg.inv(affine)
    for index in np.ndindex(moved.shape[:3]):
        at = inverse @ turned @ [*index[::-1], 1]
        i, j, k = np.rint(at[:3]).astype(int)
        assert np.allclose(at[:3], [i, j, k])
        assert np.array_equal(moved[index], values[k, j, i])


@pytest.mark.parametrize("seed", range(5))
def test_axes_that_agree_are_left_alone(seed):
    rng = np.random.default_rng(seed)
    values, affine = rng.random((3, 4, 5)), random_affine(rng)
    moved, turned = reordered(values, affine, affine)
    assert np.array_equal(moved, values)
    assert np.array_equal(turned, affine)
