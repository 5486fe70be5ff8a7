"""Faults of the CT and of its labels as the study gives them; the X-rays are sound."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.volume import AIR_HU, Volume
from PolyPoseLib.simulation.degradations.degraded_case import DegradedCase

SHARE_CUT, SHARE_LOST = 1 / 8, 0.2
"""Slices cut off at each end, and the share of any structure that they may hold, at most."""

SLICE_ERROR = 0.10
SOFT_WINDOW_HU = (-160.0, 240.0)
SHIFT_MM = 24.0
RAW_OFFSET, RAW_PADDING = 1024, -2000


def ct_cut_short(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """The CT ends within the anatomy at both ends: up to an eighth of the slices, a fifth of any bone."""
    ct, labels = degraded.ct, degraded.structures.labels
    per_slice = np.stack(
        [np.bincount(each.ravel(), minlength=len(degraded.structures) + 1)[1:] for each in labels]
    )
    share = per_slice.cumsum(0) / per_slice.sum(0)
    most = int(SHARE_CUT * len(labels))
    low = min(most, int(np.argmax(share.max(1) > SHARE_LOST)))
    from_top = (per_slice[::-1].cumsum(0) / per_slice.sum(0)).max(1)
    high = len(labels) - min(most, int(np.argmax(from_top > SHARE_LOST)))
    affine = ct.affine.copy()
    affine[:3, 3] = ct.to_world(np.array([0, 0, low]))
    kept = slice(low, high)
    source = degraded.source_labels
    return replace(
        degraded,
        ct=Volume(ct.voxels[kept], affine),
        structures=Structures(degraded.structures.names, labels[kept]),
        source_labels=None if source is None else Volume(source.voxels[kept], affine),
    )


def ct_raw_values(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """Stored values without rescale slope and intercept: air at 24, water at 1024."""
    return _with_values(degraded, np.clip(degraded.ct.voxels + RAW_OFFSET, 0, 4095))


def ct_raw_padding(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """Stored values without rescale, and a padding of -2000 outside the round field of view."""
    _, height, width = degraded.ct.shape
    row, column = np.indices((height, width))
    radius = np.hypot((row - (height - 1) / 2) / (height / 2), (column - (width - 1) / 2) / (width / 2))
    raw = np.clip(degraded.ct.voxels + RAW_OFFSET, 0, 4095)
    return _with_values(degraded, np.where(radius > 1, RAW_PADDING, raw))


def ct_soft_window(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """Clipped to a window for soft tissue: all bone has 240 HU."""
    return _with_values(degraded, np.clip(degraded.ct.voxels, *SOFT_WINDOW_HU))


def ct_slice_distance(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """Slices 10 % farther apart than they were, labels included."""
    ct = degraded.ct
    kji = np.argwhere(degraded.structures.mask(degraded.case.anchor)).mean(0)
    stretched = ct.affine.copy()
    stretched[:3, 2] *= 1 + SLICE_ERROR
    stretched[:3, 3] += ct.affine[:3, :3] @ kji[::-1] - stretched[:3, :3] @ kji[::-1]
    source = degraded.source_labels
    return replace(
        degraded,
        ct=Volume(ct.voxels, stretched),
        source_labels=None if source is None else Volume(source.voxels, stretched),
        given_to_true=ct.affine @ np.linalg.inv(stretched) @ degraded.given_to_true,
    )


def ct_bone_only(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """Everything outside the labelled bones is air, as segmented bone models are exported."""
    return _with_values(degraded, np.where(degraded.structures.labels > 0, degraded.ct.voxels, AIR_HU))


def labels_mirrored(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """The label array mirrored left-right under the same header."""
    axis = 2 - int(np.argmax(np.abs(degraded.ct.affine[0, :3])))
    return _with_labels(degraded, lambda labels: np.flip(labels, axis))


def labels_shifted(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """All labels 24 mm beside their bones, to a side or to an end."""
    direction = int(rng.choice([0, 2]))
    column = int(np.argmax(np.abs(degraded.ct.affine[direction, :3])))
    steps = int(round(SHIFT_MM / degraded.ct.spacing[column])) * int(rng.choice([-1, 1]))
    return _with_labels(degraded, lambda labels: _shifted(labels, steps, 2 - column))


def _with_values(degraded: DegradedCase, voxels: np.ndarray) -> DegradedCase:
    """The case with other voxels of the CT."""
    return replace(degraded, ct=degraded.ct.with_voxels(voxels.astype(np.float32)))


def _with_labels(degraded: DegradedCase, change) -> DegradedCase:
    """The case with the label arrays changed by a function of (k, j, i) integers."""
    source = degraded.source_labels
    labels = np.ascontiguousarray(change(degraded.structures.labels))
    return replace(
        degraded,
        structures=Structures(degraded.structures.names, labels),
        source_labels=None
        if source is None
        else source.with_voxels(np.ascontiguousarray(change(source.voxels))),
    )


def _shifted(labels: np.ndarray, steps: int, axis: int) -> np.ndarray:
    """Labels moved by whole voxels; what leaves the grid is lost."""
    moved = np.roll(labels, steps, axis)
    emptied = [slice(None)] * 3
    emptied[axis] = slice(0, steps) if steps > 0 else slice(steps, None)
    moved[tuple(emptied)] = 0
    return moved
