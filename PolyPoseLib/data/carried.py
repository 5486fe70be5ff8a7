"""Points carried between the CT and the patient as X-rayed, with how far each may be off."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from PolyPoseLib.errors import InputError

Frame = Literal["xray", "ct"]
"""Where points are carried to: "xray", the patient as X-rayed (the fixed frame), or "ct" (the moving frame)."""

FRAMES: tuple[Frame, ...] = ("xray", "ct")

DISPLACEMENT_FIELD = "displacement field"
"""What moved a point that lies in no bone."""

CHI2_95 = 7.814727903251179
"""95 % quantile of the squared Mahalanobis distance in three dimensions."""


@dataclass(frozen=True)
class CarriedPoints:
    """Points in the frame to which they were carried.

    Parameters
    ----------
    points : (N, 3) array
        LPS mm.
    covariances : (N, 3, 3) array
        Of the points' positions, mm^2; NaN where the registration stated no uncertainty.
    moved_by : tuple of str
        Of every point: the name of the bone whose own rigid motion moved it, or "displacement field".
    inside : (N,) bool array
        Whether the point lies in the grid of the result's transform; beyond it, displacements are extrapolated.

    """

    points: np.ndarray
    covariances: np.ndarray
    moved_by: tuple[str, ...]
    inside: np.ndarray

    @property
    def semi_axes_mm(self) -> np.ndarray:
        """(N, 3) half axes of the 95 % ellipsoids in mm, ascending; NaN where no uncertainty is known."""
        axes = np.full((len(self.points), 3), np.nan)
        known = np.isfinite(self.covariances).all(axis=(1, 2))
        axes[known] = half_axes_mm(self.covariances[known])
        return axes


def half_axes_mm(covariances: np.ndarray) -> np.ndarray:
    """(..., 3) half axes in mm, ascending, of the 95 % ellipsoids of covariances (..., 3, 3), finite, mm^2."""
    return np.sqrt(CHI2_95 * np.linalg.eigvalsh(covariances).clip(min=0))


@dataclass(frozen=True)
class CarriedMesh:
    """A surface mesh in the frame to which it was carried.

    Parameters
    ----------
    vertices : CarriedPoints
        N of them.
    faces : (M, 3) array of int
        Indices of each triangle's vertices.

    """

    vertices: CarriedPoints
    faces: np.ndarray


def require_faces(faces: np.ndarray, count: int) -> np.ndarray:
    """Triangles (M, 3) of ``count`` vertices; raises InputError for anything else."""
    array = np.asarray(faces)
    if array.ndim != 2 or array.shape[1] != 3 or not np.issubdtype(array.dtype, np.integer):
        raise InputError(f"Faces must be whole numbers of shape (M, 3), not {array.dtype} of {array.shape}.")
    if array.size and not 0 <= int(array.min()) <= int(array.max()) < count:
        raise InputError(f"A face names a vertex that there is not: there are {count}, counted from 0.")
    return array


def require_points(points: np.ndarray) -> np.ndarray:
    """Points as a finite (N, 3) float64 array; raises InputError for anything else."""
    try:
        array = np.asarray(points, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError("Points must be numbers: give an array of shape (N, 3), LPS mm.") from error
    if array.size == 0 and array.ndim <= 2:
        return array.reshape(0, 3)
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f"Points must be an array of shape (N, 3), LPS mm, not {array.shape}.")
    if not np.isfinite(array).all():
        raise InputError("Points hold NaN or infinity: give finite coordinates, LPS mm.")
    return array


def require_frame(to: str) -> Frame:
    """The frame of a name; raises InputError for any other."""
    for frame in FRAMES:
        if to == frame:
            return frame
    raise InputError(f'Points cannot be carried to "{to}": give "xray" or "ct".')
