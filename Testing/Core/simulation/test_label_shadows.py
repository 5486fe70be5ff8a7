"""Silhouettes of labels against rays that are tested voxel by voxel."""

import numpy as np
import pytest
from segment_files import random_affine

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera, look_at
from PolyPoseLib.simulation.label_shadows import label_shadows


def _met(voxels, affine, camera):
    """For every pixel whether its ray meets a voxel: the slab test on each voxel of a small map."""
    met = np.zeros((camera.height, camera.width), bool)
    inverse = np.linalg.inv(affine)
    eye = -camera.extrinsic[:3, :3].T @ camera.extrinsic[:3, 3]
    start = inverse[:3, :3] @ eye + inverse[:3, 3]
    low = np.argwhere(voxels)[:, ::-1] - 0.5
    for row in range(camera.height):
        for column in range(camera.width):
            at = np.linalg.solve(camera.intrinsics, [column, row, 1.0])
            slope = inverse[:3, :3] @ (camera.extrinsic[:3, :3].T @ at)
            one, other = (low - start) / slope, (low + 1 - start) / slope
            enter, leave = np.minimum(one, other).max(axis=1), np.maximum(one, other).min(axis=1)
            met[row, column] = (enter < leave).any()
    return met


def _camera(rng, affine, shape, size=24):
    centre = affine[:3, :3] @ (np.array(shape[::-1]) - 1) / 2 + affine[:3, 3]
    direction = rng.normal(size=3)
    source = centre + 300 * direction / np.linalg.norm(direction)
    focal = rng.uniform(3, 5) * size
    intrinsics = np.array([[focal, 0, size / 2 + 1], [0, focal * 1.1, size / 2 - 2], [0, 0, 1.0]])
    return Camera(intrinsics, look_at(source, centre, rng.normal(size=3)), size, size + 3)


@pytest.mark.parametrize("seed", range(6))
def test_masks_are_the_rays_that_meet_voxels(seed):
    rng = np.random.default_rng(seed)
    shape = (14, 11, 17)
    affine = random_affine(rng, spacing=(2.5, 3.0, 2.0), oblique=bool(seed % 2))
    voxels = np.zeros(shape, np.uint8)
    voxels[2:12, 3:8, 4:13] = 1
    voxels[rng.random(shape) < 0.02] = 2
    voxels[4:8, 3:7, 5:9] = 3  # a whole block, behind or before the others
    camera = _camera(rng, affine, shape)
    masks = label_shadows(Volume(voxels, affine), camera, {"both": [1, 3], "dust": [2], "none": [7]})
    assert list(masks) == ["both", "dust", "none"] and not masks["none"].any()
    for name, numbers, share in (("both", (1, 3), 0.02), ("dust", (2,), 0.06)):
        true = _met(np.isin(voxels, numbers), affine, camera)
        # Rays that cut less than a fifth of a voxel off a corner may be missed, none may be made up.
        assert not (masks[name] & ~true).any()
        assert (true & ~masks[name]).sum() <= share * true.sum() + 3


def test_more_structures_than_bits(seed=0):
    rng = np.random.default_rng(seed)
    voxels = np.arange(4 * 5 * 7).reshape(4, 5, 7) + 1
    affine = np.diag([8.0, 8.0, 8.0, 1.0])
    camera = _camera(rng, affine, voxels.shape)
    groups = {f"cell {n}": [n] for n in range(1, 141)}
    masks = label_shadows(Volume(voxels, affine), camera, groups)
    for number in (1, 64, 65, 140):
        assert (masks[f"cell {number}"] == _met(voxels == number, affine, camera)).mean() > 0.99
        assert masks[f"cell {number}"].any()


def test_labels_behind_the_source_are_refused():
    labels = Volume(np.ones((5, 5, 5), np.uint8), np.diag([20.0, 20.0, 20.0, 1.0]))
    camera = Camera(
        np.array([[50.0, 0, 8], [0, 50.0, 8], [0, 0, 1]]),
        look_at((40, 40, 30), (40, 40, 90), (0, 1, 0)),
        16,
        16,
    )
    with pytest.raises(InputError, match="inside or behind"):
        label_shadows(labels, camera, {"a": [1]})
