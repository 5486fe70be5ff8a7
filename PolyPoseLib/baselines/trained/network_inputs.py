"""What a network is given: the CT and the X-rays in numbers of about -1 to 1, X-rays lifted into the CT's grid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from PolyPoseLib.baselines.trained.back_projection import back_projected
from PolyPoseLib.baselines.trained.network_grid import NetworkGrid
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.data.xray import Xray
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera, review_camera

HU_RANGE = (-1000.0, 1500.0)
"""Mapped to -1 and 1: bones are what X-rays show (LiftReg, made for lungs, ends at 0 HU)."""

DEVIATIONS = 3.0
"""Of an X-ray's line integrals from their mean, in standard deviations, that are mapped to -1 and 1."""

PIXELS_PER_NODE = 2
"""X-rays are binned to about so many rows and columns for each node along an axis: more would fall between nodes."""


@dataclass(frozen=True, eq=False)
class View:
    """One X-ray as networks take it.

    Attributes
    ----------
    image : (H, W) array of float32
        Line integrals less their mean over the pixels that count, in DEVIATIONS standard deviations; 0 elsewhere.
    camera : Camera
        World to camera, of the binned image.

    """

    image: np.ndarray
    camera: Camera

    def binned(self, pixels: int) -> View:
        """The same X-ray with about so many rows and columns at most."""
        small, factor = review_camera(self.camera, pixels)
        means, _ = block_means(self.image, np.ones(self.image.shape, bool), small, factor)
        return View(means.astype(np.float32), small)


def block_means(
    image: np.ndarray, mask: np.ndarray, small: Camera, factor: int
) -> tuple[np.ndarray, np.ndarray]:
    """Means over the pixels that count of factor x factor blocks, and which blocks count: half of their pixels do."""
    part = (slice(0, small.height * factor), slice(0, small.width * factor))
    blocks = (small.height, factor, small.width, factor)
    share = mask[part].reshape(blocks).mean(axis=(1, 3))
    total = np.where(mask, image, 0)[part].astype(np.float64).reshape(blocks).mean(axis=(1, 3))
    return total / np.maximum(share, 1e-6), share >= 0.5


def view_of(image: np.ndarray, mask: np.ndarray, camera: Camera, side: int) -> View:
    """An X-ray binned for a grid of so many nodes and standardised: neither dose nor a vendor's scale may matter.

    Raises InputError when all pixels that count are alike.
    """
    small, factor = review_camera(camera, PIXELS_PER_NODE * side)
    means, valid = block_means(image, mask, small, factor)
    spread = means[valid].std() if valid.any() else 0.0
    if not spread > 0:
        raise InputError("An X-ray has one value only where it counts: give another image.")
    scaled = (means - means[valid].mean()) / (DEVIATIONS * spread)
    return View(np.where(valid, np.clip(scaled, -1, 1), 0).astype(np.float32), small)


def views_of(xrays: Sequence[Xray], side: int) -> list[View]:
    """The X-rays of a study for a grid of so many nodes; raises InputError when one has no camera."""
    return [view_of(xray.image, xray.mask, camera_of(xray), side) for xray in xrays]


def camera_of(xray: Xray) -> Camera:
    """The camera of an X-ray; raises InputError when it has none."""
    if xray.extrinsic is None:
        raise InputError(
            f'The X-ray "{xray.name}" has no camera, and trained systems find none: give its "extrinsic", or find it '
            "first with python -m PolyPoseLib cameras."
        )
    return Camera(xray.intrinsics, xray.extrinsic, *xray.image.shape)


def scaled_ct(ct: Volume, grid: NetworkGrid) -> np.ndarray:
    """A CT in HU on the network's nodes, (k, j, i) float32 from -1 (air) to 1."""
    low, high = HU_RANGE
    return (np.clip(grid.resampled(ct), low, high) - low) * np.float32(2 / (high - low)) - np.float32(1)


def lifted(views: Sequence[View], grid: NetworkGrid) -> np.ndarray:
    """Every X-ray back-projected into the network's grid, (V, k, j, i) float32."""
    points = grid.points()
    return np.stack([back_projected(view.image, view.camera, points) for view in views])
