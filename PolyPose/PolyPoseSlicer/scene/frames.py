"""The one place where Slicer's RAS world and PolyPoseLib's LPS world meet; both in millimetres."""

from __future__ import annotations

import numpy as np
import vtk

FLIP = np.diag([-1.0, -1.0, 1.0, 1.0])
"""Takes homogeneous RAS points to LPS points and LPS points to RAS points."""


def flip_affine(affine: np.ndarray) -> np.ndarray:
    """An affine (4, 4) from some index or camera space to RAS becomes one to LPS, and back."""
    return FLIP @ np.asarray(affine, dtype=np.float64)


def flip_map(matrix: np.ndarray) -> np.ndarray:
    """A map (4, 4) of the RAS world onto itself becomes the same map of the LPS world, and back."""
    return FLIP @ np.asarray(matrix, dtype=np.float64) @ FLIP


def flip_vectors(vectors: np.ndarray) -> np.ndarray:
    """Points or displacements (..., 3) in RAS become LPS, and back; always a copy."""
    return np.asarray(vectors) * np.array([-1, -1, 1], dtype=np.asarray(vectors).dtype)


def to_vtk(matrix: np.ndarray) -> vtk.vtkMatrix4x4:
    """A vtkMatrix4x4 from an array (4, 4)."""
    out = vtk.vtkMatrix4x4()
    out.DeepCopy(np.asarray(matrix, dtype=np.float64).ravel().tolist())
    return out


def from_vtk(matrix: vtk.vtkMatrix4x4) -> np.ndarray:
    """An array (4, 4) from a vtkMatrix4x4."""
    return np.array([[matrix.GetElement(row, column) for column in range(4)] for row in range(4)])
