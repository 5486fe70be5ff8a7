"""What a calibration file says about an X-ray, put in the place of what its entry leaves open."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import require_rigid
from PolyPoseLib.imaging.calibration import read_calibration
from PolyPoseLib.imaging.xray_fields import XrayFields
from PolyPoseLib.imaging.xray_notes import Notes


@dataclass(frozen=True, eq=False)
class RigPose:
    """Where one camera of a rig stands.

    name: of the rig; extrinsic: (4, 4) from the rig's own world (mm), whatever that is, to this camera; frame: which
    world that is, one of CALIBRATION_FRAMES.  Cameras with different frames are not related.

    Raises InputError when the extrinsic is not rigid and finite.
    """

    name: str
    extrinsic: np.ndarray
    frame: str = "own"

    def __post_init__(self) -> None:
        """Validate."""
        where = f'The place in the rig "{self.name}"'
        object.__setattr__(self, "extrinsic", require_rigid(self.extrinsic, where))


@dataclass(frozen=True, eq=False)
class Calibrated:
    """An entry with what its calibration adds.

    fields: the entry; distortion: coefficients, or empty; rig: or None; image_size: (rows, columns) that the
    intrinsics belong to, or None when they are not the calibration's or it does not say.
    """

    fields: XrayFields
    distortion: tuple[float, ...] = ()
    rig: RigPose | None = None
    image_size: tuple[int, int] | None = None

    def require_size(self, shape: tuple[int, ...], notes: Notes) -> None:
        """Raise InputError when the X-ray's (rows, columns) are not those that the calibration was made for."""
        if self.image_size in (None, tuple(shape)):
            return
        made, found = (f"{size[0]} rows x {size[1]} columns" for size in (self.image_size, shape))
        raise InputError(
            f"{notes.where}: its calibration is for images of {made}, but it has {found}; give the image that was "
            "calibrated, uncropped and in full resolution, or another calibration."
        )


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
    size = None
    if given.intrinsics is None:
        size = calibration.image_size
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
        return Calibrated(given, calibration.distortion, rig, size)
    return Calibrated(given, (), rig, size)


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
    in_ct = calibrated is None or given.calibration_frame == "ct"
    return RigPose(given.rig, pose, "ct" if in_ct else "own")
