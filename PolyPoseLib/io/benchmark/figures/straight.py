"""Volumes on one straight grid, so that pictures show the patient upright whatever the scan's axes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.grid import bounding_box
from PolyPoseLib.io.benchmark.figures.canvas import INK, SMALL

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LARGEST_SIDE = 320
"""Voxels along the grid's longest side."""

BODY_HU = -300.0
"""Above, a voxel belongs to the patient: pictures are cut to where there is any."""

_MARGIN_MM = 8.0


@dataclass(frozen=True)
class Plane:
    """One of the three anatomical planes, as radiologists look at it: the patient's left is on the right.

    Attributes
    ----------
    name
        "coronal", "sagittal" or "axial".
    axis
        Of the array (k, j, i) across the plane.
    turned
        Whether the array's first remaining axis, k, points up and has to be turned over.
    sides
        Letters at the picture's left, right, top and bottom.

    """

    name: str
    axis: int
    turned: bool
    sides: tuple[str, str, str, str]

    def cut(self, voxels: np.ndarray, place: int) -> np.ndarray:
        """The slice (rows, columns, ...) of an array (k, j, i, ...)."""
        return self.upright(np.take(voxels, place, axis=self.axis))

    def upright(self, picture: np.ndarray) -> np.ndarray:
        """A slice or projection (rows, columns, ...) with its top at the top."""
        return picture[::-1] if self.turned else picture


CORONAL = Plane("coronal", 1, True, ("R", "L", "S", "I"))
SAGITTAL = Plane("sagittal", 2, True, ("A", "P", "S", "I"))
AXIAL = Plane("axial", 0, False, ("R", "L", "A", "P"))
PLANES = (CORONAL, SAGITTAL, AXIAL)


def straight_grid(ct: Volume) -> Volume:
    """An empty grid of cubes along LPS x, y, z around the patient in a CT; raises InputError where there is none."""
    box = bounding_box(ct.voxels > BODY_HU)
    if box is None:
        raise InputError(
            "The CT shows no patient: no voxel is above air. Check that it is in Hounsfield units."
        )
    ends = [(side.start, side.stop - 1) for side in reversed(box)]
    corners = ct.to_world(np.stack(np.meshgrid(*ends, indexing="ij"), axis=-1).reshape(8, 3))
    low, high = corners.min(axis=0) - _MARGIN_MM, corners.max(axis=0) + _MARGIN_MM
    spacing = max(float((high - low).max()) / (LARGEST_SIDE - 1), float(ct.spacing.min()))
    size = np.floor((high - low) / spacing).astype(int) + 1
    affine = np.diag([spacing, spacing, spacing, 1.0])
    affine[:3, 3] = low
    return Volume(np.zeros(tuple(size[::-1]), np.uint8), affine)


def unmoved() -> DisplacementField:
    """The field of doing nothing."""
    return DisplacementField(np.zeros((2, 2, 2, 3), np.float32), np.eye(4))


def in_patient(hu: np.ndarray) -> np.ndarray:
    """The pixels (rows, columns) of a slice that belong to the patient, lungs and gas in him included."""
    from scipy.ndimage import binary_fill_holes

    return np.asarray(binary_fill_holes(np.nan_to_num(hu, nan=-1000.0) > BODY_HU), dtype=bool)


def richest_slice(labels: np.ndarray, plane: Plane) -> int:
    """The slice with most voxels above 0; the middle one where there are none."""
    others = tuple(axis for axis in range(3) if axis != plane.axis)
    counts = np.count_nonzero(labels, axis=others)
    return int(counts.argmax()) if counts.any() else labels.shape[plane.axis] // 2


def show(place: Axes, draw: Callable[[Axes], None], plane: Plane, grid: Volume, ruler: bool = False) -> None:
    """Draw pictures in mm into axes that have no ticks, with the sides' letters, and a ruler of 5 cm when asked."""
    draw(place)
    place.set_xticks([])
    place.set_yticks([])
    for spine in place.spines.values():
        spine.set_visible(False)
    left, right, top, bottom = plane.sides
    for text, x, y, across, up in (
        (left, 0.015, 0.5, "left", "center"),
        (right, 0.985, 0.5, "right", "center"),
        (top, 0.5, 0.985, "center", "top"),
        (bottom, 0.5, 0.015, "center", "bottom"),
    ):
        place.text(
            x, y, text, transform=place.transAxes, ha=across, va=up, fontsize=SMALL, color="#ffffff",
            bbox={"facecolor": INK, "alpha": 0.7, "pad": 0.8, "linewidth": 0},
        )  # fmt: skip
    if ruler:
        length = 50.0 / float(grid.spacing[0])
        x, y = place.get_xlim()[0] + 0.15 * length, place.get_ylim()[0] - 0.15 * length
        place.plot([x, x + length], [y, y], color="#ffffff", linewidth=2.0, solid_capstyle="butt", zorder=8)
        place.text(
            x + length / 2, y - 0.07 * length, "5 cm", color="#ffffff", fontsize=SMALL, ha="center", va="bottom",
            zorder=9, bbox={"facecolor": INK, "alpha": 0.7, "pad": 0.8, "linewidth": 0},
        )  # fmt: skip
