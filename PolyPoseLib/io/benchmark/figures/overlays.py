"""The warped CT against the true one: differences in three planes, and projections over each other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.io.benchmark.figures.canvas import INK, MUTED, PAGE, SMALL, TEXT, new_figure
from PolyPoseLib.io.benchmark.figures.straight import BODY_HU, CORONAL, PLANES, richest_slice, show

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WINDOW_HU = (-250.0, 600.0)
LARGEST_DIFFERENCE_HU = 500.0
SMALLEST_DIFFERENCE_HU = 60.0
"""Differences below are transparent: noise, and interpolation."""

PROJECTED_HU = (100.0, 900.0)
"""Window of maximum intensity projections: bones."""

DIVERGING = "PuOr"
"""Orange to purple: told apart by all kinds of colour vision (C. Brewer)."""

_ROWS = ("at rest", "warped")


@dataclass(frozen=True)
class Scans:
    """Volumes on one straight grid, HU, NaN where a scan does not reach.

    Attributes
    ----------
    true, rest, warped
        The patient as X-rayed, the earlier CT, and the earlier CT warped.
    labels
        Above 0 in what is scored and moves, in the fixed posture.

    """

    true: Volume
    rest: Volume
    warped: Volume
    labels: Volume


def draw_errors(scans: Scans, heading: str) -> Figure:
    """Differences from the true CT, at rest and warped, over the true CT, in the planes that show most structures."""
    grid = scans.true
    shapes = [PLANES[n].cut(grid.voxels, 0).shape for n in range(3)]
    widths = [columns for _, columns in shapes]
    tallest = max(rows for rows, _ in shapes)
    inch = (PAGE - 1.0) / sum(widths)
    figure = new_figure(PAGE, 2 * tallest * inch + 0.75)
    places = figure.subplots(2, 3, squeeze=False, width_ratios=widths)
    for row, moved in enumerate((scans.rest, scans.warped)):
        for number, plane in enumerate(PLANES):
            at = richest_slice(scans.labels.voxels, plane)
            true, other = plane.cut(grid.voxels, at), plane.cut(moved.voxels, at)

            def draw(place: Axes, true: np.ndarray = true, other: np.ndarray = other) -> None:
                _draw_difference(place, true, other)

            show(places[row, number], draw, plane, grid, ruler=row == 1)
            if row == 0:
                places[row, number].set_title(plane.name, fontsize=TEXT, color=INK)
        error = mean_difference(grid.voxels, moved.voxels)
        places[row, 0].set_ylabel(
            f"{_ROWS[row]}\nmean |difference| {error:.0f} HU", fontsize=SMALL, color=INK
        )
    _colour_bar(figure, places)
    figure.suptitle(heading, fontsize=TEXT + 1, color=INK, weight="bold")
    return figure


def mean_difference(true: np.ndarray, other: np.ndarray) -> float:
    """Mean absolute difference in HU where either shows the patient and both reach; NaN when that is nowhere."""
    both = np.isfinite(true) & np.isfinite(other)
    patient = both & ((true > BODY_HU) | (other > BODY_HU))
    return float(np.abs(true[patient] - other[patient]).mean()) if patient.any() else float("nan")


def _draw_difference(place: Axes, true: np.ndarray, other: np.ndarray) -> None:
    """The true slice in grey, and what the other has more or less over it; blank where one of them has nothing."""
    place.set_facecolor("#000000")
    place.imshow(true, cmap="gray", vmin=WINDOW_HU[0], vmax=WINDOW_HU[1], interpolation="nearest")
    difference = other - true
    strength = (np.abs(difference) - SMALLEST_DIFFERENCE_HU) / (
        LARGEST_DIFFERENCE_HU / 2 - SMALLEST_DIFFERENCE_HU
    )
    place.imshow(
        np.nan_to_num(difference), cmap=DIVERGING, vmin=-LARGEST_DIFFERENCE_HU, vmax=LARGEST_DIFFERENCE_HU,
        alpha=np.clip(np.nan_to_num(strength), 0, 0.9), interpolation="nearest",
    )  # fmt: skip


def _colour_bar(figure: Figure, places: np.ndarray) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    scale = ScalarMappable(Normalize(-LARGEST_DIFFERENCE_HU, LARGEST_DIFFERENCE_HU), DIVERGING)
    bar = figure.colorbar(scale, ax=places, shrink=0.75, aspect=32, pad=0.015, extend="both")
    bar.set_label("CT minus true CT (HU)", fontsize=SMALL, color=INK)
    bar.ax.tick_params(labelsize=SMALL, colors=INK, width=0.6)
    bar.outline.set_edgecolor(MUTED)  # pyright: ignore[reportCallIssue, reportAttributeAccessIssue]


def draw_projections(scans: Scans, heading: str) -> Figure:
    """Coronal maximum intensity projections: the true one, and the CT's at rest and warped over it."""
    true, rest, warped = (_projection(each) for each in (scans.true, scans.rest, scans.warped))
    rows, columns = true.shape
    figure = new_figure(PAGE, (PAGE - 0.2) / 3 * rows / columns + 0.75)
    places = figure.subplots(1, 3, squeeze=False)[0]
    panels = (
        ("true CT", np.repeat(true[..., None], 3, axis=2)),
        ("at rest over true", composite(true, rest)),
        ("warped over true", composite(true, warped)),
    )
    for number, (place, (title, picture)) in enumerate(zip(places, panels, strict=True)):

        def draw(place: Axes, picture: np.ndarray = picture) -> None:
            place.imshow(picture, interpolation="nearest")

        show(place, draw, CORONAL, scans.true, ruler=number == 0)
        place.set_title(title, fontsize=TEXT, color=INK)
    figure.supxlabel(
        "Maximum intensity projections, front view. Green: true CT only. Magenta: CT only. Grey: both agree.",
        fontsize=SMALL, color=INK,
    )  # fmt: skip
    figure.suptitle(heading, fontsize=TEXT + 1, color=INK, weight="bold")
    return figure


def _projection(volume: Volume) -> np.ndarray:
    """Coronal maximum intensity projection (rows, columns) from 0 to 1."""
    low, high = PROJECTED_HU
    largest = np.nan_to_num(volume.voxels, nan=low).max(axis=CORONAL.axis)
    return CORONAL.upright(np.clip((largest - low) / (high - low), 0, 1))


def composite(true: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Pictures (rows, columns) from 0 to 1 as one (rows, columns, 3): the true in green, the other in magenta."""
    return np.stack([other, true, other], axis=-1)
