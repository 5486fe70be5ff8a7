"""What track.json holds: a track as plain numbers, lists and texts, and back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from itertools import pairwise
from typing import Any

from PolyPoseLib.data.tracking.track import Corrected, Track, TrackedFrame
from PolyPoseLib.data.tracking.track_inputs import TrackInputs
from PolyPoseLib.errors import InputError, unknown_name
from PolyPoseLib.geometry.camera import Camera, require_intrinsics
from PolyPoseLib.geometry.rigid import require_rigid
from PolyPoseLib.io.json_records import (
    Record,
    array,
    boolean,
    list_of,
    nonempty,
    number_in,
    object_of,
    plain,
    string,
    whole_number,
)
from PolyPoseLib.io.tracking.frame_records import frame_fields, frame_of
from PolyPoseLib.io.tracking.schema import RATE_RANGE

VERSION = 1

FORMAT = "polypose track"

MOST_STRUCTURES = 1000


def track_fields(track: Track) -> dict[str, Any]:
    """The fields of track.json without its list of files."""
    return plain(
        {
            "format": FORMAT,
            "version": VERSION,
            "trusted": not track.distrust,
            "distrust": track.distrust,
            "smoothed": track.smoothed,
            "reference": track.reference,
            "structures": track.names,
            "centroids": track.centroids,
            "frames_per_second": track.frames_per_second,
            "cameras": [
                {
                    "name": name,
                    "K": camera.intrinsics,
                    "extrinsic": camera.extrinsic,
                    "height": camera.height,
                    "width": camera.width,
                }
                for name, camera in track.cameras.items()
            ],
            "device": track.device,
            "versions": track.versions,
            "inputs": None if track.inputs is None else asdict(track.inputs),
            "corrections": [asdict(each) for each in track.corrections],
            "warnings": track.warnings,
            "frames": [frame_fields(each) for each in track.frames],
        }
    )


def track_of(fields: Mapping[str, Any]) -> Track:
    """The track that fields describe; raises InputError."""
    record = Record(fields)
    if fields.get("format") != FORMAT or fields.get("version") != VERSION:
        raise InputError(f'it is no track of version {VERSION} ("format", "version"): track again.')
    names = record.required("structures", list_of(nonempty))
    if not names or len(set(names)) < len(names) or len(names) > MOST_STRUCTURES:
        raise InputError('"structures" must hold names, each once.')
    reference = record.required("reference", string)
    if reference not in names:
        raise InputError('"reference": ' + unknown_name("structure", reference, names))
    distrust = record.required("distrust", list_of(string))
    if record.required("trusted", boolean) != (not distrust):
        raise InputError('"trusted" and "distrust" contradict each other.')
    frames = record.required("frames", list_of(frame_of(len(names))))
    _require_order(frames)
    cameras = record.required("cameras", list_of(_camera))
    if len(dict(cameras)) < len(cameras):
        raise InputError('"cameras": two have the same name.')
    return Track(
        names=tuple(names),
        reference=reference,
        centroids=record.required("centroids", array(len(names), 3)),
        frames=tuple(frames),
        frames_per_second=record.required("frames_per_second", number_in(RATE_RANGE, "frames per second")),
        cameras=dict(cameras),
        smoothed=record.required("smoothed", boolean),
        warnings=tuple(record.required("warnings", list_of(string))),
        distrust=tuple(distrust),
        device=record.required("device", string),
        versions=record.required("versions", object_of(string)),
        inputs=record.optional("inputs", _inputs),
        corrections=tuple(record.optional("corrections", list_of(_corrected)) or ()),
    )


def _require_order(frames: list[TrackedFrame]) -> None:
    """Refuse frames that are not in the order of time; raises InputError."""
    if not frames:
        raise InputError('"frames" is empty.')
    numbers = [each.frame for each in frames]
    if any(after <= before for before, after in pairwise(numbers)):
        raise InputError('"frames" must be in the order of time, each once.')


def _inputs(value: Any, place: str) -> TrackInputs:
    """The digests of what was tracked."""
    record = Record.within(value, place)
    return TrackInputs(
        ct=record.required("ct", string),
        labels=record.required("labels", string),
        images=record.required("images", object_of(string)),
        first=record.required("first", whole_number(0)),
        last=record.optional("last", whole_number(0)),
    )


def _corrected(value: Any, place: str) -> Corrected:
    """One correction by hand."""
    record = Record.within(value, place)
    return Corrected(
        frame=record.required("frame", whole_number(0)),
        structures=tuple(record.required("structures", list_of(string))),
        first=record.required("first", whole_number(0)),
        last=record.required("last", whole_number(0)),
    )


def _camera(value: Any, place: str) -> tuple[str, Camera]:
    """One camera and its name."""
    record = Record.within(value, place)
    camera = Camera(
        record.required("K", require_intrinsics),
        record.required("extrinsic", require_rigid),
        record.required("height", whole_number(1)),
        record.required("width", whole_number(1)),
    )
    return record.required("name", string), camera
