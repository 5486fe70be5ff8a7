"""Rendering of one rigid body under a pose, with the analytic Jacobian of the image.

A body is a small volume of attenuation (1/mm) with a border of zeros.  Its pose maps fixed points to the moving
frame in which the body's voxels lie; the pose is perturbed on the left, about the body's own centre:
``y' = exp(delta) (y - centre) + centre`` with ``delta = [rotation (3) rad, translation (3) mm]``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.rigid import rigid_inverse
from PolyPoseLib.geometry.windows import Window, slices_of
from PolyPoseLib.rendering.backend import Backend
from PolyPoseLib.rendering.kernel_arguments import IndexRays
from PolyPoseLib.rendering.occupancy import OccupiedBlocks, occupied_blocks


@dataclass(frozen=True, eq=False)
class Body:
    """Attenuation of one rigid body.

    Attributes
    ----------
    voxels : (D, H, W) array
        In 1/mm with a border of zeros, float32 and not to be written to.
    affine : (4, 4) array
        Index (i, j, k) to moving LPS mm.
    centre : (3,) array
        LPS mm, about which the pose is perturbed.

    """

    voxels: np.ndarray
    affine: np.ndarray
    centre: np.ndarray

    def __post_init__(self) -> None:
        """Lay the voxels out once as the kernels take them."""
        object.__setattr__(self, "voxels", np.ascontiguousarray(self.voxels, np.float32))

    @cached_property
    def world_to_index(self) -> np.ndarray:
        """(4, 4) moving LPS mm to index (i, j, k)."""
        return np.linalg.inv(self.affine)

    @cached_property
    def gradient(self) -> np.ndarray:
        """(D, H, W, 3) float32 derivative of the voxels along moving LPS x, y, z, 1/mm^2."""
        by_index = np.stack([np.gradient(self.voxels, axis=axis) for axis in (2, 1, 0)], axis=-1)
        return by_index @ self.world_to_index[:3, :3].astype(np.float32)

    @cached_property
    def corners(self) -> np.ndarray:
        """(8, 3) moving LPS mm of the box's corners."""
        size = np.array(self.voxels.shape[::-1]) - 1
        index = np.array([[a, b, c] for a in (0, 1) for b in (0, 1) for c in (0, 1)]) * size
        return index @ self.affine[:3, :3].T + self.affine[:3, 3]

    @cached_property
    def occupied(self) -> OccupiedBlocks:
        """Where the voxels are not zero."""
        return occupied_blocks(self.voxels)


@dataclass(frozen=True)
class BodyProjection:
    """The part of an image that a body covers.

    Attributes
    ----------
    window : Window
        The part.
    image : (h, w) array
        Line integrals inside the window.
    jacobian : (6, h, w) array, optional
        Derivative by the pose's perturbation, or None.

    """

    window: Window
    image: np.ndarray
    jacobian: np.ndarray | None

    @property
    def slices(self) -> tuple[slice, slice]:
        """The window as an index into the whole image."""
        return slices_of(self.window)


def footprint(body: Body, camera: Camera, fixed_to_moving: np.ndarray) -> Window:
    """The smallest window of the image that holds the projection of the body's box; empty when it is outside."""
    to_camera = camera.extrinsic @ rigid_inverse(fixed_to_moving)
    in_camera = body.corners @ to_camera[:3, :3].T + to_camera[:3, 3]
    if in_camera[:, 2].min() <= 1.0:
        return 0, camera.height, 0, camera.width
    pixels = in_camera @ camera.intrinsics.T
    column0, column1 = _pixels_between(pixels[:, 0] / pixels[:, 2], camera.width)
    row0, row1 = _pixels_between(pixels[:, 1] / pixels[:, 2], camera.height)
    return row0, row1, column0, column1


def _pixels_between(places: np.ndarray, size: int) -> tuple[int, int]:
    """First and one after the last of so many pixels that lie between places."""
    low, high = math.floor(places.min()), math.ceil(places.max()) + 1
    first = min(max(low, 0), size)
    return first, max(min(max(high, 0), size), first)


def project_body(
    body: Body,
    camera: Camera,
    fixed_to_moving: np.ndarray,
    step_mm: float,
    backend: Backend,
    jacobian: bool = False,
) -> BodyProjection:
    """Render a body under its pose, inside its own footprint only.

    Midpoint rule; the samples lie at fixed depths from the source, so the image changes smoothly with the pose.

    Parameters
    ----------
    body : Body
        The body.
    camera : Camera
        Of the whole image.
    fixed_to_moving : (4, 4) array
        The body's pose, LPS mm.
    step_mm : float
        Distance of the samples along each ray.
    backend : Backend
        What computes the line integrals.
    jacobian : bool
        Compute the derivative by the pose's perturbation as well; its component along each ray is the integral's own
        instead of the samples', see :func:`_along_rays`.

    Returns
    -------
    BodyProjection
        The image (no unit), and its derivative by rotation (1/rad) and translation (1/mm) when asked for.

    """
    window = footprint(body, camera, fixed_to_moving)
    rows, columns = window[1] - window[0], window[3] - window[2]
    if not rows or not columns:
        empty = np.zeros((6, rows, columns), np.float32) if jacobian else None
        return BodyProjection(window, np.zeros((rows, columns), np.float32), empty)
    rays = index_rays(body, camera, fixed_to_moving, window, step_mm)
    image, moments = backend.project(body.voxels, rays, jacobian, body.occupied)
    if moments is None:
        return BodyProjection(window, image, None)
    gradient, by_depth = (
        part @ body.world_to_index[:3, :3].astype(np.float32) for part in (moments[..., :3], moments[..., 3:])
    )
    rows, columns = np.arange(window[0], window[1])[:, None, None], np.arange(window[2], window[3])[:, None]
    turned = fixed_to_moving[:3, :3] @ camera.extrinsic[:3, :3].T @ camera.inverse_intrinsics
    direction = (turned[:, 2] + columns * turned[:, 0] + rows * turned[:, 1]).astype(np.float32)
    gradient, by_depth = _along_rays(gradient, by_depth, direction, image)
    derivative = _jacobian(body, camera, fixed_to_moving, direction, gradient, by_depth)
    return BodyProjection(window, image, derivative)


def index_rays(
    body: Body, camera: Camera, fixed_to_moving: np.ndarray, window: Window, step_mm: float
) -> IndexRays:
    """Rays of a window of the camera's image in the indices of a body under its pose.

    Parameters
    ----------
    body : Body
        The body.
    camera : Camera
        Of the whole image.
    fixed_to_moving : (..., 4, 4) array
        The body's pose, or poses, LPS mm.
    window : Window
        The part of the image.
    step_mm : float
        Distance of the samples along each ray.

    Returns
    -------
    IndexRays
        In the indices (i, j, k) of the body's voxels; of several poses, all but the intrinsics (..., 3).

    """
    to_index = body.world_to_index @ fixed_to_moving
    rotation = camera.extrinsic[:3, :3]
    source = -rotation.T @ camera.extrinsic[:3, 3]
    inverse_intrinsics = camera.inverse_intrinsics.copy()
    # Pixels are counted from the window's first one.
    inverse_intrinsics[:, 2] += inverse_intrinsics[:, 0] * window[2] + inverse_intrinsics[:, 1] * window[0]
    directions = to_index[..., :3, :3] @ rotation.T @ inverse_intrinsics
    return IndexRays(
        to_index[..., :3, :3] @ source + to_index[..., :3, 3],
        directions[..., 2].copy(),
        directions[..., 0].copy(),
        directions[..., 1].copy(),
        inverse_intrinsics,
        window[1] - window[0],
        window[3] - window[2],
        float(step_mm),
    )


def _jacobian(
    body: Body,
    camera: Camera,
    fixed_to_moving: np.ndarray,
    direction: np.ndarray,
    gradient: np.ndarray,
    by_depth: np.ndarray,
) -> np.ndarray:
    """The derivative by [rotation, translation] about the body's centre, from the kernel's moments in moving mm.

    d image / d translation = sum g;  d image / d rotation = sum (y - centre) x g, with y = start + depth direction.
    """
    source = fixed_to_moving[:3, :3] @ (-camera.extrinsic[:3, :3].T @ camera.extrinsic[:3, 3])
    start = source + fixed_to_moving[:3, 3] - body.centre
    by_rotation = _cross(start.astype(np.float32), gradient) + _cross(direction, by_depth)
    return np.ascontiguousarray(np.moveaxis(np.concatenate([by_rotation, gradient], axis=-1), -1, 0))


def _along_rays(
    gradient: np.ndarray, by_depth: np.ndarray, direction: np.ndarray, image: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Integrals of a volume's gradient, and of depth times it, with their exact components along each ray.

    A volume that is zero at both ends of a ray has no mean slope along it, and by parts the integral of depth times its
    slope is minus its own. Sums over samples miss both by the texture between the samples: a hundredth of the
    derivatives across the ray, which is as much as moving along the beam changes the image of a bone at all.

    Parameters
    ----------
    gradient, by_depth : (h, w, 3) ndarray
        Sums over samples, in moving mm.
    direction : (h, w, 3) ndarray
        Moving mm per mm of depth.
    image : (h, w) ndarray
        Line integrals.

    Returns
    -------
    (h, w, 3) ndarray, (h, w, 3) ndarray
        The same with exact components.

    """
    squared = (direction * direction).sum(axis=-1)
    slope = (gradient * direction).sum(axis=-1) / squared
    deeper = ((by_depth * direction).sum(axis=-1) + image) / squared
    return gradient - slope[..., None] * direction, by_depth - deeper[..., None] * direction


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross product over the last axis; several times faster than numpy's on large arrays."""
    return np.stack(
        [
            a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1],
            a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2],
            a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0],
        ],
        axis=-1,
    )
