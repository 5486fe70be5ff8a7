"""An X-ray's entry together with what its calibration adds: intrinsics, extrinsic, distortion, place in a rig."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from PolyPoseLib.data.notes import Notes
from PolyPoseLib.data.xray import RigPose
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.xray.calibration import read_calibration
from PolyPoseLib.io.xray.fields import XrayFields
from PolyPoseLib.io.xray.folder import file_of_field


@dataclass(frozen=True, eq=False)
class Calibrated:
    """An entry with what its calibration adds.

    Attributes
    ----------
    fields
        The entry, completed.
    distortion
        Coefficients k1, k2, p1, p2[, k3], or empty.
    rig
        The camera's place in its rig, or None.
    image_size
        (rows, columns) that the intrinsics belong to, or None when they are not the calibration's or it does not say.
    source_side
        Whether the calibration's pose is already that of the view from the source, of an image from the other side.

    """

    fields: XrayFields
    distortion: tuple[float, ...] = ()
    rig: RigPose | None = None
    image_size: tuple[int, int] | None = None
    source_side: bool = False

    def require_size(self, shape: tuple[int, int], notes: Notes) -> None:
        """Raise InputError when the X-ray's (rows, columns) are not those that the calibration was made for."""
        if self.image_size is None or self.image_size == tuple(shape):
            return
        made, found = (f"{size[0]} rows x {size[1]} columns" for size in (self.image_size, shape))
        raise InputError(
            f"{notes.where}: its calibration is for images of {made}, but it has {found}; give the image that was "
            "calibrated, uncropped and in full resolution, or another calibration."
        )


def with_calibration(given: XrayFields, folder: Path, notes: Notes) -> Calibrated:
    """Fields with the calibration's intrinsics (and extrinsic, in the CT's frame), its distortion, and the rig.

    Parameters
    ----------
    given
        The entry; what it gives wins over the calibration.
    folder
        Where a relative path starts and must stay; a Path was checked by the caller.
    notes
        Receives what was used.

    Raises
    ------
    InputError
        The file cannot be read, or leaves the folder.

    """
    if given.calibration is None:
        return Calibrated(given, (), _rig(given, None, notes))
    path = file_of_field(folder, given.calibration, "calibration", notes)
    calibration = read_calibration(path)
    rig = _rig(given, calibration.extrinsic, notes)
    size = None
    if given.intrinsics is None:
        size = calibration.image_size
        mirrored = given.mirrored if calibration.mirrored is None else calibration.mirrored
        given = replace(given, intrinsics=calibration.intrinsics, mirrored=mirrored)
        notes.say("intrinsics from its calibration")
    if given.calibration_frame == "ct" and given.extrinsic is None:
        if calibration.extrinsic is None:
            raise InputError(
                f'{notes.where}: "calibration_frame" is "ct", but {path.name} holds no pose; remove it.'
            )
        given = replace(given, extrinsic=calibration.extrinsic)
        notes.say("extrinsic from its calibration, in the CT's frame")
    distortion = calibration.distortion if any(calibration.distortion) else ()
    if distortion:
        notes.say("distortion from its calibration: undone")
    return Calibrated(given, distortion, rig, size, bool(calibration.mirrored))


def _rig(given: XrayFields, calibrated: np.ndarray | None, notes: Notes) -> RigPose | None:
    """The camera's place in its rig: as calibrated, or else as its extrinsic says."""
    if given.rig is None:
        return None
    pose = calibrated if calibrated is not None else given.extrinsic
    if pose is None:
        raise InputError(
            f'{notes.where}: it belongs to the rig "{given.rig}", but nothing gives its place in it: give a '
            '"calibration" with rotation and translation, or an "extrinsic".'
        )
    source = "its extrinsic" if calibrated is None else "its calibration"
    notes.say(f'place in the rig "{given.rig}" from {source}')
    in_ct = calibrated is None or given.calibration_frame == "ct"
    return RigPose(given.rig, pose, "ct" if in_ct else "own")
