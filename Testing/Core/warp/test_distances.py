"""Exact distances at voxels and at the nodes of coarser grids."""

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt
from scipy.spatial import cKDTree

from PolyPoseLib.warp.distances import distance_at_nodes, distance_at_nodes_by_voxels, distance_at_voxels


def blobs(seed, shape=(12, 15, 17)) -> np.ndarray:
    return np.random.default_rng(seed).random(shape) > 0.97


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_at_voxels_and_beyond_them(seed):
    mask, spacing, pad = blobs(seed), np.array([0.7, 1.1, 2.5]), np.array([4, 2, 1])
    found = distance_at_voxels(mask, spacing, pad)
    padded = np.pad(mask, [(1, 1), (2, 2), (4, 4)])
    assert found.shape == padded.shape
    expected = distance_transform_edt(~padded, sampling=spacing[::-1])
    assert np.abs(np.maximum(found, 0) - expected).max() < 1e-4


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_at_nodes_of_any_parallel_grid(seed):
    mask, spacing = np.zeros((14, 20, 22), dtype=bool), np.array([0.7, 1.1, 2.5])
    mask[4:10, 3:15, 6:20] = blobs(seed, (6, 12, 14))
    box = tuple(slice(int(a.min()), int(a.max()) + 1) for a in np.nonzero(mask))
    rng = np.random.default_rng(seed)
    nodes = [np.sort(rng.uniform(-9, n + 9, 16)) for n in mask.shape[::-1]]
    found = distance_at_nodes(mask[box], box, spacing, nodes)
    points = np.stack(np.meshgrid(*nodes[::-1], indexing="ij"), axis=-1)[..., ::-1] * spacing
    voxels = np.argwhere(mask)[:, ::-1] * spacing
    expected = cKDTree(voxels).query(points)[0]
    far = expected > spacing.max()
    assert far.mean() > 0.5
    assert np.abs(found - expected)[far].max() < 1e-4


def test_at_nodes_that_are_voxels_both_ways_agree():
    mask, spacing = np.zeros((14, 16, 18), dtype=bool), np.array([1.0, 1.5, 2.0])
    mask[3:9, 4:12, 5:13] = True
    box = (slice(3, 9), slice(4, 12), slice(5, 13))
    everywhere = distance_at_voxels(mask, spacing, np.zeros(3, int))
    at_nodes = distance_at_nodes(mask[box], box, spacing, [np.arange(n) for n in mask.shape[::-1]])
    assert np.abs(everywhere - at_nodes).max() < 1e-4
    assert at_nodes[5, 8, 9] < -2


def test_without_numba_the_distances_are_the_same():
    pytest.importorskip("numba", reason="numba is not installed")
    mask, spacing = np.zeros((16, 20, 22), dtype=bool), np.array([0.7, 1.1, 1.5])
    mask[4:12, 3:10, 6:20] = True
    mask[5:9, 12:15, 8:12] = True
    box = (slice(4, 12), slice(3, 15), slice(6, 20))
    nodes = [np.arange(-8, n + 8, 2.3) for n in mask.shape[::-1]]
    compiled = distance_at_nodes(mask[box], box, spacing, nodes)
    plain = distance_at_nodes_by_voxels(mask[box], box, spacing, nodes)
    assert np.abs(compiled - plain).max() < 0.75
    assert np.abs(compiled - plain).mean() < 0.02


def test_the_envelope_is_the_minimum_over_all_pairs():
    kernel = pytest.importorskip("PolyPoseLib.warp.envelope_kernel", reason="numba is not installed")
    rng = np.random.default_rng(0)
    squared = (rng.random((5, 30, 40)) * 900).astype(np.float32)
    squared[rng.random(squared.shape) > 0.3] = np.inf
    squared[2, :, 7] = np.inf
    places = np.sort(rng.uniform(-20, 60, 25))
    found = np.empty((5, 25, 40), dtype=np.float32)
    kernel.lower_envelope(squared, 0.8, places, found)
    cost = (places[:, None] - np.arange(30) * 0.8) ** 2
    expected = (squared[:, None] + cost[None, :, :, None]).min(axis=2)
    assert np.array_equal(np.isinf(found), np.isinf(expected))
    assert np.allclose(found, expected, rtol=1e-5)
