"""The truth of a simulated case: what a result is scored against, in memory and as a folder."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera, require_intrinsics, require_rigid
from PolyPoseLib.imaging.label_names import structure_of
from PolyPoseLib.imaging.volume import Volume, read_volume, write_volume
from PolyPoseLib.warp.field import DisplacementField

if TYPE_CHECKING:
    from PolyPoseLib.evaluation.simulate import SimulatedCase

VERSION = 1
TRUTH_FILE = "truth.json"
_FILES = {
    "transform": "transform.h5",
    "fixed_ct": "fixed_ct.nii.gz",
    "fixed_labels": "fixed_labels.nii.gz",
    "moving_labels": "moving_labels.nii.gz",
}
_ORGAN_FILES = {"fixed_organs": "fixed_organs.nii.gz", "moving_organs": "moving_organs.nii.gz"}


@dataclass(frozen=True)
class Truth:
    """What really happened between the CT and the X-rays.

    names: structures; label n belongs to names[n - 1]. anchor: the one that stays.
    fixed_to_moving: {structure: (4, 4)} LPS mm. cameras: the true ones.
    moving_labels, fixed_labels: structure numbers in the CT's posture and in the X-rays', on the CT's grid.
    fixed_ct: HU in the X-rays' posture. field: displacement fixed -> moving, soft tissue included.
    moving_organs, fixed_organs: labels of what is neither structure nor bone, or None. organ_names: {label:
    name}. statistics: numbers of the simulation. seed: of the simulation.
    """

    names: tuple[str, ...]
    anchor: str
    fixed_to_moving: dict[str, np.ndarray]
    cameras: list[Camera]
    moving_labels: Volume
    fixed_labels: Volume
    fixed_ct: Volume
    field: DisplacementField
    moving_organs: Volume | None
    fixed_organs: Volume | None
    organ_names: dict[int, str]
    statistics: dict[str, Any]
    seed: int

    @classmethod
    def from_case(cls, case: SimulatedCase, organ_names: dict[int, str] | None = None) -> Truth:
        """The truth of a case; organ_names {label: name} names its source labels, bones are left out."""
        moving, fixed = case.source_labels, case.fixed_source_labels
        organs, names = (None, None), {}
        if moving is not None and fixed is not None:
            soft = (case.structures.labels == 0) & (moving.voxels > 0)
            numbers = [int(n) for n in np.unique(moving.voxels[soft])]
            bones = {int(n) for n in np.unique(moving.voxels[case.structures.labels > 0])}
            names = {n: (organ_names or {}).get(n, f"label {n}") for n in numbers if n not in bones}
            names = {n: name for n, name in names.items() if structure_of(name) is None}
            keep = np.array(list(names), dtype=np.int64)
            organs = tuple(
                volume.with_voxels(np.where(np.isin(volume.voxels, keep), volume.voxels, 0))
                for volume in (moving, fixed)
            )
        return cls(
            names=case.structures.names,
            anchor=case.anchor,
            fixed_to_moving=case.fixed_to_moving,
            cameras=list(case.cameras),
            moving_labels=Volume(case.structures.labels, case.ct.affine),
            fixed_labels=case.fixed_labels,
            fixed_ct=case.fixed_ct,
            field=case.field,
            moving_organs=organs[0],
            fixed_organs=organs[1],
            organ_names=names,
            statistics=case.statistics,
            seed=case.seed,
        )

    def save(self, folder: str | Path) -> Path:
        """Write truth.json and the images it names into a folder, which is made; raises InputError."""
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        self.field.write_transform(folder / _FILES["transform"])
        write_volume(
            self.fixed_ct.with_voxels(np.rint(self.fixed_ct.voxels).astype(np.int16)),
            folder / _FILES["fixed_ct"],
        )
        write_volume(self.fixed_labels, folder / _FILES["fixed_labels"])
        write_volume(self.moving_labels, folder / _FILES["moving_labels"])
        files = dict(_FILES)
        if self.fixed_organs is not None and self.moving_organs is not None:
            files |= _ORGAN_FILES
            write_volume(self.fixed_organs, folder / _ORGAN_FILES["fixed_organs"])
            write_volume(self.moving_organs, folder / _ORGAN_FILES["moving_organs"])
        fields = {
            "version": VERSION,
            "structures": {name: self.fixed_to_moving[name].tolist() for name in self.names},
            "anchor": self.anchor,
            "cameras": [
                {
                    "intrinsics": camera.intrinsics.tolist(),
                    "extrinsic": camera.extrinsic.tolist(),
                    "height": camera.height,
                    "width": camera.width,
                }
                for camera in self.cameras
            ],
            "organs": {str(number): name for number, name in self.organ_names.items()},
            "files": files,
            "statistics": self.statistics,
            "seed": self.seed,
        }
        (folder / TRUTH_FILE).write_text(json.dumps(fields, indent=1) + "\n", encoding="utf-8")
        return folder

    @classmethod
    def load(cls, folder: str | Path) -> Truth:
        """Read a folder that save wrote; raises InputError naming the file and the field that is wrong."""
        folder = Path(folder)
        path = folder / TRUTH_FILE
        if not path.is_file():
            raise InputError(
                f"{folder}: there is no {TRUTH_FILE}; give the truth folder that simulate wrote."
            )
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
            cameras = [
                _read_camera(each, f"{path}: cameras[{n}]") for n, each in enumerate(fields["cameras"])
            ]
            volumes = {
                kind: read_volume(files[kind]) for kind in ("fixed_ct", "fixed_labels", "moving_labels")
            }
            truth = cls(
                names=tuple(poses),
                anchor=fields["anchor"],
                fixed_to_moving=poses,
                cameras=cameras,
                field=DisplacementField.read_transform(files["transform"]),
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

    def require_matching_volumes(self, where: str) -> None:
        """Raise InputError, saying where, unless the volumes share a grid and show every structure."""
        for name in ("fixed_ct", "fixed_labels", "moving_organs", "fixed_organs"):
            volume = getattr(self, name)
            if volume is not None and not volume.same_grid(self.moving_labels):
                raise InputError(
                    f'{where}: "{name}" and "moving_labels" differ in grid; simulate the case again.'
                )
        shown = np.unique(self.moving_labels.voxels)
        for number, name in enumerate(self.names, start=1):
            if number not in shown:
                raise InputError(
                    f'{where}: "moving_labels" shows nothing of "{name}"; simulate the case again.'
                )


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
