"""The folder of a simulated case's truth."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from PolyPoseLib.data.truth import Truth
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera, require_intrinsics
from PolyPoseLib.geometry.rigid import require_rigid
from PolyPoseLib.io.files import read_text
from PolyPoseLib.io.json_records import (
    Record,
    anything,
    json_text,
    list_of,
    nonempty,
    object_of,
    one_of,
    parse_object,
    quoted,
    string,
    whole_number,
)
from PolyPoseLib.io.transforms import read_transform, write_transform
from PolyPoseLib.io.volumes import read_volume, write_volume

VERSION = 1
TRUTH_FILE = "truth.json"
_FILES = {
    "transform": "transform.h5",
    "fixed_ct": "fixed_ct.nii.gz",
    "fixed_labels": "fixed_labels.nii.gz",
    "moving_labels": "moving_labels.nii.gz",
}
_ORGAN_FILES = {"fixed_organs": "fixed_organs.nii.gz", "moving_organs": "moving_organs.nii.gz"}


def save_truth(truth: Truth, folder: str | Path) -> Path:
    """Write truth.json and the images it names into a folder, which is made; raises InputError."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    write_transform(truth.field, folder / _FILES["transform"])
    write_volume(
        truth.fixed_ct.with_voxels(np.rint(truth.fixed_ct.voxels).astype(np.int16)),
        folder / _FILES["fixed_ct"],
    )
    write_volume(truth.fixed_labels, folder / _FILES["fixed_labels"])
    write_volume(truth.moving_labels, folder / _FILES["moving_labels"])
    files = dict(_FILES)
    if truth.fixed_organs is not None and truth.moving_organs is not None:
        files |= _ORGAN_FILES
        write_volume(truth.fixed_organs, folder / _ORGAN_FILES["fixed_organs"])
        write_volume(truth.moving_organs, folder / _ORGAN_FILES["moving_organs"])
    fields = {
        "version": VERSION,
        "structures": {name: truth.fixed_to_moving[name] for name in truth.names},
        "anchor": truth.anchor,
        "cameras": [
            {
                "intrinsics": camera.intrinsics,
                "extrinsic": camera.extrinsic,
                "height": camera.height,
                "width": camera.width,
            }
            for camera in truth.cameras
        ],
        "organs": truth.organ_names,
        "files": files,
        "statistics": truth.statistics,
        "seed": truth.seed,
    }
    (folder / TRUTH_FILE).write_text(json_text(fields), encoding="utf-8")
    return folder


def load_truth(folder: str | Path) -> Truth:
    """Read a folder that save_truth wrote; raises InputError naming the file and the field that is wrong."""
    folder = Path(folder)
    path = folder / TRUTH_FILE
    if not path.is_file():
        raise InputError(f"{folder}: there is no {TRUTH_FILE}; give the truth folder that simulate wrote.")
    text = read_text(path, "the truth folder that simulate wrote")
    record = Record(parse_object(text, str(path), allow_nan=True))
    try:
        truth = _read_truth(record, folder)
    except InputError as error:
        raise InputError(f"{path}: simulate the case again: {error}") from error
    truth.require_matching_volumes(str(folder))
    return truth


def _read_truth(record: Record, folder: Path) -> Truth:
    """A truth from its fields and the images beside them."""
    version = record.required("version", whole_number(1))
    if version != VERSION:
        raise InputError(f"version {version} is not {VERSION}.")
    poses = record.required("structures", object_of(require_rigid))
    if not poses:
        raise InputError('"structures" is {}; give at least one structure.')
    anchor = record.required("anchor", one_of(poses))
    files = {
        kind: folder / Path(name).name for kind, name in record.required("files", object_of(nonempty)).items()
    }
    for kind in _FILES:
        if kind not in files:
            raise InputError(f'"files" lacks "{kind}".')
    organs = record.required("organs", object_of(string))
    return Truth(
        names=tuple(poses),
        anchor=anchor,
        fixed_to_moving=poses,
        cameras=record.required("cameras", list_of(_read_camera)),
        field=read_transform(files["transform"]),
        moving_labels=read_volume(files["moving_labels"]),
        fixed_labels=read_volume(files["fixed_labels"]),
        fixed_ct=read_volume(files["fixed_ct"]),
        moving_organs=read_volume(files["moving_organs"]) if "moving_organs" in files else None,
        fixed_organs=read_volume(files["fixed_organs"]) if "fixed_organs" in files else None,
        organ_names={_label(number): name for number, name in organs.items()},
        statistics=record.required("statistics", object_of(anything)),
        seed=record.required("seed", whole_number(0)),
    )


def _read_camera(value: Any, place: str) -> Camera:
    """One camera of a truth; raises InputError that says where."""
    record = Record(value, f"{place}.")
    return Camera(
        record.required("intrinsics", require_intrinsics),
        record.required("extrinsic", require_rigid),
        record.required("height", whole_number(1)),
        record.required("width", whole_number(1)),
    )


def _label(number: str) -> int:
    """The label that names a field of "organs"; raises InputError when it is no number."""
    if not (number.isascii() and number.isdigit() and len(number) < 20):
        raise InputError(f'"organs" names {quoted(number)}, which is no label.')
    return int(number)
