"""One camera of a TRACK.json: where it stands, and its images as this camera saw them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from PolyPoseLib.data.notes import Notes
from PolyPoseLib.data.tracking.sequence import TrackView
from PolyPoseLib.data.tracking.track_inputs import spread
from PolyPoseLib.errors import InputError, unknown_name
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.distortion import undistortion
from PolyPoseLib.io.tracking.camera_images import CameraImages, decide
from PolyPoseLib.io.tracking.image_run import ImageRun, open_run
from PolyPoseLib.io.xray.calibrated import Calibrated, with_calibration
from PolyPoseLib.io.xray.calibration import read_calibration
from PolyPoseLib.io.xray.detector import detector_of
from PolyPoseLib.io.xray.distorted import is_round
from PolyPoseLib.io.xray.fields import XrayFields
from PolyPoseLib.io.xray.given_mask import read_mask
from PolyPoseLib.io.xray.pose import pose_of
from PolyPoseLib.io.xray.tags import XrayTags

ENTRY = "TRACK.json"
"""What sentences call the file in which the user corrects an entry."""


@dataclass(frozen=True, eq=False)
class ReadCamera:
    """A camera with its images, and what reading it reports.

    Attributes
    ----------
    view
        The camera.
    provenance
        Origin of every number, one line each.
    warnings
        What is uncertain, one line each.
    frames_per_second
        That the files state, or None.

    """

    view: TrackView
    provenance: tuple[str, ...]
    warnings: tuple[str, ...]
    frames_per_second: float | None = None


def read_camera(
    entry: Mapping[str, Any], name: str, found: Mapping[str, Camera] | None, frames: range | None = None
) -> ReadCamera:
    """Read one camera, whose paths are resolved.

    Parameters
    ----------
    entry
        Its fields.
    name
        What it is called.
    found
        The cameras of a registration by name, of which its own is taken; None where the entry gives it.
    frames
        Numbers of the frames that are tracked, as far as they are known: scale and mask are decided on their images.

    Raises
    ------
    InputError
        Images or calibration cannot be read or do not fit, or nothing gives the camera; the sentence says which field
        to add.

    """
    path: Path = entry["images"]
    notes = Notes(path.name, ENTRY)
    calibrated = with_calibration(XrayFields.parse(entry, path.name), path.parent, notes)
    given = calibrated.fields
    run = open_run(path, path.name)
    first = int(entry.get("first") or 0)
    if first >= run.count:
        raise InputError(
            f'{path.name}: "first" is {first}, but there are {run.count} images; give the number of the image that '
            "belongs to frame 0, counted from 0."
        )
    shape = run.values(first, given).shape
    calibrated.require_size((shape[0], shape[1]), notes)
    mask = None if given.mask is None else read_mask(given.mask, path.parent, (shape[0], shape[1]), notes)
    decision = decide(run, _looked_at(run, first, frames), given, mask, notes)
    size = (shape[0], shape[1])
    if found is None:
        placed = _placed_by_entry(run, calibrated, size, notes)
    elif name in found:
        placed = _placed_by_registration(run, given, size, (name, found[name]), notes)
    else:
        raise InputError(f'{path.name}: "cameras_from": ' + unknown_name("camera", name, found))
    if placed.mirrored:
        notes.say("columns reversed: K and mask belong to the view from the source")
    places = None
    if calibrated.distortion:
        places = undistortion(size, placed.stored_intrinsics, calibrated.distortion)
    if given.calibration is None and given.distortion_corrected is None and is_round(decision.mask):
        notes.warn(
            "its field is round, as an image intensifier's: unless its distortion was corrected, bones may be several "
            'millimetres off, farther than their intervals say; if it was corrected, add "distortion_corrected": true.'
        )
    images = CameraImages(run, given, decision, places, placed.mirrored, path.name)
    view = TrackView(name, placed.camera, images, first)
    rate = stated_rate(run.tags())
    return ReadCamera(view, tuple(notes.provenance), (*run.warnings, *notes.warnings), rate)


def stated_rate(tags: XrayTags | None) -> float | None:
    """Frames per second by Frame Time (0018,1063) in ms, or Cine Rate (0018,0040); None where no tag says so."""
    if tags is None:
        return None
    time_ms = tags.positive("FrameTime")
    return 1000 / time_ms if time_ms else tags.positive("CineRate")


def _looked_at(run: ImageRun, first: int, frames: range | None) -> list[int]:
    """Numbers of the images on which scale and mask are decided."""
    start, stop = (first, run.count) if frames is None else (first + frames.start, first + frames.stop)
    stop = min(stop, run.count)
    return spread(range(start, stop)) if start < stop else spread(range(first, run.count))


@dataclass(frozen=True, eq=False)
class _Placed:
    """A camera of the undistorted view from the source, and whether the files show its mirror image."""

    camera: Camera
    mirrored: bool

    @property
    def stored_intrinsics(self) -> np.ndarray:
        """K (3, 3) of the images as the files have them."""
        return _mirrored(self.camera) if self.mirrored else self.camera.intrinsics


def _placed_by_entry(run: ImageRun, calibrated: Calibrated, shape: tuple[int, int], notes: Notes) -> _Placed:
    """The camera as its own fields, its calibration and DICOM have it; raises InputError."""
    given = calibrated.fields
    mirrored = bool(given.mirrored)
    of_calibration = given.calibration is not None and given.extrinsic is None
    if mirrored and of_calibration and not calibrated.source_side:
        raise InputError(
            f"{notes.where}: the files show the detector's side, but a calibration's pose needs the source's: turn "
            'the images round and leave "mirrored" out.'
        )
    intrinsics = detector_of(run.tags(), given, shape, notes).intrinsics
    camera = Camera(intrinsics, _extrinsic(given, notes), *shape)
    return _Placed(replace(camera, intrinsics=_mirrored(camera)) if mirrored else camera, mirrored)


def _extrinsic(given: XrayFields, notes: Notes) -> np.ndarray:
    """From the rig's world to the camera: as the entry says, or else its calibration; raises InputError without any."""
    if given.extrinsic is not None:
        notes.say(f"extrinsic from {notes.entry}, or from its calibration")
        return given.extrinsic
    pose = None if given.calibration is None else read_calibration(given.calibration).extrinsic
    if pose is None:
        raise InputError(
            f"{notes.where}: nothing says where the camera stands, which must be known: give a "
            '"calibration" with rotation and translation, an "extrinsic", or "cameras_from".'
        )
    notes.say("extrinsic from its calibration: its world is that of the poses")
    return pose


def _placed_by_registration(
    run: ImageRun, given: XrayFields, shape: tuple[int, int], named: tuple[str, Camera], notes: Notes
) -> _Placed:
    """A registration's camera, with its name, and its images mirrored as the registration had them.

    Raises InputError where the entry or the images do not go with it.
    """
    name, camera = named
    if given.extrinsic is not None:
        raise InputError(
            f'{notes.where}: "extrinsic" and "cameras_from" both say where the camera stands; leave one of them out.'
        )
    if (camera.height, camera.width) != shape:
        raise InputError(
            f'{notes.where}: the camera "{name}" of "cameras_from" took {camera.width} x {camera.height} pixels, but '
            f"these images have {shape[1]} x {shape[0]}; give images of the same detector, in full."
        )
    notes.say('camera from "cameras_from"')
    tags = run.tags()
    if given.mirrored is not None or tags is None:
        return _Placed(camera, bool(given.mirrored))
    unsaid = Notes(notes.where, notes.entry)
    distance = detector_of(tags, given, shape, unsaid).source_to_detector_mm
    pose = pose_of(tags, given, distance, None, unsaid)
    return _Placed(camera, pose is not None and pose.mirrored)


def _mirrored(camera: Camera) -> np.ndarray:
    """K (3, 3) of a camera's image with its columns in reverse order."""
    other = camera.intrinsics.copy()
    other[0, 2] = camera.width - 1 - other[0, 2]
    other[0, 1] *= -1
    return other
