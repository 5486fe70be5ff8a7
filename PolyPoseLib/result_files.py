"""The folder of a result: written whole or not at all, and read back."""

from __future__ import annotations

import errno
import json
import os
import re
import shutil
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from PolyPoseLib.errors import InputError
from PolyPoseLib.imaging.volume import AIR_HU, Volume, read_volume, write_volume
from PolyPoseLib.result import CameraResult, Result, StructureResult

VERSION = 1

_OURS = re.compile(
    r"^(result\.json|transform\.h5|warped_ct\.nii\.gz|warped_labels\.nii\.gz|report\.png)$|^xray_\d+_drr\.nii\.gz$"
)


def check_destination(folder: str | Path, overwrite: bool) -> None:
    """Refuse a destination that cannot take a result, before hours are spent on it; raises InputError.

    Only a folder that is absent, empty, or an earlier result (with overwrite) will do: nothing else is
    deleted.
    """
    folder = Path(folder)
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: this is a file: choose a folder for --output.")
    parent = folder.resolve().parent
    if not parent.is_dir():
        raise InputError(f"{folder}: the folder {parent} does not exist: make it first.")
    if not os.access(parent, os.W_OK | os.X_OK):
        raise InputError(
            f"{folder}: nothing can be written in {parent}: check its permissions or choose another."
        )
    if not folder.is_dir():
        return
    names = sorted(each.name for each in folder.iterdir())
    others = [name for name in names if not _OURS.match(name)]
    if others:
        raise InputError(
            f'{folder}: the folder holds files that are no result ("{others[0]}"): choose a new or empty '
            "folder."
        )
    if names and not overwrite:
        raise InputError(f"{folder}: the folder already holds a result: choose another, or add --overwrite.")
    if folder.is_symlink():
        raise InputError(f"{folder}: this is a link: give the folder that it leads to.")


@contextmanager
def whole_folder(folder: Path, overwrite: bool) -> Iterator[Path]:
    """A temporary sibling that becomes the folder when the block succeeds and vanishes when it does not.

    Raises InputError for what the system refuses (no space, no permission), with the mend.
    """
    check_destination(folder, overwrite)
    target = folder.resolve()
    temporary = target.with_name(f".{target.name}.{uuid.uuid4().hex[:8]}.partial")
    try:
        temporary.mkdir()
        yield temporary
        _replace(temporary, target)
    except OSError as error:
        raise InputError(_refusal(folder, error)) from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def save_result(result: Result, folder: Path, overwrite: bool) -> Path:
    """Write every file of a result; raises InputError and leaves nothing behind when one cannot be
    written.
    """
    from PolyPoseLib.report import write_report

    with whole_folder(folder, overwrite) as temporary:
        text = json.dumps(result_fields(result), indent=1, allow_nan=False)
        (temporary / "result.json").write_text(text + "\n", encoding="utf-8")
        result.transform.write_transform(temporary / "transform.h5")
        write_volume(_hounsfield(result.warped_ct), temporary / "warped_ct.nii.gz")
        write_volume(_labels(result.warped_labels), temporary / "warped_labels.nii.gz")
        for number, (rendering, camera) in enumerate(
            zip(result.renderings_after, result.cameras, strict=True)
        ):
            write_volume(_image_volume(rendering, camera), temporary / f"xray_{number}_drr.nii.gz")
        write_report(result, temporary / "report.png")
    return folder


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


def read_result(folder: Path) -> Result:
    """Read a result folder; raises InputError naming the file and what is wrong with it."""
    from PolyPoseLib.study_schema import parse
    from PolyPoseLib.warp.field import DisplacementField

    path = folder / "result.json"
    try:
        fields = parse(path.read_text(encoding="utf-8"), str(path))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            f"{path}: the file is missing or unreadable: give a folder that register wrote."
        ) from error
    if fields.get("version") != VERSION:
        raise InputError(f"{path}: version {fields.get('version')!r} is not {VERSION}: register again.")
    try:
        structures = {name: _read_structure(each) for name, each in fields["structures"].items()}
        cameras = [_read_camera(each) for each in fields["cameras"]]
        rest = {name: fields[name] for name in ("seconds", "device", "versions", "warnings")}
        history, distrust = fields["similarity"], tuple(fields.get("distrust", ()))
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
        transform=DisplacementField.read_transform(folder / "transform.h5"),
        renderings_after=[
            read_volume(folder / f"xray_{number}_drr.nii.gz").voxels[0] for number in range(len(cameras))
        ],
        **rest,
    )


def _read_structure(fields: dict[str, Any]) -> StructureResult:
    """One structure of result.json."""
    motion = fields["motion"]
    return StructureResult(
        _matrix(fields["fixed_to_moving"], (4, 4)),
        float(motion["rotation_deg"]),
        _matrix(motion["translation_mm"], (3,)),
        _matrix(motion["axis"], (3,)),
        fields.get("uncertainty"),
        _matrix(fields["centroid"], (3,)) if "centroid" in fields else None,
    )


def _read_camera(fields: dict[str, Any]) -> CameraResult:
    """One camera of result.json."""
    similarity = fields["similarity"]
    return CameraResult(
        _matrix(fields["K"], (3, 3)),
        _matrix(fields["extrinsic"], (4, 4)),
        int(fields["height"]),
        int(fields["width"]),
        float("nan") if similarity is None else float(similarity),
        str(fields.get("name", "")),
    )


def _matrix(value: Any, shape: tuple[int, ...]) -> np.ndarray:
    """A float64 array of a shape; raises ValueError for another."""
    array = np.array(value, dtype=np.float64)
    if array.shape != shape:
        raise ValueError(f"a matrix has shape {array.shape} in place of {shape}")
    return array


def _replace(temporary: Path, target: Path) -> None:
    """Put the temporary folder in the target's place; the old one is kept until that has worked."""
    if not target.exists():
        temporary.rename(target)
        return
    old = target.with_name(f".{target.name}.{uuid.uuid4().hex[:8]}.old")
    target.rename(old)
    try:
        temporary.rename(target)
    except OSError:
        old.rename(target)
        raise
    shutil.rmtree(old, ignore_errors=True)


def _refusal(folder: Path, error: OSError) -> str:
    """One sentence for an error of the system."""
    if error.errno in (errno.ENOSPC, getattr(errno, "EDQUOT", None)):
        reason = "no space is left on the disk: free some, or"
    elif error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        reason = "writing is not permitted here:"
    else:
        reason = f"the result could not be written ({error.strerror}):"
    return f"{folder}: {reason} choose another --output; nothing was written."


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
