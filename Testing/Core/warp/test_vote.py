"""Labels between voxels against interpolating every label's mask."""

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from PolyPoseLib.warp.vote import LabelVote, grid_index


@pytest.mark.parametrize("labels_in_use", [2, 4, 9])
def test_largest_weight_wins(labels_in_use):
    labels = np.random.default_rng(2).integers(0, labels_in_use, (7, 8, 9)).astype(np.int16)
    labels[:3, :3] = 1
    index = np.random.default_rng(3).uniform(0, [[8], [7], [6]], (3, 3000))
    masks = np.stack(
        [map_coordinates((labels == n) * 1.0, index[::-1], order=1) for n in range(labels_in_use)]
    )
    found = LabelVote(labels)(index)
    assert found.dtype == labels.dtype
    assert np.array_equal(found, masks.argmax(0))


def test_at_voxels_the_label_is_the_voxels_own():
    labels = np.random.default_rng(0).integers(0, 5, (5, 6, 7)).astype(np.uint8)
    assert np.array_equal(LabelVote(labels).on_grid(np.eye(4), labels.shape), labels)
    back = np.diag([-1.0, 1, 1, 1])
    back[0, 3] = 6
    assert np.array_equal(LabelVote(labels).on_grid(back, labels.shape), labels[:, :, ::-1])


def test_half_a_voxel_beyond_the_border():
    voter = LabelVote(np.full((7, 8, 9), 3, dtype=np.int16))
    assert not voter(np.array([[-0.6, 3], [3, 3], [3, 6.6]])).any()
    assert (voter(np.array([[-0.4, 3, 8.4], [3, 3, 7.4], [3, 6.4, -0.4]])) == 3).all()


def test_equal_weights_go_to_the_smallest_label():
    labels = np.zeros((1, 1, 2), dtype=np.int16)
    labels[0, 0] = (5, 2)
    assert LabelVote(labels)(np.array([[0.5], [0.0], [0.0]]))[0] == 2
    assert LabelVote(labels[:, :, ::-1])(np.array([[0.5], [0.0], [0.0]]))[0] == 2


def test_grid_index_is_the_affine_map():
    matrix = np.vstack([np.random.default_rng(1).normal(size=(3, 4)), [0, 0, 0, 1]])
    found = grid_index(matrix, (3, 4, 5))
    assert np.allclose(found[:, 2, 1, 4], matrix[:3] @ [4, 1, 2, 1])
