"""How the rendering of the soft tissue changes with the modes of its own motion."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np
import torch
from torch import Tensor

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.registration.fit.device_soft_jacobian import DeviceTissue, changes_by_modes
from PolyPoseLib.registration.fit.soft_kernel_arguments import CosineTables, DisplacedTissue, SegmentedRays
from PolyPoseLib.registration.fit.soft_tissue import SoftTissue
from PolyPoseLib.rendering.rigid import Body

SEGMENT_MM = 12.0
"""Modes hardly change over this length of a ray, along which the gradient of the attenuation is summed first."""

NEGLIGIBLE = 1e-6
"""Gradient of the line integral over a segment, 1/mm, below which it has none."""


class SoftJacobian:
    """Derivative of the soft tissue's line integrals by the coefficients of its modes.

    Parameters
    ----------
    soft : SoftTissue
        The soft tissue.
    field : DisplacementField
        Fixed to moving, that it is displaced by.
    freedom : (k, j, i) ndarray
        Share of the modes at the field's nodes, see :meth:`SoftTissue.freedom`.
    size_mm : float
        Of voxels and ray steps.

    """

    def __init__(
        self, soft: SoftTissue, field: DisplacementField, freedom: np.ndarray, size_mm: float
    ) -> None:
        self._size_mm, self._body = size_mm, soft.scene.volume("soft", size_mm)
        self._modes = CosineTables(soft.modes.to_angles, soft.modes.numbers)
        self._tissue = DisplacedTissue(
            np.linalg.inv(field.affine)[:3],
            field.vectors,
            freedom,
            self._body.world_to_index[:3],
            self._body.gradient,
        )
        self._loop = _compiled() if soft.device is None else None
        self._device = soft.device or torch.device("cpu")

    def of_view(self, camera: Camera, correction: np.ndarray) -> np.ndarray:
        """(3 M, H, W) float32 1/mm, for a camera with its correction (4, 4); the modes' x, y, z follow each other."""
        if self._loop is None:
            return self.on_device(camera, correction).cpu().numpy()
        rays = segmented_rays(self._body, camera, correction, self._size_mm)
        changes = np.zeros((len(self._modes.numbers), 3, len(rays.near)), np.float32)
        if (rays.far > rays.near).any():
            self._loop(rays, self._tissue, self._modes, changes)
        return changes.reshape(-1, camera.height, camera.width)

    def on_device(self, camera: Camera, correction: np.ndarray) -> Tensor:
        """The same on torch's device, which is the CPU where the soft tissue has none."""
        rays = segmented_rays(self._body, camera, correction, self._size_mm)
        changes = changes_by_modes(rays, self._on_device, self._modes)
        return changes.reshape(-1, camera.height, camera.width)

    @cached_property
    def _on_device(self) -> DeviceTissue:
        return DeviceTissue.of(self._tissue, self._device)


def _compiled() -> Callable[..., None] | None:
    """The compiled loop, where numba is installed."""
    try:
        from PolyPoseLib.registration.fit.soft_jacobian_kernel import add_changes
    except ImportError:
        return None
    return add_changes


def segmented_rays(body: Body, camera: Camera, correction: np.ndarray, size_mm: float) -> SegmentedRays:
    """The rays of all pixels through the box around a body, for a camera with its correction (4, 4)."""
    source, directions = _rays(camera, correction)
    near, far = _depths(body, source, directions)
    hit = far > near
    first = float(near[hit].min()) if hit.any() else 0.0
    per_segment = max(1, round(SEGMENT_MM / size_mm))
    return SegmentedRays(source, directions, near, far, first, size_mm, per_segment, NEGLIGIBLE)


def _rays(camera: Camera, correction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The source (3,) and the unit directions (H W, 3) of all pixels' rays, with the camera's correction (4, 4)."""
    extrinsic = camera.extrinsic @ np.linalg.inv(correction)
    rotation = extrinsic[:3, :3]
    row, column = np.meshgrid(np.arange(camera.height), np.arange(camera.width), indexing="ij")
    pixels = np.stack([column, row, np.ones_like(row)], axis=-1).reshape(-1, 3)
    directions = pixels @ camera.inverse_intrinsics.T @ rotation
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return -rotation.T @ extrinsic[:3, 3], directions


def _depths(body: Body, source: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distances (P,) mm from the source at which rays enter and leave the box, in LPS, around a body.

    Rays that miss it leave where they enter.
    """
    low, high = body.corners.min(axis=0), body.corners.max(axis=0)
    steep = np.where(np.abs(directions) < 1e-9, 1e-9, directions)
    first, second = (low - source) / steep, (high - source) / steep
    near = np.maximum(np.minimum(first, second).max(axis=1), 0.0)
    return near, np.maximum(np.maximum(first, second).min(axis=1), near)
