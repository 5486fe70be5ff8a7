"""The text of a TRACK.json: the fields that a sequence may have, and nothing else."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from PolyPoseLib.data.options import RANGES
from PolyPoseLib.data.tracking.track_options import TRACK_CHOICES, TrackOptions
from PolyPoseLib.errors import InputError
from PolyPoseLib.io import study_schema
from PolyPoseLib.io.files import read_text
from PolyPoseLib.io.json_records import (
    Parser,
    Record,
    array,
    boolean,
    kind_of,
    list_of,
    nonempty,
    number_in,
    object_of,
    one_of,
    parse_object,
    whole_number,
)
from PolyPoseLib.io.study_schema import MAX_BYTES, MAX_LABELS, structure_name
from PolyPoseLib.io.tracking.joint_schema import check_landmark_names, joints
from PolyPoseLib.io.xray.fields import FIELDS, XrayFields

REQUIRED = ("ct", "segmentation", "structures", "reference", "frames_per_second", "cameras")

OPTIONAL = (
    "version", "still", "cameras_from", "initial_poses", "landmarks", "joints", "options", "ct_series", "label_table",
    "comment",
)  # fmt: skip

NOT_OF_CAMERAS = (
    "image", "frame", "isocenter_mm", "source_to_isocenter_mm", "primary_angle_deg", "secondary_angle_deg",
    "patient_position", "standard_view", "landmarks", "rig",
)  # fmt: skip
"""Fields of an X-ray that serve to choose one image or to find its camera, which is known here."""

CAMERA_FIELDS = ("images", "first", *(name for name in FIELDS if name not in NOT_OF_CAMERAS), "comment")
"""Every field of a camera."""

MAX_CAMERAS = 16
"""More cameras are refused."""

RATE_RANGE = (1e-3, 1e6)
"""Frames per second."""

MAX_FRAME = 10_000_000
"""Numbers of images and frames beyond it are refused."""

FARTHEST_MM = 1e5
"""No patient has points farther from the origin."""


def read(path: Path) -> dict[str, Any]:
    """The fields of a TRACK.json, checked.

    Raises
    ------
    InputError
        The file cannot be read, is no JSON object, or a field is unknown, missing or of the wrong form; the sentence
        names the file, the field and the fix.

    """
    fields = parse_object(read_text(path, "the sequence's JSON file", MAX_BYTES), str(path))
    check(fields, str(path))
    return fields


def check(fields: Mapping[str, Any], name: str) -> None:
    """Check names and types of all fields, without opening any other file; raises InputError."""
    try:
        record = Record(fields)
        study_schema.check_version(record)
        record.require_known((*REQUIRED, *OPTIONAL))
        record.required("ct", nonempty)
        record.required("segmentation", nonempty)
        record.required("structures", study_schema.check_structures)
        known = structure_name(fields["structures"])
        record.required("reference", known)
        record.required("frames_per_second", number_in(RATE_RANGE, "frames per second"))
        record.required("cameras", _check_cameras)
        record.optional("still", _names(known))
        record.optional("cameras_from", nonempty)
        record.optional("initial_poses", study_schema.initial_poses(fields["structures"]))
        points = record.optional("landmarks", landmarks) or {}
        check_landmark_names(points, fields["structures"], '"landmarks"')
        record.optional("joints", joints(fields["structures"]))
        record.optional("options", track_options)
        study_schema.check_ct_fields(fields)
    except InputError as error:
        raise InputError(f"{name}: {error}") from error


def landmarks(value: Any, place: str) -> dict[str, np.ndarray]:
    """Parse {name: point (3,), LPS mm}."""
    points = object_of(array(3))(value, place)
    if len(points) > MAX_LABELS:
        raise InputError(f"{place} holds {len(points)} points: give at most {MAX_LABELS}.")
    for name, point in points.items():
        if np.abs(point).max() > FARTHEST_MM:
            raise InputError(
                f'{place}."{name[:40]}" is farther than {FARTHEST_MM:g} mm: give LPS millimetres.'
            )
    return points


def track_options(value: Any, place: str) -> TrackOptions:
    """Parse the options of a tracking; raises InputError for unknown names and wrong values."""
    record = Record.within(value, place)
    record.require_known(_OPTIONS)
    given = {name: record.optional(name, parser) for name, parser in _OPTIONS.items()}
    options = TrackOptions(**{name: each for name, each in given.items() if each is not None})
    return require_ranges(options)


def require_ranges(options: TrackOptions) -> TrackOptions:
    """The options, once threads and frames are such as a machine knows; raises InputError."""
    least, most = RANGES["threads"]
    if options.threads is not None and not least <= options.threads <= most:
        raise InputError(
            f'Option "threads" is {options.threads}: give a whole number from {least:g} to {most:g}.'
        )
    if max(options.first, options.last or 0) > MAX_FRAME:
        raise InputError(f'"first" and "last" frame must be at most {MAX_FRAME}.')
    return options


_OPTIONS: dict[str, Parser[Any]] = {
    **{name: one_of(choices) for name, choices in TRACK_CHOICES.items()},
    "first": whole_number(0, "counted from 0"),
    "last": whole_number(0, "counted from 0"),
    "backward": boolean,
    "smooth": boolean,
    "threads": whole_number(1),
}
"""A parser for every option."""

assert set(_OPTIONS) == {field.name for field in dataclasses.fields(TrackOptions)}


def _names(known: Parser[str]) -> Parser[list[str]]:
    """A parser of a list of structures."""
    return list_of(known)


def _check_cameras(cameras: Any, place: str) -> None:
    """A list of at least one camera, each with its images and a name of its own."""
    if not isinstance(cameras, list):
        raise InputError(f"{place} must be a list of objects, not {kind_of(cameras)}.")
    if not cameras:
        raise InputError(f"{place} is empty: at least one camera is needed, two or more to find depth.")
    if len(cameras) > MAX_CAMERAS:
        raise InputError(f"{place} holds {len(cameras)} entries: give at most {MAX_CAMERAS}.")
    names: dict[str, int] = {}
    for number, camera in enumerate(cameras):
        where = f"{place}[{number}]"
        if not isinstance(camera, dict):
            raise InputError(
                f'{where} must be an object such as {{"images": "cam1"}}, not {kind_of(camera)}.'
            )
        record = Record(camera, f"{where}: ")
        record.require_known(CAMERA_FIELDS)
        record.required("images", nonempty)
        first = record.optional("first", whole_number(0, "the image that belongs to frame 0, counted from 0"))
        if first is not None and first > MAX_FRAME:
            raise InputError(f'{where}: "first" is beyond {MAX_FRAME}: give the number of an image.')
        given = XrayFields.parse(camera, where)
        if given.camera not in (None, "known"):
            raise InputError(
                f'{where}: "camera" is "{given.camera}", but the cameras of a sequence are known: find them on one '
                'frame by a registration and give "cameras_from", or leave the field out.'
            )
        name = camera_name(camera, number)
        if name in names:
            raise InputError(
                f"{where} has the same name as {place}[{names[name]}]: give every camera a name of its own."
            )
        names[name] = number


def camera_name(entry: Mapping[str, Any], number: int) -> str:
    """What a camera is called in results; number: its place in the list, counted from 0."""
    return str(entry.get("name") or "").strip() or f"camera {number + 1}"
