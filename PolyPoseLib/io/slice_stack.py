"""Slices of a CT as one even grid, sheared where the gantry was tilted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from PolyPoseLib.data.shear import SHEAR_TOLERANCE_MM
from PolyPoseLib.errors import InputError

UNEVEN_TOLERANCE = 0.1
"""Largest deviation of one slice's distance, as a share of the usual one (at least 0.1 mm, for rounding)."""


@dataclass(frozen=True)
class Slice:
    """One slice: where its first pixel is, and where to read it.

    Attributes
    ----------
    path
        Its file.
    position
        (3,) LPS mm, Image Position (Patient) (0020,0032).
    rows_columns
        (2, 3) unit vectors along a row and down a column, Image Orientation (Patient) (0020,0037).
    spacing
        (between rows, between columns) mm, Pixel Spacing (0028,0030).
    size
        (rows, columns).
    frame
        Number of the frame in a multi-frame file, or None.

    """

    path: Path
    position: np.ndarray
    rows_columns: np.ndarray
    spacing: tuple[float, float]
    size: tuple[int, int]
    frame: int | None = None

    @property
    def normal(self) -> np.ndarray:
        """Unit vector across the slice, (3,)."""
        return np.cross(self.rows_columns[0], self.rows_columns[1])


def sorted_slices(slices: list[Slice]) -> list[Slice]:
    """Slices in ascending order along the first one's normal."""
    normal = slices[0].normal
    return sorted(slices, key=lambda each: float(each.position @ normal))


def stack_affine(slices: Sequence[Slice], name: str) -> np.ndarray:
    """Affine of sorted slices; after gantry tilt its third axis is not perpendicular to the others.

    Positions decide, not Gantry/Detector Tilt (0018,1120): scanners that correct the tilt leave that filled in.

    Parameters
    ----------
    slices
        In ascending order.
    name
        Opening of the sentences of errors.

    Returns
    -------
    numpy.ndarray
        (4, 4) float64, index (i, j, k, 1) to LPS mm.

    Raises
    ------
    InputError
        One slice, slices that differ in orientation, size or spacing, missing or uneven slices, or slices
        that are displaced sideways by different amounts.

    """
    if len(slices) < 2:
        raise InputError(f"{name}: the series has one slice only: give the folder with the whole stack.")
    first = slices[0]
    for each in slices[1:]:
        if not np.allclose(each.rows_columns, first.rows_columns, atol=1e-3):
            raise InputError(
                f"{name}: the slices have different orientations: choose one series by ct_series."
            )
        if each.size != first.size or not np.allclose(each.spacing, first.spacing, rtol=1e-3):
            raise InputError(
                f"{name}: the slices have different sizes or spacings: choose one series by ct_series."
            )
    positions = np.array([each.position for each in slices])
    along = (positions - positions[0]) @ first.normal
    _check_even(along, positions[0] @ first.normal, name)
    sideways = positions - positions[0] - along[:, None] * first.normal
    step = first.normal * along[-1] / (len(slices) - 1)
    if np.linalg.norm(sideways, axis=1).max() > SHEAR_TOLERANCE_MM:
        _check_evenly_tilted(sideways, along, name)
        step = step + sideways[-1] / (len(slices) - 1)
    affine = np.eye(4)
    affine[:3, 0] = first.rows_columns[0] * first.spacing[1]
    affine[:3, 1] = first.rows_columns[1] * first.spacing[0]
    affine[:3, 2] = step
    affine[:3, 3] = positions[0]
    return affine


def _check_evenly_tilted(sideways: np.ndarray, along: np.ndarray, name: str) -> None:
    """Refuse slices that no one tilt has displaced; sideways (N, 3) and along (N,) in mm, from the first slice."""
    apart = np.linalg.norm(sideways - np.outer(along / along[-1], sideways[-1]), axis=1)
    worst = int(np.argmax(apart))
    if apart[worst] > SHEAR_TOLERANCE_MM:
        raise InputError(
            f"{name}: slice {worst + 1} of {len(along)} lies {apart[worst]:.1f} mm beside the line of the others: "
            "export the whole series again, or choose one by ct_series."
        )


def _check_even(along: np.ndarray, start: float, name: str) -> None:
    """Refuse repeated, missing and uneven slices; along is each slice's distance from the first in mm, ascending."""
    steps = np.diff(along)
    usual = float(np.median(steps))
    if steps.min() < 0.01:
        raise InputError(
            f"{name}: {np.count_nonzero(steps < 0.01) + 1} slices lie at the same place (several phases or "
            "repeats): keep one of each, or choose one series by ct_series."
        )
    tolerance = max(0.1, UNEVEN_TOLERANCE * usual)
    worst = int(np.argmax(np.abs(steps - usual)))
    between = f"between {start + along[worst]:.2f} and {start + along[worst + 1]:.2f} mm"
    if abs(steps[worst] - usual) <= tolerance:
        return
    count = steps[worst] / usual
    if count > 1.5 and abs(count - round(count)) * usual <= tolerance:
        raise InputError(
            f"{name}: {round(count) - 1} slice(s) are missing {between} (slices are {usual:.2f} mm apart): "
            "export the whole series again."
        )
    raise InputError(
        f"{name}: the slices are unevenly spaced ({steps[worst]:.2f} mm {between}, {usual:.2f} mm "
        "elsewhere): resample the CT to an even grid first."
    )
