"""The camera of one X-ray: a source, a flat detector, and how the world projects onto its pixels.

Conventions (one place, used everywhere): world points are LPS millimetres; pixel centres sit at integer
coordinates, so the first pixel's centre is (0, 0) and a centred principal point is ((W-1)/2, (H-1)/2);
camera x runs along the image's columns, y down its rows and z from the source through the detector.
A world point X projects to K (R X + t); the source is at -R^T t.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from PolyPoseLib.errors import InputError, shown
from PolyPoseLib.geometry.rigid import is_real_number, real_array, require_rigid

FOCAL_RANGE_PX = (0.01, 1e9)
"""Focal lengths of intrinsics: detectors have some thousands of pixels, and beyond it the arithmetic overflows."""

MAX_OFFSET_PX = 1e9
"""Largest absolute skew and principal point of intrinsics."""

REVIEW_PIXELS = 200
"""Longer side of an image at review size: small enough to be rendered while a slider moves."""


def focal_length_px(
    source_to_detector_mm: float, pixel_spacing_mm: float | Sequence[float]
) -> tuple[float, float]:
    """Focal lengths in pixels from the detector's distance and pixel pitch.

    Parameters
    ----------
    source_to_detector_mm : float
        Distance from the source to the detector's plane (DICOM (0018,1110)).
    pixel_spacing_mm : float | Sequence[float]
        Pitch at the detector in DICOM's order (between rows, between columns) (ImagerPixelSpacing (0018,1164));
        one number for square pixels.

    Returns
    -------
    tuple[float, float]
        (fx, fy) px: fx along a row (distance over the pitch between columns), fy down a column.

    Raises
    ------
    InputError
        A distance or spacing that is not a finite number above 0.

    """
    rows, columns = _pair(pixel_spacing_mm, "pixel_spacing_mm")
    if not (is_real_number(source_to_detector_mm) and source_to_detector_mm > 0):
        raise InputError(
            f"source_to_detector_mm is {shown(source_to_detector_mm)}; give the distance in mm, a number above 0."
        )
    if not (rows > 0 and columns > 0):
        raise InputError(f"pixel_spacing_mm is [{rows}, {columns}]; give two numbers above 0, in mm.")
    return source_to_detector_mm / columns, source_to_detector_mm / rows


def intrinsics_matrix(
    source_to_detector_mm: float,
    pixel_spacing_mm: float | Sequence[float],
    height: int,
    width: int,
    principal_point_px: Sequence[float] | None = None,
) -> np.ndarray:
    """Intrinsics of a flat detector that faces its source.

    Parameters
    ----------
    source_to_detector_mm : float
        Distance from the source to the detector's plane (DICOM (0018,1110)).
    pixel_spacing_mm : float | Sequence[float]
        Pitch at the detector (between rows, between columns); one number for square pixels.
    height : int
        Rows of the image.
    width : int
        Columns of the image.
    principal_point_px : Sequence[float], optional
        (column, row) where the perpendicular from the source meets the detector; the detector's centre
        ((W - 1) / 2, (H - 1) / 2) by default.

    Returns
    -------
    (3, 3) array
        K, pixels.

    Raises
    ------
    InputError
        A distance or spacing that is not above 0, or a principal point that is not two finite numbers.

    """
    fx, fy = focal_length_px(source_to_detector_mm, pixel_spacing_mm)
    cx, cy = (
        ((width - 1) / 2, (height - 1) / 2)
        if principal_point_px is None
        else _pair(principal_point_px, "principal_point_px")
    )
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]], dtype=np.float64)


def look_at(source: ArrayLike, target: ArrayLike, up: ArrayLike = (0, 0, 1)) -> np.ndarray:
    """Extrinsic of a camera at one point whose axis passes through another.

    Parameters
    ----------
    source : (3,) array_like
        mm, the X-ray source.
    target : (3,) array_like
        mm, a point on the ray through the principal point.
    up : (3,) array_like
        World direction shown upward in the image (superior by default); need not be perpendicular.

    Returns
    -------
    (4, 4) array
        World LPS mm to camera mm.

    Raises
    ------
    InputError
        Source and target coincide, or `up` is parallel to the line between them.

    """
    source, target, up = (np.asarray(x, dtype=np.float64) for x in (source, target, up))
    forward = target - source
    length = np.linalg.norm(forward)
    if not length > 0:
        raise InputError("look_at needs a target that differs from the source.")
    forward /= length
    across = np.cross(forward, up)
    if np.linalg.norm(across) < 1e-9 * np.linalg.norm(up) or not np.linalg.norm(up) > 0:
        raise InputError("look_at needs an `up` direction that is not parallel to the view.")
    across /= np.linalg.norm(across)
    rotation = np.stack([across, np.cross(forward, across), forward])
    extrinsic = np.eye(4)
    extrinsic[:3, :3] = rotation
    extrinsic[:3, 3] = -rotation @ source
    return extrinsic


@dataclass(frozen=True, eq=False)
class Camera:
    """One X-ray's camera; a camera that exists is valid.

    Attributes
    ----------
    intrinsics : (3, 3) array
        K in pixels, upper triangular, positive focal lengths, last row 0 0 1.
    extrinsic : (4, 4) array
        Rigid, world LPS mm to camera mm.
    height : int
        Rows of the image.
    width : int
        Columns of the image.

    Raises
    ------
    InputError
        From the constructor, when any of these rules is broken.

    """

    intrinsics: np.ndarray
    extrinsic: np.ndarray
    height: int
    width: int

    def __post_init__(self) -> None:
        """Validate, and keep read-only float64 copies."""
        intrinsics = require_intrinsics(self.intrinsics)
        extrinsic = require_rigid(self.extrinsic)
        for name, size in (("height", self.height), ("width", self.width)):
            if not isinstance(size, int | np.integer) or isinstance(size, bool) or size < 1:
                raise InputError(f"The camera's {name} is {size}; give a whole number of pixels, 1 or more.")
        intrinsics.flags.writeable = extrinsic.flags.writeable = False
        object.__setattr__(self, "intrinsics", intrinsics)
        object.__setattr__(self, "extrinsic", extrinsic)
        object.__setattr__(self, "height", int(self.height))
        object.__setattr__(self, "width", int(self.width))

    @property
    def source(self) -> np.ndarray:
        """(3,) mm, the X-ray source in the world: -R^T t."""
        return -self.extrinsic[:3, :3].T @ self.extrinsic[:3, 3]

    @property
    def axis(self) -> np.ndarray:
        """(3,) unit world vector from the source perpendicular to the detector."""
        return self.extrinsic[2, :3].copy()

    @cached_property
    def inverse_intrinsics(self) -> np.ndarray:
        """K^-1 (3, 3): pixels to directions in the camera's frame."""
        inverse = np.linalg.inv(self.intrinsics)
        inverse.flags.writeable = False
        return inverse

    def depth(self, points: ArrayLike) -> np.ndarray:
        """Depth (...,) mm of world points (..., 3) along the axis; 0 at the source, negative behind it."""
        return np.asarray(points, dtype=np.float64) @ self.extrinsic[2, :3] + self.extrinsic[2, 3]

    def project(self, points: ArrayLike) -> np.ndarray:
        """Project world points to pixels.

        Parameters
        ----------
        points : (..., 3) array_like
            World LPS mm.

        Returns
        -------
        (..., 2) array
            (column, row); NaN for points at or behind the source, which cannot be seen.

        """
        camera = np.asarray(points, dtype=np.float64) @ self.extrinsic[:3, :3].T + self.extrinsic[:3, 3]
        image = camera @ self.intrinsics.T
        depth = np.where(image[..., 2:] > 0, image[..., 2:], np.nan)
        return image[..., :2] / depth

    def pixel_directions(self) -> np.ndarray:
        """World vectors (H, W, 3) R^T K^-1 [column, row, 1]: from the source to the pixel at depth 1 mm."""
        row, column = np.meshgrid(np.arange(self.height), np.arange(self.width), indexing="ij")
        pixels = np.stack([column, row, np.ones_like(row)], axis=-1).astype(np.float64)
        return pixels @ (self.extrinsic[:3, :3].T @ self.inverse_intrinsics).T

    def plane_at(self, depth_mm: float) -> np.ndarray:
        """From (column, row, slice, 1) to world mm, (4, 4), of an image on the plane at a depth along the axis.

        The slice axis points away from the source and is as long as a pixel is wide.
        """
        to_camera = np.eye(4)
        to_camera[:3, :2] = self.inverse_intrinsics[:, :2] * depth_mm
        to_camera[:3, 2] = (0.0, 0.0, np.linalg.norm(to_camera[:3, 0]))
        to_camera[:3, 3] = self.inverse_intrinsics[:, 2] * depth_mm
        return np.linalg.inv(self.extrinsic) @ to_camera

    def with_extrinsic(self, extrinsic: ArrayLike) -> Camera:
        """The same detector at another pose (4, 4), world to camera; raises InputError when it is not rigid."""
        return replace(self, extrinsic=extrinsic)

    def binned(self, factor: int) -> Camera:
        """Camera of the image averaged over blocks of factor x factor pixels.

        Rows and columns that do not fill a block are dropped at the end. A block's centre is the mean of its
        pixels' centres, hence column' = (column + 1/2) / factor - 1/2.

        Parameters
        ----------
        factor : int
            Pixels along the edge of a block.

        Returns
        -------
        Camera
            Of height // factor rows and width // factor columns.

        Raises
        ------
        InputError
            The factor is not a whole number from 1 to the image's smaller side.

        """
        if not isinstance(factor, int | np.integer) or not 1 <= factor <= min(self.height, self.width):
            raise InputError(
                f"The binning factor is {factor}; give a whole number from 1 to "
                f"{min(self.height, self.width)}."
            )
        intrinsics = self.intrinsics.copy()
        intrinsics[:2] /= factor
        intrinsics[:2, 2] += 0.5 / factor - 0.5
        return Camera(intrinsics, self.extrinsic, self.height // factor, self.width // factor)

    def cropped(self, row0: int, row1: int, col0: int, col1: int) -> Camera:
        """Camera of a part of the image, image[row0:row1, col0:col1].

        Parameters
        ----------
        row0, row1 : int
            First row, and the one after the last.
        col0, col1 : int
            First column, and the one after the last.

        Returns
        -------
        Camera
            Of the part.

        Raises
        ------
        InputError
            The crop is empty or leaves the image.

        """
        if not (0 <= row0 < row1 <= self.height and 0 <= col0 < col1 <= self.width):
            raise InputError(
                f"The crop [{row0}:{row1}, {col0}:{col1}] is empty or leaves the image of "
                f"{self.height} x {self.width}."
            )
        intrinsics = self.intrinsics.copy()
        intrinsics[0, 2] -= col0
        intrinsics[1, 2] -= row0
        return Camera(intrinsics, self.extrinsic, row1 - row0, col1 - col0)


def review_camera(camera: Camera, pixels: int = REVIEW_PIXELS) -> tuple[Camera, int]:
    """A camera binned so that the longer side of its image has at most about so many pixels.

    Parameters
    ----------
    camera : Camera
        Of the whole image.
    pixels : int
        Wanted length of the longer side, 1 or more.

    Returns
    -------
    Camera
        Of the binned image; see :meth:`Camera.binned`.
    int
        The binning factor, 1 or more.

    Raises
    ------
    InputError
        `pixels` is below 1.

    """
    if pixels < 1:
        raise InputError(f"The review size is {pixels}: give a number of pixels of 1 or more.")
    factor = max(1, -(-max(camera.height, camera.width) // pixels))
    factor = min(factor, camera.height, camera.width)
    return camera.binned(factor), factor


def require_intrinsics(matrix: ArrayLike, where: str = "intrinsics") -> np.ndarray:
    """Check intrinsics.

    Parameters
    ----------
    matrix : (3, 3) array_like
        K, pixels.
    where : str
        What the matrix is, for the message.

    Returns
    -------
    (3, 3) array of float64
        A copy.

    Raises
    ------
    InputError
        Wrong shape, not finite, not upper triangular with last row 0 0 1, a focal length <= 0 or out of
        FOCAL_RANGE_PX, or a skew or principal point beyond MAX_OFFSET_PX.

    """
    try:
        intrinsics = real_array(matrix)
    except (TypeError, ValueError):
        raise InputError(f"{where} is not a table of numbers; give 3 rows of 3 numbers.") from None
    if intrinsics.shape != (3, 3) or not np.isfinite(intrinsics).all():
        raise InputError(f"{where} must be a 3x3 matrix of finite numbers, got shape {intrinsics.shape}.")
    if intrinsics[1, 0] != 0 or not np.array_equal(intrinsics[2], (0, 0, 1)):
        raise InputError(f"{where} must have the form [[fx, s, cx], [0, fy, cy], [0, 0, 1]], in pixels.")
    if not (intrinsics[0, 0] > 0 and intrinsics[1, 1] > 0):
        raise InputError(
            f"{where} has focal lengths {intrinsics[0, 0]} and {intrinsics[1, 1]} px; both must be above 0."
        )
    least, largest = FOCAL_RANGE_PX
    if not all(least <= intrinsics[axis, axis] <= largest for axis in range(2)):
        raise InputError(
            f"{where} has focal lengths {intrinsics[0, 0]:g} and {intrinsics[1, 1]:g} px; both must be from {least:g} "
            f"to {largest:g}: the distance to the detector over the size of a pixel."
        )
    if np.abs(intrinsics[[0, 0, 1], [1, 2, 2]]).max() > MAX_OFFSET_PX:
        raise InputError(
            f"{where} has a skew or principal point beyond {MAX_OFFSET_PX:g} px; give it in pixels of the image."
        )
    return intrinsics


def _pair(value: float | Sequence[float], name: str) -> tuple[float, float]:
    """Two finite floats from one number or a pair."""
    try:
        pair = np.broadcast_to(real_array(value), (2,))
    except (TypeError, ValueError):
        raise InputError(f"{name} is {shown(value)}; give two numbers.") from None
    if not np.isfinite(pair).all():
        raise InputError(f"{name} is {shown(value)}; give two finite numbers.")
    return float(pair[0]), float(pair[1])
