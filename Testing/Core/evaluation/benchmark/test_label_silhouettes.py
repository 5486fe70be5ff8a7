"""Silhouettes against the hull of every voxel's shadow, and against points along the rays."""

import numpy as np
import pytest
import scored_case
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.evaluation.benchmark import silhouettes
from PolyPoseLib.evaluation.benchmark.silhouettes import silhouette
from PolyPoseLib.geometry.camera import Camera, intrinsics_matrix, look_at


def blobs(seed):
    """A random mask on a random grid, oblique, of any handedness, and a random camera that sees some of it."""
    rng = np.random.default_rng(seed)
    shape = tuple(rng.integers(1, 14, 3))
    affine = np.eye(4)
    affine[:3, :3] = Rotation.random(random_state=seed).as_matrix() * rng.uniform(0.7, 4.0, 3)
    affine[:3, rng.integers(3)] *= rng.choice([-1, 1])
    affine[:3, 3] = rng.uniform(-15, 15, 3)
    centre = affine[:3, :3] @ ((np.array(shape[::-1]) - 1) / 2) + affine[:3, 3]
    voxels = rng.random(shape) < rng.choice([0.03, 0.5, 0.97, 1.0])
    source = centre + 300 * Rotation.random(random_state=seed + 1).as_matrix()[0]
    pixels = tuple(int(n) for n in rng.integers(20, 40, 2))
    intrinsics = intrinsics_matrix(500.0, tuple(rng.uniform(1.0, 6.0, 2)), *pixels)
    intrinsics[0, 1] = rng.uniform(-20, 20)
    return Volume(voxels, affine), Camera(
        intrinsics, look_at(source, centre + rng.uniform(-20, 20, 3)), *pixels
    )


@pytest.mark.parametrize("seed", range(30))
def test_a_pixel_is_seen_when_it_lies_in_the_hull_of_a_voxels_shadow(seed):
    mask, camera = blobs(seed)
    expected = scored_case.exact_mask(mask.voxels, mask.affine, 1, camera)
    assert np.array_equal(silhouette(mask, camera), expected)


def test_blocks_of_voxels_change_nothing():
    affine, shape = scored_case.oblique()
    labels = scored_case.labels_at(scored_case.world_points(affine, shape))
    camera = scored_case.view(0.7)
    for number in (7, 3, 200):
        expected = scored_case.exact_mask(labels, affine, number, camera)
        assert expected.sum() > 100
        assert np.array_equal(silhouette(Volume(labels == number, affine), camera), expected)


@pytest.mark.parametrize("seed", range(100, 104))
def test_parts_change_nothing(seed, monkeypatch):
    mask, camera = blobs(seed)
    expected = scored_case.exact_mask(mask.voxels, mask.affine, 1, camera)
    monkeypatch.setattr(silhouettes, "_BOXES_AT_ONCE", 7)
    monkeypatch.setattr(silhouettes, "_TESTS_AT_ONCE", 50)
    assert np.array_equal(silhouette(mask, camera), expected)


def test_every_point_of_a_ray_inside_a_voxel_is_seen():
    mask, camera = blobs(7)
    inverse = np.linalg.inv(mask.affine)

    def inside(points):
        index = np.rint(points @ inverse[:3, :3].T + inverse[:3, 3]).astype(int)[:, ::-1]
        on = ((index >= 0) & (index < mask.shape)).all(axis=1)
        found = np.zeros(len(points), bool)
        found[on] = mask.voxels[tuple(index[on].T)] > 0
        return found

    sampled = scored_case.sampled_mask(inside, camera, np.arange(200.0, 400.0, 0.25))
    seen = silhouette(mask, camera)
    assert sampled.sum() > 20
    assert not (sampled & ~seen).any()
    assert (seen & ~sampled).sum() <= 0.05 * seen.sum()


def test_what_lies_behind_the_source_is_not_seen_and_around_it_everything():
    camera = Camera(intrinsics_matrix(100.0, 1.0, 20, 20), np.eye(4), 20, 20)
    straight = np.diag([10.0, 10.0, 10.0, 1.0])
    voxels = np.ones((1, 1, 1), bool)
    behind, around = straight.copy(), straight.copy()
    behind[2, 3] = -50.0
    assert not silhouette(Volume(voxels, behind), camera).any()
    assert silhouette(Volume(voxels, around), camera).all()


def test_a_ray_along_an_edge_gives_no_nan():
    """A camera whose rays run within the faces of voxels: 0 / 0 in the slab test must hide nothing."""
    camera = Camera(intrinsics_matrix(100.0, 1.0, 21, 21), np.eye(4), 21, 21)
    affine = np.eye(4)
    affine[:3, 3] = (0.5, 0.5, 100.0)  # the voxel spans 0 to 1: pixel (10, 10) looks along its edge
    seen = silhouette(Volume(np.ones((1, 1, 1), bool), affine), camera)
    assert seen[10, 10] and seen.sum() in (3, 4)


def test_nothing_is_seen_of_an_empty_mask_or_beside_the_detector():
    camera = Camera(intrinsics_matrix(100.0, 1.0, 20, 20), np.eye(4), 20, 20)
    affine = np.eye(4)
    affine[:3, 3] = (500.0, 0.0, 100.0)
    assert not silhouette(Volume(np.ones((2, 2, 2), bool), affine), camera).any()
    assert not silhouette(Volume(np.zeros((2, 2, 2), bool), np.eye(4)), camera).any()
