"""Random bodies and views that the tests of rendering share."""

import numpy as np
from scipy.ndimage import gaussian_filter
from scipy.spatial.transform import Rotation

from PolyPoseLib.geometry.camera import Camera, intrinsics_matrix, look_at
from PolyPoseLib.geometry.rigid import about, perturbation
from PolyPoseLib.rendering.rigid import Body

STEP = 2.5


def random_body(seed, shape=(14, 17, 20)):
    """A smooth random body with a border of zeros, oblique and left-handed for odd seeds."""
    rng = np.random.default_rng(seed)
    voxels = gaussian_filter(rng.random(shape), 1.2)
    voxels = np.pad(0.05 * (voxels - voxels.min()) / np.ptp(voxels), 1).astype(np.float32)
    affine = np.eye(4)
    affine[:3, :3] = Rotation.from_rotvec(rng.normal(0, 0.5, 3)).as_matrix() * rng.uniform(2, 4, 3)
    if seed % 2:
        affine[:3, 0] *= -1
    affine[:3, 3] = rng.uniform(-60, 60, 3)
    centre = affine[:3, :3] @ (np.array(voxels.shape[::-1]) / 2) + affine[:3, 3]
    return Body(voxels, affine, centre)


def random_view(seed, body, height=13, width=16):
    rng = np.random.default_rng(100 + seed)
    way = rng.normal(size=3)
    source = body.centre + 600 * way / np.linalg.norm(way)
    intrinsics = intrinsics_matrix(900, 6.0, height, width)
    intrinsics[:2, 2] += rng.normal(0, 1, 2)
    camera = Camera(intrinsics, look_at(source, body.centre + rng.normal(0, 4, 3)), height, width)
    pose = about(perturbation(np.concatenate([rng.normal(0, 0.2, 3), rng.normal(0, 4, 3)])), body.centre)
    return camera, pose


def assert_close(found, expected, tolerance):
    assert found.shape == expected.shape
    assert np.linalg.norm(found - expected) <= tolerance * np.linalg.norm(expected)
