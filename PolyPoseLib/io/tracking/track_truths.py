"""The truth of a simulated sequence as a file."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from PolyPoseLib.data.tracking.track_truth import TrackTruth
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera, require_intrinsics
from PolyPoseLib.geometry.rigid import require_rigid
from PolyPoseLib.io.files import read_text
from PolyPoseLib.io.json_records import (
    Record,
    array,
    json_text,
    list_of,
    number_in,
    object_of,
    one_of,
    parse_object,
    string,
    whole_number,
)

VERSION = 1
TRUTH_FILE = "truth.json"
KIND = "sequence"
"""Field "of", by which this truth differs from that of a study."""

MAX_BYTES = 1 << 30
"""A hundred thousand frames of a few bones."""

_HEAD = 1000
"""Characters of the file among which its kind stands."""

_RATES = (1e-3, 1e6)


def track_truth_path(place: str | Path) -> Path:
    """The file that a folder of a sequence, or the path of the file itself, leads to."""
    place = Path(place)
    return place / TRUTH_FILE if place.is_dir() else place


def save_track_truth(truth: TrackTruth, path: Path) -> None:
    """Write a truth; raises OSError as the system does."""
    fields = {
        "version": VERSION,
        "of": KIND,
        "description": truth.description,
        "reference": truth.reference,
        "frames_per_second": truth.frames_per_second,
        "seed": truth.seed,
        "structures": {
            name: {
                "centroid": truth.centroids[number],
                "points": np.round(truth.points[name], 3),
                "rig_to_ct": truth.poses[:, number],
            }
            for number, name in enumerate(truth.names)
        },
        "cameras": {
            name: {
                "intrinsics": camera.intrinsics,
                "extrinsic": camera.extrinsic,
                "height": camera.height,
                "width": camera.width,
            }
            for name, camera in truth.cameras.items()
        },
        "unseen": truth.unseen,
    }
    path.write_text(json_text(fields), encoding="utf-8")


def load_track_truth(place: str | Path) -> TrackTruth:
    """Read what save_track_truth wrote, given its path or the folder it lies in.

    Raises
    ------
    InputError
        It is not there or not such a file; the sentence names the field.

    """
    path = track_truth_path(place)
    text = read_text(path, "the truth of a simulated sequence", MAX_BYTES)
    record = Record(parse_object(text, str(path)), f"{path}: ")
    version = record.required("version", whole_number(1))
    if version != VERSION:
        raise InputError(f"{path}: version {version} is not {VERSION}: simulate the sequence again.")
    record.required("of", one_of((KIND,)))
    structures = record.required("structures", object_of(_structure))
    if not structures:
        raise InputError(f'{path}: "structures" is empty: simulate the sequence again.')
    counts = {len(poses) for _, _, poses in structures.values()}
    if len(counts) > 1 or 0 in counts:
        raise InputError(
            f"{path}: the structures have different numbers of frames: simulate the sequence again."
        )
    return TrackTruth(
        names=tuple(structures),
        reference=record.required("reference", one_of(structures)),
        frames_per_second=record.required("frames_per_second", number_in(_RATES, "frames per second")),
        poses=np.stack([poses for _, _, poses in structures.values()], axis=1),
        centroids=np.array([centroid for centroid, _, _ in structures.values()]),
        points={name: points for name, (_, points, _) in structures.items()},
        cameras=record.required("cameras", object_of(_camera)),
        unseen={
            name: tuple(frames)
            for name, frames in record.required("unseen", object_of(list_of(whole_number(0)))).items()
        },
        seed=record.required("seed", whole_number(0)),
        description=record.required("description", string),
    )


def is_track_truth(place: str | Path) -> bool:
    """Whether a path leads to the truth of a sequence, not to the folder of a study's truth."""
    path = track_truth_path(place)
    if not path.is_file():
        return False
    with path.open(encoding="utf-8", errors="replace") as stream:
        return re.search(rf'"of"\s*:\s*"{KIND}"', stream.read(_HEAD)) is not None


def _structure(value: Any, place: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Centroid (3,), points (N, 3) and poses (F, 4, 4) of one structure."""
    record = Record.within(value, place)
    points = record.required("points", array(-1, 3))
    if not len(points):
        raise InputError(f'{place}."points" is empty: simulate the sequence again.')
    poses = record.required("rig_to_ct", list_of(require_rigid))
    return record.required("centroid", array(3)), points, np.array(poses).reshape(-1, 4, 4)


def _camera(value: Any, place: str) -> Camera:
    """One camera of the rig."""
    record = Record.within(value, place)
    return Camera(
        record.required("intrinsics", require_intrinsics),
        record.required("extrinsic", require_rigid),
        record.required("height", whole_number(1)),
        record.required("width", whole_number(1)),
    )
