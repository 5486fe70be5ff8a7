"""A virtual detector of fixed field and few pixels, on which the regressor sees every X-ray.

It makes the regressor independent of pixel sizes and source-to-detector distances: what remains of the intrinsics is
the direction in which each pixel looks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import map_coordinates

from PolyPoseLib.data.xray import Xray
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.registration.fit.levels import binned

LEAST_SIDE = 32


@dataclass(frozen=True)
class VirtualDetector:
    """Square and centred on the axis.

    Attributes
    ----------
    side : int
        Pixels.
    half_tangent : float
        Tangent of the angle between the axis and the middle of an edge.

    """

    side: int
    half_tangent: float

    def __post_init__(self) -> None:
        """Check the sizes; raises InputError."""
        if not LEAST_SIDE <= self.side <= 1024 or not 0.01 <= self.half_tangent <= 2:
            raise InputError(
                f"A virtual detector of {self.side} pixels and half tangent {self.half_tangent:g} is of no use."
            )

    @classmethod
    def around(cls, xrays: Sequence[Xray], side: int) -> VirtualDetector:
        """Large enough for the fields of several X-rays."""
        reach = []
        for xray in xrays:
            height, width = xray.image.shape
            corners = np.array([[c, r, 1.0] for c in (-0.5, width - 0.5) for r in (-0.5, height - 0.5)])
            reach.append(np.abs(np.linalg.solve(xray.intrinsics, corners.T)[:2]).max())
        return cls(side, float(max(reach)))

    @property
    def intrinsics(self) -> np.ndarray:
        """K (3, 3); the outer pixels' outer edges lie at the half tangent."""
        focal, middle = self.side / (2 * self.half_tangent), (self.side - 1) / 2
        return np.array([[focal, 0, middle], [0, focal, middle], [0, 0, 1.0]])

    def camera(self, extrinsic: np.ndarray) -> Camera:
        """The detector at a pose (4, 4)."""
        return Camera(self.intrinsics, extrinsic, self.side, self.side)

    def resampled(
        self, image: np.ndarray, mask: np.ndarray, intrinsics: np.ndarray, rotation: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """An X-ray (H, W) of intrinsics (3, 3) as the virtual detector sees it, rotated as in :meth:`rotated`.

        Pixels are averaged before they are interpolated; those outside the X-ray are not in the mask.
        """
        ratio = float(np.sqrt(intrinsics[0, 0] * intrinsics[1, 1])) / self.intrinsics[0, 0]
        factor = min(max(1, round(ratio)), min(image.shape) // 2)
        camera = Camera(intrinsics, np.eye(4), *image.shape).binned(factor)
        image, mask = binned(image, mask, factor)
        back = np.eye(3) if rotation is None else rotation.T
        return _sampled(image, mask, camera.intrinsics @ back @ np.linalg.inv(self.intrinsics), self.side)

    def rotated(self, image: np.ndarray, rotation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What an image (side, side) becomes when the camera rotates about its source, and where that is known.

        ``rotation`` (3, 3) is applied to the camera's coordinates, so that the new extrinsic is rotation @ old. It is
        exact: rays from one point only change their pixels (Hartley and Zisserman, Multiple View Geometry, 8.4).
        """
        back = self.intrinsics @ rotation.T @ np.linalg.inv(self.intrinsics)
        return _sampled(image, np.ones(image.shape, bool), back, self.side)


def _sampled(
    image: np.ndarray, mask: np.ndarray, mapping: np.ndarray, side: int
) -> tuple[np.ndarray, np.ndarray]:
    """Image and mask at pixels ``mapping`` @ (column, row, 1) of a side x side grid."""
    row, column = np.meshgrid(np.arange(side), np.arange(side), indexing="ij")
    at = mapping @ np.stack([column.ravel(), row.ravel(), np.ones(side * side)])
    ahead = at[2] > 1e-6
    at = np.where(ahead, at[:2] / np.where(ahead, at[2], 1), -10)[::-1]
    known = (map_coordinates(mask.astype(np.float32), at, order=1, cval=0.0) > 0.999) & ahead
    values = map_coordinates(image.astype(np.float32), at, order=1, mode="nearest")
    return values.reshape(side, side), known.reshape(side, side)
