"""DeepFluoro's file at full resolution, ipcai_2020_full_res_data.h5.

Layout: github.com/rg2/DeepFluoroLabeling-IPCAI2020, hdf5_layouts/Readme.md.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from PolyPoseLib.data.hounsfield import impossible_hounsfield_values, impossible_size
from PolyPoseLib.data.segmentation import whole_numbers
from PolyPoseLib.data.volume import AIR_HU, Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.rigid import require_rigid, rigid_inverse
from PolyPoseLib.io.benchmark.fluoro_frames import (
    DISTANCE_RANGE_MM,
    SPECIMENS,
    CtPlace,
    FluoroSubject,
    Frame,
    as_seen,
    is_between,
    source_view,
    true_to_camera,
)
from PolyPoseLib.io.benchmark.h5_values import H5Group, opened
from PolyPoseLib.io.benchmark.named_labels import on_scan_grid
from PolyPoseLib.io.volumes import SPACING_RANGE_MM

PARAMETERS = "proj-params"

_POSES = {
    "pelvis": "cam-to-pelvis-vol",
    "femur_left": "cam-to-left-femur-vol",
    "femur_right": "cam-to-right-femur-vol",
}
_SEEN = {"femur_left": "left-femur-good-fov", "femur_right": "right-femur-good-fov"}
"""Whether enough of a femur is in the picture for its pose to be true."""


def subject_numbers(path: Path) -> dict[str, str]:
    """{"subject01": "17-1882"} of the specimens that the file holds; raises InputError when it is another file."""
    with opened(path) as file:
        names = file.names()
        if PARAMETERS not in names:
            raise InputError(
                f'{path}: there is no "{PARAMETERS}": it is not the file at full resolution, '
                "ipcai_2020_full_res_data.h5, but a preprocessed one or another."
            )
        return {f"subject{n:02d}": each for n, each in enumerate(SPECIMENS, start=1) if each in names}


def read_subject(path: Path, specimen: str) -> FluoroSubject:
    """One cadaver's CT and labels; frames are read when they are asked for. Raises InputError."""
    with opened(path) as file:
        group = file.group(specimen)
        ct = _volume(group.group("vol"))
        if fault := impossible_size(ct) or impossible_hounsfield_values(ct):
            raise InputError(f'{path}, "{specimen}/vol": {fault}')
        voxels = np.maximum(ct.voxels.astype(np.float32), np.float32(AIR_HU))
        place = group.group("vol-seg", "image")
        numbered = whole_numbers(_volume(place), f'{place.where}: "pixels"')
        labels, warnings = on_scan_grid(numbered, ct, Path(f"{path}/{specimen}/vol-seg"))
        projections = group.group("projections")
        frames = sorted(int(name) for name in projections.names() if name.isascii() and name.isdigit())
        if not frames:
            raise InputError(f"{projections.where}: it holds no frame: copy or download the file again.")
        spacing = _pixel_spacing(file.group(PARAMETERS))
    at = CtPlace(ct.bounds_center, 0.5 * ct.affine[:3, :3].sum(axis=1))
    return FluoroSubject(
        ct=Volume(voxels, ct.affine),
        labels=labels,
        frames=frames,
        pixel_spacing_mm=spacing,
        read_frame=functools.partial(_read_frame, path, specimen, at),
        read_cameras=functools.partial(_read_cameras, path, specimen, at),
        warnings=warnings,
    )


def _volume(group: H5Group) -> Volume:
    """An image as ITK has it: pixels (k, j, i), spacing, dir-mat, origin; raises InputError."""
    spacing, origin = (_three(group, name) for name in ("spacing", "origin"))
    low, high = SPACING_RANGE_MM
    if not ((spacing >= low) & (spacing <= high)).all():
        raise InputError(
            f'{group.where}: "spacing" is {spacing.tolist()}, and voxels measure {low:g} to {high:g} mm: the unit is '
            "wrong, or the file is damaged."
        )
    affine = np.eye(4)
    affine[:3, :3] = group.matrix("dir-mat", (3, 3)) * spacing
    affine[:3, 3] = origin
    return Volume(group.numbers("pixels", dimensions=3), affine)


def _three(group: H5Group, name: str) -> np.ndarray:
    """Three numbers, written as a row or as a column."""
    values = group.numbers(name).astype(np.float64).reshape(-1)
    if values.size != 3:
        raise InputError(f'{group.where}: "{name}" holds {values.size} numbers instead of 3.')
    return values


def _pixel_spacing(parameters: H5Group) -> tuple[float, float]:
    """Pitch of the detector in mm, (between rows, between columns)."""
    pitch = (parameters.number("pixel-row-spacing"), parameters.number("pixel-col-spacing"))
    if not all(0.01 <= each <= 5 for each in pitch):
        raise InputError(
            f"{parameters.where}: pixels of {pitch[0]:g} x {pitch[1]:g} mm are no detector's: the unit is wrong."
        )
    return pitch


def _read_cameras(path: Path, specimen: str, at: CtPlace, number: int) -> Mapping[str, Camera]:
    """Cameras of a frame in the worlds of its bones."""
    with opened(path) as file:
        frame = file.group(specimen, "projections", f"{number:03d}")
        return _cameras(file.group(PARAMETERS), frame, at)[0]


def _read_frame(path: Path, specimen: str, at: CtPlace, number: int) -> Frame:
    """A frame with its picture."""
    with opened(path) as file:
        parameters = file.group(PARAMETERS)
        frame = file.group(specimen, "projections", f"{number:03d}")
        cameras, mirrored, turned = _cameras(parameters, frame, at)
        shape = (cameras["pelvis"].height, cameras["pelvis"].width)
        image = frame.group("image").numbers("pixels", dimensions=2)
        drawn = frame.group("gt-seg").numbers("pixels", dimensions=2) if "gt-seg" in frame else None
        for each in (image, drawn):
            if each is not None and each.shape != shape:
                raise InputError(
                    f"{frame.where}: a picture has {each.shape} pixels, the detector {shape}: download the file again."
                )
    return Frame(
        number,
        as_seen(image, mirrored, turned),
        cameras,
        None if drawn is None else as_seen(drawn, mirrored, turned),
    )


def _cameras(parameters: H5Group, frame: H5Group, at: CtPlace) -> tuple[dict[str, Camera], bool, bool]:
    """Cameras by bone, whether the picture is mirrored, and whether it must be turned; raises InputError."""
    intrinsics = parameters.matrix("intrinsic", (3, 3))
    shape = (int(parameters.number("num-rows")), int(parameters.number("num-cols")))
    _check_distance(parameters, intrinsics)
    extrinsic = _rigid(parameters, "extrinsic")
    turned = bool(frame.number("rot-180-for-up")) if "rot-180-for-up" in frame else False
    poses = frame.group("gt-poses")
    cameras: dict[str, Camera] = {}
    mirrored = False
    for bone, name in _POSES.items():
        # The file says that a femur's pose is no truth where too little of it is seen.
        if bone in _SEEN and (name not in poses or not poses.number(_SEEN[bone])):
            continue
        # Of the femurs the half voxel is inferred: the pelvis's is known, and one program made all three.
        to_camera = true_to_camera(extrinsic @ rigid_inverse(_rigid(poses, name)), at)
        try:
            cameras[bone], mirrored = source_view(intrinsics, to_camera, shape, at.middle, turned)
        except InputError as error:
            raise InputError(f"{poses.where}: {error}") from error
        _check_depth(poses, cameras[bone], at, abs(intrinsics[0, 0]) * _pixel_spacing(parameters)[1])
    return cameras, mirrored, turned


def _rigid(group: H5Group, name: str) -> np.ndarray:
    """A rigid motion (4, 4), stored with or without its last row; raises InputError."""
    matrix = np.eye(4)
    stored = group.matrix(name, (4, 4), (3, 4))
    matrix[: len(stored)] = stored
    return require_rigid(matrix, f'{group.where}: "{name}"')


def _check_distance(parameters: H5Group, intrinsics: np.ndarray) -> None:
    """Refuse intrinsics that no C-arm has, as in other units; raises InputError."""
    rows, columns = _pixel_spacing(parameters)
    low, high = DISTANCE_RANGE_MM
    for focal, pitch in ((intrinsics[0, 0], columns), (intrinsics[1, 1], rows)):
        if not low <= abs(focal) * pitch <= high:
            raise InputError(
                f'{parameters.where}: "intrinsic" and the pixels put the source {abs(focal) * pitch:.4g} mm from the '
                f"detector, and a C-arm's is {low:g} to {high:g} mm away: one of them is in another unit."
            )


def _check_depth(poses: H5Group, camera: Camera, at: CtPlace, distance_mm: float) -> None:
    """Refuse a pose that does not put the CT between source and detector; raises InputError."""
    if not is_between(camera, at, distance_mm):
        raise InputError(
            f"{poses.where}: the CT's middle lies {camera.depth(at.middle):.4g} mm from the source, the detector "
            f"{distance_mm:.4g} mm: the poses are in another unit, or of another specimen."
        )
