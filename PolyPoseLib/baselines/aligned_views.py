"""X-rays as a flat detector parallel to the axis of rotation would have recorded them.

The ramp filter of a cone-beam reconstruction runs along detector rows, which must lie in the plane in which the source
turns. Any two flat detectors behind one source see the same rays, so an X-ray on a tilted or rolled detector is
resampled by a homography, which leaves its line integrals as they are; where the detector is parallel already, pixels
coincide and nothing is interpolated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt, map_coordinates

from PolyPoseLib.data.xray import Xray
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.registration.fit.levels import binned

SUPERIOR = np.array([0.0, 0.0, 1.0])

_PREFERENCE = 1e-3
"""By how much (of one view) the superior axis is preferred where the views leave the axis of rotation open."""

_ALONG_AXIS = np.sin(np.radians(20.0))
"""A view within 20 degrees of the axis of rotation has no row in the plane of rotation."""

_MAX_PIXELS = 4096
"""Along a side of an aligned detector."""


@dataclass(frozen=True, eq=False)
class AlignedViews:
    """X-rays on detectors that are parallel to one axis.

    Attributes
    ----------
    axis
        (3,) unit vector in the world, the axis about which the source turns; rows run perpendicular to it.
    images
        (N, H, W) float32 line integrals; beyond the detector, the value of its nearest pixel.
    cameras
        Of these images.

    """

    axis: np.ndarray
    images: np.ndarray
    cameras: tuple[Camera, ...]


def align_views(xrays: Sequence[Xray], near: np.ndarray, pitch_mm: float) -> AlignedViews:
    """Average X-rays to about a pitch, and resample them onto detectors parallel to their common axis of rotation.

    Parameters
    ----------
    xrays
        With an extrinsic.
    near
        (3,) LPS mm, the point where the pitch is meant.
    pitch_mm
        Wanted distance of rays there; X-rays that are finer are averaged over whole blocks of pixels.

    Raises
    ------
    InputError
        No camera, `near` behind a source, or a view along the axis about which the others turn.

    """
    views = [_coarse(xray, near, pitch_mm) for xray in xrays]
    axis = rotation_axis([camera for _, camera in views])
    # One focal length for all: RTK has one pitch for a stack.
    focal = _focal_along(views[0][1], axis)
    aligned = [
        _parallel(camera, axis, focal, xray.name) for xray, (_, camera) in zip(xrays, views, strict=True)
    ]
    height = max(camera.height for camera in aligned)
    width = max(camera.width for camera in aligned)
    if max(height, width) > _MAX_PIXELS:
        raise InputError(
            f"The X-rays would need a detector of {width} x {height} pixels to be parallel to one axis: their cameras "
            "differ too much for a cone-beam reconstruction; check their extrinsics and principal points."
        )
    cameras = tuple(Camera(each.intrinsics, each.extrinsic, height, width) for each in aligned)
    images = np.stack(
        [_resampled(image, camera, to) for (image, camera), to in zip(views, cameras, strict=True)]
    )
    return AlignedViews(axis, images, cameras)


def rotation_axis(cameras: Sequence[Camera]) -> np.ndarray:
    """(3,) unit vector most perpendicular to all views; superior where one view, or parallel ones, leave it open."""
    directions = np.stack([camera.axis for camera in cameras])
    scatter = directions.T @ directions - _PREFERENCE * np.outer(SUPERIOR, SUPERIOR)
    _, vectors = np.linalg.eigh(scatter)
    axis = vectors[:, 0]
    # Its sign is free; a fixed one keeps the reconstruction the same whatever the order of the views.
    return axis if axis[np.argmax(np.abs(axis))] > 0 else -axis


def _coarse(xray: Xray, near: np.ndarray, pitch_mm: float) -> tuple[np.ndarray, Camera]:
    """The X-ray's blocks of pixels, gaps in its mask filled from their nearest pixel, and their camera."""
    if xray.extrinsic is None:
        raise InputError(
            f'"{xray.name}" has no camera, which a reconstruction needs: give its "extrinsic", or find the cameras '
            "by a registration first."
        )
    camera = Camera(xray.intrinsics, xray.extrinsic, *xray.image.shape)
    depth = float(camera.depth(near))
    if depth <= 0:
        raise InputError(
            f'"{xray.name}": the CT lies behind the X-ray source; give an "extrinsic" whose z axis points from the '
            "source to the detector, for points in LPS millimetres of the CT."
        )
    finest = depth / max(camera.intrinsics[0, 0], camera.intrinsics[1, 1])
    factor = int(np.clip(pitch_mm // finest, 1, min(camera.height, camera.width) // 2 or 1))
    image, mask = binned(xray.image, xray.mask, factor)
    if not mask.all():
        # A masked pixel is unknown, and zero would be a sharp edge, which the ramp filter spreads over its row.
        nearest = distance_transform_edt(~mask, return_distances=False, return_indices=True)
        image = image[tuple(np.asarray(nearest))] if mask.any() else np.zeros_like(image)
    return image, camera.binned(factor)


def _focal_along(camera: Camera, axis: np.ndarray) -> np.ndarray:
    """(2,) focal lengths in pixels across and along the axis, which a detector that is on its side has exchanged."""
    on_its_side = abs(camera.extrinsic[0, :3] @ axis) > np.sqrt(0.5)
    return np.diag(camera.intrinsics)[[1, 0] if on_its_side else [0, 1]]


def _parallel(camera: Camera, axis: np.ndarray, focal: np.ndarray, name: str) -> Camera:
    """The smallest camera at the same source that sees all pixels and whose columns are parallel to the axis."""
    forward = camera.axis - (camera.axis @ axis) * axis
    length = np.linalg.norm(forward)
    if length < _ALONG_AXIS:
        raise InputError(
            f'"{name}" looks along the axis about which the other X-rays turn, so its rows cannot be filtered: leave '
            "it out, or compare methods that need no reconstruction."
        )
    down, forward = -axis, forward / length
    rotation = np.stack([np.cross(down, forward), down, forward])
    extrinsic = np.eye(4)
    extrinsic[:3, :3] = rotation
    extrinsic[:3, 3] = -rotation @ camera.source

    rows, columns = np.meshgrid([0, camera.height - 1], [0, camera.width - 1], indexing="ij")
    pixels = np.stack([columns, rows, np.ones_like(rows)], axis=-1).reshape(4, 3)
    rays = pixels @ (rotation @ camera.extrinsic[:3, :3].T @ camera.inverse_intrinsics).T
    if rays[:, 2].min() <= 1e-3 * np.linalg.norm(rays, axis=1).max():
        raise InputError(
            f'"{name}": its detector is too wide or too far from its principal point for a cone-beam reconstruction; '
            "check the principal point and the extrinsic."
        )
    plane = rays[:, :2] / rays[:, 2:] * focal
    first = plane.min(axis=0)
    width, height = (int(n) for n in np.ceil(np.ptp(plane, axis=0) - 1e-6) + 1)
    intrinsics = np.array([[focal[0], 0, -first[0]], [0, focal[1], -first[1]], [0, 0, 1]])
    return Camera(intrinsics, extrinsic, min(height, _MAX_PIXELS + 1), min(width, _MAX_PIXELS + 1))


def _resampled(image: np.ndarray, camera: Camera, to: Camera) -> np.ndarray:
    """The image of one camera as another at the same source records it, (H, W) float32."""
    rays = to.pixel_directions() @ camera.extrinsic[:3, :3].T @ camera.intrinsics.T
    column, row = np.moveaxis(rays[..., :2] / np.maximum(rays[..., 2:], 1e-6), -1, 0)
    return map_coordinates(image, [row, column], order=1, mode="nearest", output=np.float32)
