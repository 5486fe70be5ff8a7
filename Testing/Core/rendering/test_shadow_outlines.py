"""Outlines of spheres, whose shadows are known in closed form."""

import numpy as np
import pytest

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.geometry.camera import Camera, intrinsics_matrix, look_at
from PolyPoseLib.rendering.select import select_backend
from PolyPoseLib.rendering.silhouettes import Silhouettes


def balls(spacing, centres, radius):
    """Balls, numbered from 1, as labels."""
    size = int(90 / spacing)
    affine = np.diag([spacing, -spacing, spacing, 1.0])
    affine[:3, 3] = affine[:3, :3] @ np.full(3, -(size - 1) / 2)
    index = np.stack(np.meshgrid(*[np.arange(size)] * 3, indexing="ij")[::-1], axis=-1)
    points = index @ affine[:3, :3].T + affine[:3, 3]
    labels = np.zeros((size,) * 3, np.uint8)
    for number, centre in enumerate(centres, start=1):
        labels[np.linalg.norm(points - centre, axis=-1) <= radius] = number
    return Volume(labels, affine)


@pytest.mark.parametrize("spacing", [1.0, 2.0, 3.0])
@pytest.mark.parametrize("seed", range(3))
def test_a_moved_ball_has_its_outline_where_its_shadow_ends(spacing, seed):
    rng = np.random.default_rng(seed)
    centres = np.array([[-20.0, 5, 3], [18, -8, -10]])
    pose = np.eye(4)
    pose[:3, 3] = rng.uniform(-8, 8, 3)
    source = np.array([0, -700, 0]) + rng.uniform(-100, 100, 3)
    camera = Camera(intrinsics_matrix(1000, 0.5, 400, 400), look_at(source, (0, 0, 0)), 400, 400)
    silhouettes = Silhouettes(balls(spacing, centres, 14.0), 3, select_backend())
    lines = silhouettes.outlines(1, camera, pose)
    assert len(lines) == 1
    # Every ray through the outline passes the ball's centre, as it was moved, at its radius.
    rays = (
        np.c_[lines[0], np.ones(len(lines[0]))]
        @ np.linalg.inv(camera.intrinsics).T
        @ camera.extrinsic[:3, :3]
    )
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    to_ball = centres[1] - pose[:3, 3] - source
    passed = np.linalg.norm(to_ball - (rays @ to_ball)[:, None] * rays, axis=1)
    assert passed.mean() == pytest.approx(14.0, abs=0.5 * spacing)
    assert np.abs(passed - 14.0).max() < spacing
    assert silhouettes.outlines(2, camera, pose) == []  # it has no voxel


def test_what_lies_behind_the_source_or_beside_the_image_has_no_outline():
    silhouettes = Silhouettes(balls(2.0, [np.zeros(3)], 14.0), 1, select_backend())
    camera = Camera(intrinsics_matrix(1000, 0.5, 400, 400), look_at((0, -700, 0), (0, 0, 0)), 400, 400)
    assert silhouettes.outlines(0, camera, np.eye(4))
    for shift in ((0, -900, 0), (500, 0, 0)):
        pose = np.eye(4)
        pose[:3, 3] = -np.array(shift)
        assert silhouettes.outlines(0, camera, pose) == []
