"""One sheet with a thumbnail of every degradation, as a person would see it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from degraded_cases import CLEAN, degraded_case

from PolyPoseLib.simulation.degradations.degraded_case import DegradedCase, grey_levels
from PolyPoseLib.simulation.degradations.registry import DEGRADATIONS

COLUMNS = 5
CT_WINDOW_HU = (-300.0, 900.0)


def write_pictures(
    anatomy: str, views: str, seed: int, pixels: int, kinds: Sequence[str], path: Path
) -> None:
    """Write the sheet of some kinds, the case without a fault first."""
    from matplotlib.figure import Figure

    every = [CLEAN, *kinds]
    rows = -(-len(every) // COLUMNS)
    figure = Figure(figsize=(4.4 * COLUMNS, 2.5 * rows), layout="constrained")
    axes = figure.subplots(rows, COLUMNS, squeeze=False).ravel()
    for one in axes:
        one.set_axis_off()
    for one, kind in zip(axes, every, strict=False):
        degraded = degraded_case(anatomy, views, seed, pixels, kind)
        one.imshow(thumbnail(degraded, kind), cmap="gray", vmin=0, vmax=1, interpolation="antialiased")
        one.set_title(kind + _note(degraded, kind), fontsize=10)
    figure.savefig(path, dpi=64)


def thumbnail(degraded: DegradedCase, kind: str) -> np.ndarray:
    """Two views beside each other, or two sections of the CT with the outlines of its labels; gray or (H, W, 3)."""
    acts_on = () if kind == CLEAN else DEGRADATIONS[kind].acts_on
    if "image" not in acts_on and {"CT", "labels"} & set(acts_on):
        return _beside([_section(degraded, axis) for axis in (1, 2)])
    return _beside([grey_levels(view) for view in degraded.views])


def _section(degraded: DegradedCase, axis: int) -> np.ndarray:
    """(H, W, 3) section through the middle of the labels, feet down, labels outlined in red."""
    labels = degraded.structures.labels
    middle = int(np.argwhere(labels > 0)[:, axis].mean())
    low, high = CT_WINDOW_HU
    gray = np.clip((np.take(degraded.ct.voxels, middle, axis) - low) / (high - low), 0, 1)
    flat = np.take(labels, middle, axis)
    edge = np.zeros(flat.shape, bool)
    edge[:-1] |= flat[:-1] != flat[1:]
    edge[:, :-1] |= flat[:, :-1] != flat[:, 1:]
    image = np.repeat(gray[..., None], 3, axis=-1)
    image[edge] = (1, 0.2, 0.2)
    up = degraded.ct.affine[2, 2] > 0
    image = image[::-1] if up else image
    aspect = degraded.ct.spacing[2] / degraded.ct.spacing[1 if axis == 2 else 0]
    return np.repeat(image, max(1, round(aspect * 2)), axis=0).repeat(2, axis=1)


def _beside(images: list[np.ndarray]) -> np.ndarray:
    """Images of equal or different heights in one row."""
    height = max(image.shape[0] for image in images)
    padded = []
    for image in images:
        room = [(0, height - image.shape[0]), (0, 6), *[(0, 0)] * (image.ndim - 2)]
        padded.append(np.pad(image, room, constant_values=1.0))
    return np.concatenate(padded, axis=1)


def _note(degraded: DegradedCase, kind: str) -> str:
    """What the study states, where that is the fault."""
    if kind == CLEAN or DEGRADATIONS[kind].acts_on != ("study",):
        return ""
    stated = degraded.views[0].stated
    return f" ({stated.source_to_detector_mm:.0f} mm, {stated.pixel_spacing_mm[0]:.3f} mm)"
