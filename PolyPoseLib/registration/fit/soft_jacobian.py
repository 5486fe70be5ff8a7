"""How the rendering of the soft tissue changes with the modes of its own motion."""

from __future__ import annotations

import numpy as np

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.registration.fit.soft_kernel_arguments import CosineTables, DisplacedTissue, SegmentedRays
from PolyPoseLib.registration.fit.soft_tissue import SoftTissue
from PolyPoseLib.rendering.rigid import Body

SEGMENT_MM = 12.0
"""Modes hardly change over this length of a ray, along which the gradient of the attenuation is summed first."""

RAYS_AT_ONCE = 512
"""Bounds the temporary memory to about 100 MiB with some hundred modes."""

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
        self.modes, self.field, self.freedom, self.size_mm = soft.modes, field, freedom, size_mm
        self.body = soft.scene.volume("soft", size_mm)

    def of_view(self, camera: Camera, correction: np.ndarray) -> np.ndarray:
        """(3 M, H, W) float32 1/mm, for a camera with its correction (4, 4); the modes' x, y, z follow each other."""
        rays = segmented_rays(self.body, camera, correction, self.size_mm)
        changes = np.zeros((self.modes.count, 3, len(rays.near)), np.float32)
        if (rays.far > rays.near).any():
            self._fill(rays, changes)
        return changes.reshape(-1, camera.height, camera.width)

    def _fill(self, rays: SegmentedRays, changes: np.ndarray) -> None:
        """Fill the derivatives (M, 3, P), by compiled loops where numba is installed."""
        try:
            from PolyPoseLib.registration.fit.soft_jacobian_kernel import add_changes
        except ImportError:
            self.fill_plainly(rays, changes)
            return
        tissue = DisplacedTissue(
            np.linalg.inv(self.field.affine)[:3],
            self.field.vectors,
            self.freedom,
            self.body.world_to_index[:3],
            self.body.gradient,
        )
        add_changes(rays, tissue, CosineTables(self.modes.to_angles, self.modes.numbers), changes)

    def fill_plainly(self, rays: SegmentedRays, changes: np.ndarray) -> None:
        """Fill the derivatives (M, 3, P) without numba, by arrays over many rays."""
        length = rays.step_mm * rays.per_segment
        hit = rays.far > rays.near
        segments = int(np.ceil((rays.far[hit].max() - rays.first) / length))
        depths = rays.first + (np.arange(segments * rays.per_segment) + 0.5) * rays.step_mm
        for start in range(0, len(rays.near), RAYS_AT_ONCE):
            part = slice(start, start + RAYS_AT_ONCE)
            crossed = (depths >= rays.near[part, None]) & (depths <= rays.far[part, None]) & hit[part, None]
            points = rays.source + rays.directions[part, None] * depths[:, None]
            gradient = self._gradient(points.reshape(-1, 3), crossed.reshape(-1))
            gradient = gradient.reshape(-1, rays.per_segment, 3).sum(axis=1)
            middles = points.reshape(-1, rays.per_segment, 3).mean(axis=1)
            used = np.flatnonzero(np.abs(gradient).max(axis=1) > NEGLIGIBLE)
            if not len(used):
                continue
            values, ray = self.modes.at(middles[used]), used // segments
            begins = np.flatnonzero(np.diff(ray, prepend=-1))
            for axis in range(3):
                parts = np.add.reduceat(values * gradient[used, axis, None], begins, axis=0)
                changes[:, axis, start + ray[begins]] = parts.T

    def _gradient(self, points: np.ndarray, crossed: np.ndarray) -> np.ndarray:
        """(N, 3) what a displacement of the sample at each fixed point (N, 3) does to its line integral, 1/mm."""
        node = _nearest(np.linalg.inv(self.field.affine), points, self.field.shape)
        places = points + self.field.vectors[node]
        index = np.rint(places @ self.body.world_to_index[:3, :3].T + self.body.world_to_index[:3, 3])
        inside = (index >= 0).all(axis=1) & (index < self.body.voxels.shape[::-1]).all(axis=1) & crossed
        i, j, k = np.where(inside[:, None], index, 0).astype(np.intp).T
        return self.body.gradient[k, j, i] * (inside * self.freedom[node] * self.size_mm)[:, None]


def _nearest(
    to_index: np.ndarray, points: np.ndarray, shape: tuple[int, int, int]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Indices (k, j, i) of the nodes nearest to points (N, 3)."""
    index = np.rint(points @ to_index[:3, :3].T + to_index[:3, 3]).astype(np.intp)
    i, j, k = np.clip(index, 0, np.array(shape[::-1]) - 1).T
    return k, j, i


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
