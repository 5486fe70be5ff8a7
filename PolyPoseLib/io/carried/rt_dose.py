"""RT Dose carried through the dense transform, onto its own grid and in its own units."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.data.carried import Frame
from PolyPoseLib.data.result import Result
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.carried.dicom_rt import WHERE, make_derived
from PolyPoseLib.io.dicom import complete_meta, refuse_short

if TYPE_CHECKING:
    from pydicom.dataset import Dataset

MAX_VOXELS = 1 << 28

_STALE = ("DVHSequence", "ReferencedStructureSetSequence", "ReferencedImageSequence")
"""What was computed of the dose where it was, and what it referred to there."""


def carry_dose(result: Result, source: Path, dataset: Dataset, to: Frame) -> str:
    """Replace the dataset's grid of doses by the carried one; raises InputError for a damaged or unusual one."""
    dose = dose_volume(dataset, source)
    carried = result.transform_image(dose, to)
    kind = dose.voxels.dtype
    dataset.PixelData = carried.voxels.astype(kind.newbyteorder("<")).tobytes()
    for name in _STALE:
        if name in dataset:
            delattr(dataset, name)
    make_derived(dataset, f"Dose {WHERE[to]} (PolyPose)")
    dataset.DoseComment = f"Resampled {WHERE[to]} by PolyPose through its displacement field"
    return f"dose of {' x '.join(map(str, reversed(dose.shape)))} voxels, by the displacement field"


def dose_volume(dataset: Dataset, source: Path) -> Volume:
    """Stored values of an RT Dose on its grid; raises InputError for a damaged or unusual one."""
    complete_meta(dataset)
    refuse_short(dataset, str(source))
    try:
        rows, columns = int(dataset.Rows), int(dataset.Columns)
        frames, bits = int(dataset.get("NumberOfFrames") or 1), int(dataset.BitsAllocated)
        spacing = [float(each) for each in dataset.PixelSpacing]
        axes = np.array([float(each) for each in dataset.ImageOrientationPatient]).reshape(2, 3)
        origin = np.array([float(each) for each in dataset.ImagePositionPatient])
        offsets = np.array([float(each) for each in dataset.get("GridFrameOffsetVector") or [0.0]])
        signed = int(dataset.get("PixelRepresentation") or 0)
    except Exception:  # pydicom raises nearly every kind for values that are none
        raise InputError(f"{source}: the RT Dose does not say where its grid is: export it again.") from None
    if not (min(rows, columns, frames) >= 1 and rows * columns * frames <= MAX_VOXELS and bits in (16, 32)):
        raise InputError(f"{source}: the RT Dose claims {columns} x {rows} x {frames} voxels of {bits} bits.")
    syntax = dataset.file_meta.TransferSyntaxUID
    if syntax.is_encapsulated or not syntax.is_little_endian:
        raise InputError(
            f"{source}: the RT Dose is compressed or big-endian: export it as plain little-endian."
        )
    affine = np.eye(4)
    affine[:3, 0], affine[:3, 1] = axes[0] * spacing[1], axes[1] * spacing[0]
    normal = np.cross(axes[0], axes[1])
    step = _frame_step(offsets, frames, normal, axes, source)
    affine[:3, 2] = normal * step
    affine[:3, 3] = origin
    if (
        len(offsets) and abs(offsets[0]) > 1e-3
    ):  # the vector holds places instead of distances (PS3.3 C.8.8.3.2)
        affine[:3, 2] = [0, 0, step]
    kind = np.dtype(f"<{'i' if signed else 'u'}{bits // 8}")
    values = np.frombuffer(dataset.PixelData, kind, rows * columns * frames)
    return Volume(values.reshape(frames, rows, columns).astype(kind.newbyteorder("=")), affine)


def _frame_step(
    offsets: np.ndarray, frames: int, normal: np.ndarray, axes: np.ndarray, source: Path
) -> float:
    """Distance from plane to plane in mm, all equal; raises InputError where they are not, or the axes are askew."""
    steps = np.diff(offsets)
    upright = np.abs(axes @ axes.T - np.eye(2)).max() < 1e-3 and np.isfinite(normal).all()
    if not upright or len(offsets) != frames:
        raise InputError(
            f"{source}: the axes or the planes of the RT Dose contradict its grid: export it again."
        )
    if frames == 1:
        return 1.0
    if not np.isfinite(steps).all() or abs(steps[0]) < 1e-3 or np.abs(steps - steps[0]).max() > 0.01:
        raise InputError(
            f"{source}: the planes of the RT Dose are not evenly spaced: export it on an even grid."
        )
    return float(steps[0])
