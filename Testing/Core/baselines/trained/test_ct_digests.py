"""A CT is known again when it was moved or stored otherwise, and another one is another."""

import numpy as np
import pytest

from PolyPoseLib.baselines.trained.ct_digests import ct_digest
from PolyPoseLib.data.volume import Volume


@pytest.fixture
def ct():
    voxels = np.random.default_rng(0).integers(-1000, 1500, (5, 6, 7)).astype(np.float32)
    affine = np.diag([0.8, 0.9, 2.5, 1.0])
    affine[:3, 3] = (10, -20, 30)
    return Volume(voxels, affine)


def stored(ct, order, flips):
    """The same image with its axes (i, j, k) in another order, some of them the other way round."""
    affine = ct.affine.copy()
    affine[:3, :3] = ct.affine[:3, list(order)]
    voxels = ct.voxels.transpose(2, 1, 0).transpose(order)
    for axis in flips:
        affine[:3, 3] += affine[:3, axis] * (voxels.shape[axis] - 1)
        affine[:3, axis] *= -1
        voxels = np.flip(voxels, axis)
    return Volume(np.ascontiguousarray(voxels.transpose(2, 1, 0)), affine)


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1), (1, 0, 2)])
@pytest.mark.parametrize("flips", [(), (0,), (1, 2)])
def test_the_order_in_which_axes_are_stored_does_not_matter(ct, order, flips):
    assert ct_digest(stored(ct, order, flips)) == ct_digest(ct)


def test_neither_place_nor_type_nor_padding_matter(ct):
    turn = np.eye(4)
    turn[:2, :2] = [[np.cos(0.2), -np.sin(0.2)], [np.sin(0.2), np.cos(0.2)]]
    turn[:3, 3] = (40, 3, -7)
    assert ct_digest(Volume(ct.voxels, turn @ ct.affine)) == ct_digest(ct)
    assert ct_digest(ct.with_voxels(ct.voxels.astype(np.int16))) == ct_digest(ct)
    assert ct_digest(ct.with_voxels(ct.voxels + np.float32(1e-3))) == ct_digest(ct)
    padded, air = ct.voxels.copy(), ct.voxels.copy()
    padded[0], air[0] = -3024, -1000
    assert ct_digest(ct.with_voxels(padded)) == ct_digest(ct.with_voxels(air))


def test_other_images_have_other_digests(ct):
    changed = ct.voxels.copy()
    changed[2, 3, 4] += 1
    others = [
        ct.with_voxels(changed),
        ct.with_voxels(ct.voxels[:, :, ::-1]),
        Volume(ct.voxels, ct.affine @ np.diag([1, 1, 1.01, 1])),
        Volume(ct.voxels[:-1], ct.affine),
        Volume(ct.voxels.reshape(6, 5, 7), ct.affine),
    ]
    assert len({ct_digest(each) for each in (ct, *others)}) == 6
