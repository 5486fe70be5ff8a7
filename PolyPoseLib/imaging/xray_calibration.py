"""What a calibration file says about an X-ray, put in the place of what its entry leaves open."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from PolyPoseLib.errors import InputError
from PolyPoseLib.imaging.calibration import read_calibration
from PolyPoseLib.imaging.xray_fields import XrayFields
from PolyPoseLib.imaging.xray_notes import Notes


def with_calibration(given: XrayFields, folder: Path, notes: Notes) -> tuple[XrayFields, tuple[float, ...]]:
    """Fields with the calibration's intrinsics (and extrinsic, in the CT's frame), and its distortion.

    Args:
        given: the entry; what it gives wins over the calibration.
        folder: where a relative path starts and must stay; a Path was checked by the caller.
        notes: is told what was used.

    Raises:
        InputError: the file cannot be read, or leaves the folder.

    """
    if given.calibration is None:
        return given, ()
    path = folder / given.calibration
    if isinstance(given.calibration, str) and not path.resolve().is_relative_to(folder.resolve()):
        raise InputError(
            f'{notes.where}: the "calibration" lies outside the study\'s folder; move it into the folder.'
        )
    calibration = read_calibration(path)
    if given.intrinsics is None:
        given = replace(given, intrinsics=calibration.intrinsics)
        notes.say(f"intrinsics from the calibration {path.name}")
    if given.calibration_frame == "ct" and given.extrinsic is None:
        if calibration.extrinsic is None:
            raise InputError(
                f'{notes.where}: "calibration_frame" is "ct", but {path.name} holds no pose; remove it.'
            )
        given = replace(given, extrinsic=calibration.extrinsic)
        notes.say(f"extrinsic from the calibration {path.name}, in the CT's frame")
    if any(calibration.distortion):
        notes.say(f"distortion from the calibration {path.name}: undone")
        return given, calibration.distortion
    return given, ()
