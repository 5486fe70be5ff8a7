"""Rendering of one body under many poses at once, by the compiled kernels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.rigid import rigid_inverse
from PolyPoseLib.rendering.kernel_arguments import PoseFrames
from PolyPoseLib.rendering.numba_backend import flat_voxels
from PolyPoseLib.rendering.rigid import Body, index_rays


@dataclass(frozen=True)
class PoseImages:
    """A body under S poses in one view.

    Attributes
    ----------
    windows : (S, 4) ndarray
        Row 0, row 1, column 0, column 1 of the part of the image that the body covers, ends excluded.
    images : (S, H, W) ndarray
        float32 line integrals.
    jacobians : (S, 6, H, W) ndarray, optional
        float32 derivatives by each pose's perturbation, rotation (1/rad) and translation (1/mm).

    """

    windows: np.ndarray
    images: np.ndarray
    jacobians: np.ndarray | None


def project_poses(
    body: Body, camera: Camera, poses: np.ndarray, step_mm: float, jacobian: bool = False
) -> PoseImages:
    """Render a body under many poses.

    The images are those of :func:`PolyPoseLib.rendering.rigid.project_body`.

    Parameters
    ----------
    body : Body
        The body.
    camera : Camera
        Of the image.
    poses : (S, 4, 4) ndarray
        Fixed to moving, mm.
    step_mm : float
        Distance of the samples along each ray.
    jacobian : bool
        Compute the derivatives as well.

    Returns
    -------
    PoseImages
        Of the whole image each.

    """
    from PolyPoseLib.rendering import pose_kernels
    from PolyPoseLib.rendering.kernels import TILE

    count, height, width = len(poses), camera.height, camera.width
    windows = footprints(body, camera, poses)
    rays = index_rays(body, camera, poses, (0, height, 0, width), step_mm)
    tiles = (count, -(-height // TILE), -(-width // TILE))
    near, far = np.empty(tiles), np.empty(tiles)
    half_edges = np.full(3, body.occupied.half_edge)
    pose_kernels.depth_ranges_of_poses(body.occupied.centres, half_edges, rays, near, far)
    images = np.zeros((count, height, width), np.float32)
    volume, size = flat_voxels(body.voxels), body.voxels.shape
    if not jacobian:
        pose_kernels.project_poses(volume, size, rays, windows, near, far, images)
        return PoseImages(windows, images, None)
    jacobians = np.zeros((count, 6, height, width), np.float32)
    frames = _frames(body, camera, poses)
    pose_kernels.project_poses_with_jacobian(
        volume, size, rays, windows, near, far, frames, images, jacobians
    )
    return PoseImages(windows, images, jacobians)


def footprints(body: Body, camera: Camera, poses: np.ndarray) -> np.ndarray:
    """(S, 4) :func:`PolyPoseLib.rendering.rigid.footprint` of a body under poses (S, 4, 4).

    Raises ValueError for poses that are not finite: the kernels do not look where they write.
    """
    if not np.isfinite(poses).all():
        raise ValueError("a pose is not finite")
    to_camera = camera.extrinsic @ rigid_inverse(poses)
    corners = body.corners @ np.swapaxes(to_camera[:, :3, :3], 1, 2) + to_camera[:, None, :3, 3]
    behind = (corners[..., 2] <= 1.0).any(axis=1)
    corners[behind] = 1.0
    pixels = corners @ camera.intrinsics.T
    pixels = pixels[..., :2] / pixels[..., 2:]
    ends = (camera.width, camera.height)
    low = np.clip(np.floor(pixels.min(axis=1)), 0, ends).astype(np.int64)
    high = np.clip(np.ceil(pixels.max(axis=1)) + 1, low, ends).astype(np.int64)
    windows = np.stack([low[:, 1], high[:, 1], low[:, 0], high[:, 0]], axis=1)
    windows[behind] = (0, camera.height, 0, camera.width)
    return windows


def _frames(body: Body, camera: Camera, poses: np.ndarray) -> PoseFrames:
    """What turns the kernels' moments into derivatives by the poses."""
    rotation = camera.extrinsic[:3, :3]
    source = -rotation.T @ camera.extrinsic[:3, 3]
    return PoseFrames(
        np.ascontiguousarray(body.world_to_index[:3, :3]),
        poses[:, :3, :3] @ source + poses[:, :3, 3] - body.centre,
        poses[:, :3, :3] @ (rotation.T @ camera.inverse_intrinsics),
    )
