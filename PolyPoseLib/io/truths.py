"""The folder of a simulated case's truth."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from PolyPoseLib.data.truth import Truth
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera, require_intrinsics
from PolyPoseLib.geometry.rigid import require_rigid
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
        "structures": {name: truth.fixed_to_moving[name].tolist() for name in truth.names},
        "anchor": truth.anchor,
        "cameras": [
            {
                "intrinsics": camera.intrinsics.tolist(),
                "extrinsic": camera.extrinsic.tolist(),
                "height": camera.height,
                "width": camera.width,
            }
            for camera in truth.cameras
        ],
        "organs": {str(number): name for number, name in truth.organ_names.items()},
        "files": files,
        "statistics": truth.statistics,
        "seed": truth.seed,
    }
    (folder / TRUTH_FILE).write_text(json.dumps(fields, indent=1) + "\n", encoding="utf-8")
    return folder


def load_truth(folder: str | Path) -> Truth:
    """Read a folder that save_truth wrote; raises InputError naming the file and the field that is wrong."""
    folder = Path(folder)
    path = folder / TRUTH_FILE
    if not path.is_file():
        raise InputError(f"{folder}: there is no {TRUTH_FILE}; give the truth folder that simulate wrote.")
    try:
        fields = _json_object(path)
        if fields["version"] != VERSION:
            raise InputError(
                f"{path}: version {fields['version']} is not {VERSION}; simulate the case again."
            )
        files = {kind: folder / Path(name).name for kind, name in fields["files"].items()}
        poses = {
            name: require_rigid(_as_floats(pose), f"{path}: structures.{name}")
            for name, pose in fields["structures"].items()
        }
        if fields["anchor"] not in list(poses):
            raise InputError(f'{path}: "anchor" is none of "structures"; simulate the case again.')
        cameras = [_read_camera(each, f"{path}: cameras[{n}]") for n, each in enumerate(fields["cameras"])]
        volumes = {kind: read_volume(files[kind]) for kind in ("fixed_ct", "fixed_labels", "moving_labels")}
        truth = Truth(
            names=tuple(poses),
            anchor=fields["anchor"],
            fixed_to_moving=poses,
            cameras=cameras,
            field=read_transform(files["transform"]),
            moving_organs=read_volume(files["moving_organs"]) if "moving_organs" in files else None,
            fixed_organs=read_volume(files["fixed_organs"]) if "fixed_organs" in files else None,
            organ_names={int(number): name for number, name in fields["organs"].items()},
            statistics=fields["statistics"],
            seed=fields["seed"],
            **volumes,
        )
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            f"{path}: the field {error} is missing or wrong; simulate the case again."
        ) from error
    truth.require_matching_volumes(str(folder))
    return truth


def _json_object(path: Path) -> dict[str, Any]:
    """The object in a truth's JSON file, whose statistics may hold NaN; raises InputError or ValueError."""
    try:
        fields = json.loads(path.read_text(encoding="utf-8"))
    except RecursionError:
        raise InputError(f"{path}: its objects are nested too deeply; simulate the case again.") from None
    if not isinstance(fields, dict) or not fields.get("structures"):
        raise InputError(f"{path}: it holds no structures; simulate the case again.")
    return fields


def _read_camera(fields: dict[str, Any], where: str) -> Camera:
    """One camera of a truth; raises InputError that says where."""
    intrinsics = require_intrinsics(_as_floats(fields["intrinsics"]), f"{where}.intrinsics")
    extrinsic = require_rigid(_as_floats(fields["extrinsic"]), f"{where}.extrinsic")
    try:
        return Camera(intrinsics, extrinsic, fields["height"], fields["width"])
    except InputError as error:
        raise InputError(f"{where}: {error}") from error


def _as_floats(value: Any) -> np.ndarray:
    """An array of floats; raises ValueError for all else, whole numbers of hundreds of digits included."""
    try:
        return np.array(value, dtype=np.float64)
    except OverflowError as error:
        raise ValueError(f"with a whole number that is too large ({error})") from error
