"""What a calibration file says about an X-ray, put in the place of what its entry leaves open."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from PolyPoseLib.errors import InputError
from PolyPoseLib.imaging.calibration import read_calibration
from PolyPoseLib.imaging.xray_fields import XrayFields
from PolyPoseLib.imaging.xray_notes import Notes


@dataclass(frozen=True, eq=False)
class RigPose:
    """Where one camera of a rig stands.

    name: of the rig; extrinsic: (4, 4) from the rig's own world (mm), whatever that is, to this camera.
    """

    name: str
    extrinsic: np.ndarray


@dataclass(frozen=True, eq=False)
class Calibrated:
    """fields: an entry with what its calibration adds; distortion: coefficients, or empty; rig: or None."""

    fields: XrayFields
    distortion: tuple[float, ...] = ()
    rig: RigPose | None = None


def with_calibration(given: XrayFields, folder: Path, notes: Notes) -> Calibrated:
    """Fields with the calibration's intrinsics (and extrinsic, in the CT's frame), its distortion, and the rig.

    Args:
        given: the entry; what it gives wins over the calibration.
        folder: where a relative path starts and must stay; a Path was checked by the caller.
        notes: is told what was used.

    Raises:
        InputError: the file cannot be read, or leaves the folder.

    """
    if given.calibration is None:
        return Calibrated(given, (), _rig(given, None, notes))
    path = folder / given.calibration
    if isinstance(given.calibration, str) and not path.resolve().is_relative_to(folder.resolve()):
        raise InputError(
            f'{notes.where}: the "calibration" lies outside the study\'s folder; move it into the folder.'
        )
    calibration = read_calibration(path)
    rig = _rig(given, calibration.extrinsic, notes)
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
        return Calibrated(given, calibration.distortion, rig)
    return Calibrated(given, (), rig)


def _rig(given: XrayFields, calibrated: np.ndarray | None, notes: Notes) -> RigPose | None:
    """The camera's place in its rig: as calibrated, or else as its extrinsic says."""
    if given.rig is None:
        return None
    pose = calibrated if calibrated is not None else given.extrinsic
    if pose is None:
        raise InputError(
            f'{notes.where}: it belongs to the rig "{given.rig}", but nothing tells its place in it: give a '
            '"calibration" with rotation and translation, or an "extrinsic".'
        )
    source = "its extrinsic" if calibrated is None else "its calibration"
    notes.say(f'place in the rig "{given.rig}" from {source}')
    return RigPose(given.rig, pose)
