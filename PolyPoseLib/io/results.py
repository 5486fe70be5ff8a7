"""The folder of a result: written whole or not at all, and read back."""

from __future__ import annotations

import json
import logging
from pathlib import Path
from typing import Any

import numpy as np

from PolyPoseLib.data.result import INTERVALS, CameraResult, Result, StructureResult
from PolyPoseLib.data.volume import AIR_HU, Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera, require_intrinsics
from PolyPoseLib.geometry.rigid import require_rigid
from PolyPoseLib.io.files import refuse_special_file, whole_folder
from PolyPoseLib.io.transforms import read_transform, write_transform
from PolyPoseLib.io.volumes import read_volume, write_volume

_LOG = logging.getLogger(__name__)

VERSION = 1

REPORT = "report.png"
"""The picture; a result may lack it."""


def save_result(result: Result, folder: Path, overwrite: bool) -> Path:
    """Write every file of a result; raises InputError and leaves nothing behind when one cannot be
    written.

    A picture that cannot be drawn is left out with a warning: it is no reason to lose hours of computation.
    """
    with whole_folder(folder, overwrite) as temporary:
        text = json.dumps(result_fields(result), indent=1, allow_nan=False)
        (temporary / "result.json").write_text(text + "\n", encoding="utf-8")
        write_transform(result.transform, temporary / "transform.h5")
        write_volume(_hounsfield(result.warped_ct), temporary / "warped_ct.nii.gz")
        write_volume(_labels(result.warped_labels), temporary / "warped_labels.nii.gz")
        for number, (rendering, camera) in enumerate(
            zip(result.renderings_after, result.cameras, strict=True)
        ):
            write_volume(_image_volume(rendering, camera), temporary / f"xray_{number}_drr.nii.gz")
        _write_picture(result, temporary / REPORT)
    return folder


def _write_picture(result: Result, path: Path) -> None:
    """Draw the report, or log why there is none; raises OSError when the system refuses to write it."""
    from PolyPoseLib.io.report import write_report

    try:
        write_report(result, path)
    except OSError:
        raise
    except InputError as error:
        reason = str(error)
    except Exception as error:  # drawing can fail in ways of its own, such as a picture of too many pixels
        reason = f"The report could not be drawn ({type(error).__name__}: {error})."
    else:
        return
    path.unlink(missing_ok=True)
    _LOG.warning("%s The result is saved without %s.", " ".join(reason.split())[:400], path.name)


def result_fields(result: Result) -> dict[str, Any]:
    """What result.json holds: plain numbers, lists and texts."""
    return _plain(
        {
            "version": VERSION,
            "trusted": result.trusted,
            "distrust": list(result.distrust),
            "anchor": result.anchor,
            "structures": {
                name: {
                    "fixed_to_moving": each.fixed_to_moving,
                    "motion": {
                        "rotation_deg": each.rotation_deg,
                        "translation_mm": each.translation_mm,
                        "axis": each.axis,
                    },
                    **({} if each.centroid is None else {"centroid": each.centroid}),
                    **({} if each.uncertainty is None else {"uncertainty": dict(each.uncertainty)}),
                }
                for name, each in result.structures.items()
            },
            "cameras": [
                {
                    "name": each.name,
                    "K": each.intrinsics,
                    "extrinsic": each.extrinsic,
                    "height": each.height,
                    "width": each.width,
                    "similarity": each.similarity,
                }
                for each in result.cameras
            ],
            "similarity": result.history,
            "seconds": result.seconds,
            "device": result.device,
            "versions": result.versions,
            "warnings": list(result.warnings),
        }
    )


def load_result(folder: str | Path) -> Result:
    """Read a result folder; raises InputError naming the file that is missing or what is wrong with it."""
    from PolyPoseLib.io.study_schema import parse

    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(f"{folder}: there is no such folder; give the --output of a finished registration.")
    path = folder / "result.json"
    refuse_special_file(path)
    try:
        fields = parse(path.read_text(encoding="utf-8"), str(path))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            f"{path}: the file is missing or unreadable: give a folder that register wrote."
        ) from error
    if fields.get("version") != VERSION:
        raise InputError(f"{path}: version {fields.get('version')!r} is not {VERSION}: register again.")
    try:
        structures = {
            name: _read_structure(each, f'"structures"."{name}"')
            for name, each in _of_type(fields, "structures", dict).items()
        }
        cameras = [
            _read_camera(each, f'"cameras"[{number}]')
            for number, each in enumerate(_of_type(fields, "cameras", list))
        ]
        rest = {
            "seconds": {stage: float(each) for stage, each in _of_type(fields, "seconds", dict).items()},
            "device": _of_type(fields, "device", str),
            "versions": _of_type(fields, "versions", dict),
            "warnings": _all_of_type(fields, "warnings", str),
        }
        history = _all_of_type(fields, "similarity", dict)
        distrust = tuple(_all_of_type({"distrust": [], **fields}, "distrust", str))
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(
            f"{path}: a field is missing or of the wrong kind ({error}): register again."
        ) from error
    return Result(
        structures=structures,
        cameras=cameras,
        history=history,
        distrust=distrust,
        anchor=str(fields.get("anchor", "")),
        warped_ct=read_volume(folder / "warped_ct.nii.gz"),
        warped_labels=read_volume(folder / "warped_labels.nii.gz"),
        transform=read_transform(folder / "transform.h5"),
        renderings_after=[
            read_volume(folder / f"xray_{number}_drr.nii.gz").voxels[0] for number in range(len(cameras))
        ],
        **rest,
    )


def _read_structure(fields: dict[str, Any], where: str) -> StructureResult:
    """One structure of result.json."""
    motion = fields["motion"]
    return StructureResult(
        require_rigid(fields["fixed_to_moving"], f'{where}."fixed_to_moving"'),
        float(motion["rotation_deg"]),
        _matrix(motion["translation_mm"], (3,)),
        _matrix(motion["axis"], (3,)),
        _read_uncertainty(fields.get("uncertainty"), f'{where}."uncertainty"'),
        _matrix(fields["centroid"], (3,)) if "centroid" in fields else None,
    )


def _read_uncertainty(fields: Any, where: str) -> dict[str, Any] | None:
    """A structure's intervals as they are stated, once those that people are shown are known to be numbers."""
    if fields is None:
        return None
    if not isinstance(fields, dict):
        raise InputError(f"{where} is no object of intervals: register again.")
    for name, shape in INTERVALS.items():
        if name in fields:
            _matrix(fields[name], shape)  # null, which stands for a number that is not finite, becomes NaN
    return fields


def _read_camera(fields: dict[str, Any], where: str) -> CameraResult:
    """One camera of result.json."""
    similarity = fields["similarity"]
    camera = Camera(
        require_intrinsics(fields["K"], f'{where}."K"'),
        require_rigid(fields["extrinsic"], f'{where}."extrinsic"'),
        fields["height"],
        fields["width"],
    )
    return CameraResult(
        camera.intrinsics,
        camera.extrinsic,
        camera.height,
        camera.width,
        float("nan") if similarity is None else float(similarity),
        str(fields.get("name", "")),
    )


def _of_type(fields: dict[str, Any], name: str, kind: type) -> Any:
    """A field of a type; raises TypeError for another."""
    if not isinstance(fields[name], kind):
        raise TypeError(f'"{name}" is {json.dumps(fields[name])[:40]}')
    return fields[name]


def _all_of_type(fields: dict[str, Any], name: str, kind: type) -> list[Any]:
    """A list whose members are of a type; raises TypeError for others."""
    values = _of_type(fields, name, list)
    return [_of_type({name: each}, name, kind) for each in values]


def _matrix(value: Any, shape: tuple[int, ...]) -> np.ndarray:
    """A float64 array of a shape; raises ValueError for another."""
    array = np.array(value, dtype=np.float64)
    if array.shape != shape:
        raise ValueError(f"a matrix has shape {array.shape} in place of {shape}")
    return array


def _hounsfield(ct: Volume) -> Volume:
    """HU as 16-bit integers, which halves the file and is how scanners store them; clipped to its range."""
    if np.issubdtype(ct.voxels.dtype, np.integer):
        return ct
    voxels = np.nan_to_num(ct.voxels, nan=AIR_HU)
    return Volume(np.clip(np.rint(voxels), -32768, 32767).astype(np.int16), ct.affine)


def _labels(labels: Volume) -> Volume:
    """Labels in the smallest unsigned type that holds them."""
    return Volume(labels.voxels.astype(np.min_scalar_type(int(labels.voxels.max()))), labels.affine)


def _image_volume(image: np.ndarray, camera: CameraResult) -> Volume:
    """A rendering as a volume of one slice with pixel spacing on the plane at unit focal length times 1000
    mm.

    Pixels have no place in the patient's space; spacing keeps their aspect ratio for viewers.
    """
    focal = camera.intrinsics[0, 0], camera.intrinsics[1, 1]
    affine = np.diag([1000 / focal[0], 1000 / focal[1], 1.0, 1.0])
    return Volume(np.asarray(image, dtype=np.float32)[None], affine)


def _plain(value: Any) -> Any:
    """The same with arrays as lists and numbers that are not finite as null, ready for JSON."""
    if isinstance(value, dict):
        return {str(name): _plain(each) for name, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(each) for each in value]
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value
