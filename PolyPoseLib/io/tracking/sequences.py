"""Read a sequence from its TRACK.json and the images that it names."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from collections.abc import Sequence as Many
from pathlib import Path
from typing import Any

import numpy as np

from PolyPoseLib.data.tracking.sequence import Sequence, TrackView
from PolyPoseLib.data.tracking.track_options import TrackOptions
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.io import paths as study_paths
from PolyPoseLib.io.frame_of_reference import other_frame_warnings
from PolyPoseLib.io.label_placement import checked_structures
from PolyPoseLib.io.results import load_cameras
from PolyPoseLib.io.segmentations import read_segmentation
from PolyPoseLib.io.study_schema import initial_poses
from PolyPoseLib.io.tracking import schema
from PolyPoseLib.io.tracking.cameras import ReadCamera, read_camera
from PolyPoseLib.io.tracking.joint_schema import joints as parsed_joints
from PolyPoseLib.io.tracking.joint_schema import those_that_are_there
from PolyPoseLib.io.volumes import read_ct_with_warnings
from PolyPoseLib.kinematics.joint_motions import axes_of_joints

NARROW_DEG = 8.0
"""Cameras that differ by less in direction show next to no depth."""

RATE_TOLERANCE = 0.02
"""Share by which a frame rate may differ from the one that DICOM states, whose numbers are rounded."""

_LOG = logging.getLogger(__name__)

_FILES = ("images", "mask", "calibration")


def load_sequence(
    path: str | Path, allow_outside: bool = False, options: Mapping[str, Any] | None = None
) -> Sequence:
    """Read a TRACK.json and everything that it names.

    Parameters
    ----------
    path : path
        The sequence's JSON file; its paths start from its folder.
    allow_outside : bool
        Whether files outside that folder may be read.
    options : mapping, optional
        Options of the tracking that take the place of those in the file.

    Returns
    -------
    Sequence
        With CT and labels in memory; images are read when they are asked for.

    Raises
    ------
    InputError
        Whatever is wrong; the sentence names the file, the field and the fix.

    """
    path = Path(path)
    fields = schema.read(path)
    folder = path.parent.resolve()
    try:
        settings = schema.track_options({**(fields.get("options") or {}), **(options or {})}, '"options"')
        ct_path = study_paths.resolve(fields["ct"], "ct", folder, allow_outside)
        labels_path = study_paths.resolve(fields["segmentation"], "segmentation", folder, allow_outside)
        entries = _camera_entries(fields, folder, allow_outside)
        found = _found_cameras(fields, folder, allow_outside)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    rate = float(fields["frames_per_second"])
    views, odd_cameras = _views(entries, found, settings, rate, str(path))
    ct, odd_values = read_ct_with_warnings(ct_path, fields.get("ct_series"))
    segmentation = read_segmentation(labels_path, ct)
    try:
        structures, odd_structures = checked_structures(
            segmentation, fields["structures"], ct, fields.get("label_table"), fields["reference"]
        )
    except InputError as error:
        raise InputError(f'{path}: "structures": {error}') from error
    try:
        warnings = (
            *odd_values,
            *segmentation.warnings,
            *other_frame_warnings(labels_path, ct_path),
            *odd_structures,
            *odd_cameras,
            *_odd_views(views, settings),
        )
        for warning in warnings:
            _LOG.warning(warning)
        known = structures.names  # a structure that was left out has its warning
        joints, landmarks, odd_joints = those_that_are_there(
            parsed_joints(fields["structures"])(fields.get("joints") or [], '"joints"'),
            schema.landmarks(fields.get("landmarks") or {}, '"landmarks"'),
            known,
        )
        for warning in odd_joints:
            _LOG.warning(warning)
        poses = initial_poses(fields["structures"])(fields.get("initial_poses") or {}, '"initial_poses"')
        sequence = Sequence(
            ct=ct,
            structures=structures,
            views=views,
            frames_per_second=rate,
            reference=fields["reference"],
            initial_poses={name: pose for name, pose in poses.items() if name in known},
            still=tuple(dict.fromkeys(name for name in fields.get("still") or () if name in known)),
            landmarks=landmarks,
            joints=joints,
            source_segmentation=segmentation.whole_on_grid(ct),
            label_names=segmentation.label_names(fields.get("label_table")),
            options=settings,
            warnings=(*warnings, *odd_joints),
        )
        for axes in axes_of_joints(sequence):  # better known before hours of tracking
            for warning in axes.warnings:
                _LOG.warning(warning)
        return sequence
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def _camera_entries(fields: Mapping[str, Any], folder: Path, allow_outside: bool) -> list[dict[str, Any]]:
    """The fields of every camera with whole paths; raises InputError for paths that may not be read."""
    entries: list[dict[str, Any]] = [
        {
            name: study_paths.resolve(value, f'cameras"[{number}]."{name}', folder, allow_outside)
            if name in _FILES and value is not None
            else value
            for name, value in camera.items()
        }
        for number, camera in enumerate(fields["cameras"])
    ]
    for number, entry in enumerate(entries):
        for other, earlier in enumerate(entries[:number]):
            if entry["images"].samefile(earlier["images"]):
                raise InputError(
                    f'"cameras"[{number}] has the same images as "cameras"[{other}]: give each camera its own.'
                )
    return entries


def _found_cameras(fields: Mapping[str, Any], folder: Path, allow_outside: bool) -> dict[str, Camera] | None:
    """The cameras of the registration that "cameras_from" names, by name; None without one."""
    if fields.get("cameras_from") is None:
        return None
    place = study_paths.resolve(fields["cameras_from"], "cameras_from", folder, allow_outside)
    found = load_cameras(place)
    names = [each.name for each in found]
    if len(set(names)) < len(names):
        raise InputError(
            '"cameras_from": two of its X-rays have the same name: register with a "name" for each X-ray.'
        )
    return {each.name: each.camera for each in found}


def _views(
    entries: Many[Mapping[str, Any]],
    found: Mapping[str, Camera] | None,
    options: TrackOptions,
    rate: float,
    where: str,
) -> tuple[tuple[TrackView, ...], list[str]]:
    """All cameras, and warnings about them; raises InputError."""
    last = schema.MAX_FRAME if options.last is None else options.last
    frames = range(options.first, last + 1)
    views: list[TrackView] = []
    warnings: list[str] = []
    for number, entry in enumerate(entries):
        name = schema.camera_name(entry, number)
        try:
            read = read_camera(entry, name, found, frames)
        except InputError as error:
            raise InputError(f'{where}: "cameras"[{number}]: {error}') from error
        for line in read.provenance:
            _LOG.info("%s: %s", name, line)
        warnings.extend(f"{name}: {line}" for line in (*read.warnings, *_odd_rate(read, rate)))
        views.append(read.view)
    return tuple(views), warnings


def _odd_rate(read: ReadCamera, rate: float) -> list[str]:
    """A warning where the files state another frame rate."""
    stated = read.frames_per_second
    if stated is None or abs(stated - rate) <= RATE_TOLERANCE * rate:
        return []
    return [f'DICOM states {stated:.6g} frames per second, and "frames_per_second" is {rate:g}: check it.']


def _odd_views(views: Many[TrackView], options: TrackOptions) -> list[str]:
    """Warnings about cameras together; raises InputError where two hold the same pictures."""
    if len(views) == 1:
        return ["There is one camera only: how far a structure moved along its rays is poorly known."]
    warnings = _lengths(views)
    axes = np.stack([view.camera.axis for view in views])
    widest = float(np.degrees(np.arccos(np.clip(axes @ axes.T, -1, 1))).max())
    if widest < NARROW_DEG:
        warnings.append(
            f"All cameras look from within {widest:.0f} degrees of one direction, as one camera would: how far a "
            "structure moved along its rays is poorly known."
        )
    _refuse_same_pictures(views, options.first)
    return warnings


def _lengths(views: Many[TrackView]) -> list[str]:
    """A warning where cameras have different numbers of images left from frame 0."""
    left = [view.images.count - view.first for view in views]
    if len(set(left)) == 1:
        return []
    each = ", ".join(f"{view.name} {count}" for view, count in zip(views, left, strict=True))
    return [
        f"The cameras have different numbers of images from frame 0 on ({each}): frames that all have are tracked; "
        'check "first".'
    ]


def _refuse_same_pictures(views: Many[TrackView], frame: int) -> None:
    """Raise InputError where two cameras show one picture in their first frame."""
    from PolyPoseLib.similarity.same_picture import SAME_PICTURE, detail_of, likeness

    details = [detail_of(*view.images.read(min(view.first + frame, view.images.count - 1))) for view in views]
    for number, detail in enumerate(details):
        for other, earlier in enumerate(details[:number]):
            if likeness(earlier, detail)[0] > SAME_PICTURE:
                raise InputError(
                    f'"cameras"[{number}] shows the same picture as "cameras"[{other}] in its first frame: give each '
                    "camera its own images."
                )
