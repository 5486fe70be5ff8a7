"""Camera models and training checkpoints as files: plain tensors and numbers, nothing that is executed."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import torch

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError, memory_ran_out
from PolyPoseLib.io.files import refuse_special_file
from PolyPoseLib.io.inflation import archive_holds_more
from PolyPoseLib.io.whole_files import FileClaim, replaced_whole
from PolyPoseLib.learned.camera_model import CameraModel
from PolyPoseLib.learned.detector import VirtualDetector
from PolyPoseLib.learned.network import Architecture
from PolyPoseLib.learned.regress import CameraRegressor
from PolyPoseLib.learned.view_range import ViewRange

FORMAT = "polypose camera model"
VERSION = 1
MAX_BYTES = 1 << 30
"""Larger files are not read."""


def save_model(model: CameraModel, path: Path | FileClaim) -> None:
    """Write a model whole or not at all.

    Parameters
    ----------
    model
        The trained model.
    path
        File to write, replaced if it exists.

    Raises
    ------
    InputError
        The system refuses.

    """
    fields = {
        "format": FORMAT,
        "version": VERSION,
        "fingerprint": model.fingerprint,
        "views": {**asdict(model.views), "views": list(model.views.views)},
        "detector": asdict(model.detector),
        "architecture": {
            "views": model.architecture.views,
            "blocks": list(model.architecture.blocks),
            "channels": list(model.architecture.channels),
        },
        "validation_mm": float(model.validation_mm),
        "state": {name: value.detach().cpu().clone() for name, value in model.state.items()},
    }
    write_tensors({**fields, "digest": _digest(fields)}, path)


def load_model(path: Path) -> CameraModel:
    """Read a model. Nothing in the file is executed.

    Raises
    ------
    InputError
        Another kind of file, another version, damaged or changed.

    """
    fields = read_tensors(path, "camera model")
    kind, version = fields.get("format"), fields.get("version")
    if not isinstance(kind, str) or kind != FORMAT:
        raise InputError(
            f"{path}: this is no camera model: give the file that python -m PolyPoseLib train wrote."
        )
    if type(version) is not int or version != VERSION:
        known = f"version {version}" if type(version) is int and 0 <= version < 10**6 else "no version"
        raise InputError(
            f"{path}: the camera model has {known}, but this program reads version {VERSION}: train it again."
        )
    try:
        if fields.pop("digest") != _digest(fields):
            raise InputError("The camera model was changed after it was written: train it again.")
        sizes = fields["architecture"]
        views = fields["views"]
        return CameraModel(
            str(fields["fingerprint"]),
            ViewRange(**{**views, "views": tuple(views["views"])}),
            VirtualDetector(**fields["detector"]),
            Architecture(sizes["views"], tuple(sizes["blocks"]), tuple(sizes["channels"])),
            fields["state"],
            float(fields["validation_mm"]),
        )
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError, RuntimeError) as error:
        # RuntimeError: tensors in the place of numbers, or such as numpy has not, sparse ones for example.
        raise InputError(f"{path}: the camera model is damaged: train it again.") from error


def load_regressor(path: str | Path, ct: Volume, structures: Structures, anchor: str) -> CameraRegressor:
    """A camera regressor for one CT.

    Parameters
    ----------
    path
        A file that `save_model` wrote.
    ct
        The CT that it was trained on.
    structures, anchor
        The structures and the one that defines the cameras.

    Raises
    ------
    InputError
        The file is damaged or of another CT or anchor.

    """
    path = Path(path)
    model = load_model(path)
    try:
        return CameraRegressor.of(model, ct, structures, anchor)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def write_tensors(fields: dict[str, Any], path: Path | FileClaim) -> None:
    """Write tensors and plain values whole or not at all; raises InputError when the system refuses."""
    name = path.path if isinstance(path, FileClaim) else path
    try:
        with replaced_whole(path) as temporary, temporary.open("wb") as file:
            torch.save(fields, file)
    except (OSError, RuntimeError) as error:
        raise InputError(f"{name}: cannot be written ({error}): choose another --output.") from error


def read_tensors(path: Path, what: str) -> dict[str, Any]:
    """Tensors and plain values of a file, nothing else: code in it is refused.

    Parameters
    ----------
    path
        The file.
    what
        What the caller expects, for the sentences.

    Raises
    ------
    InputError
        Absent, too large, damaged, or another kind of file.

    """
    refuse_special_file(path)
    try:
        size = path.stat().st_size
        if size > MAX_BYTES:
            raise InputError(f"{path}: {size >> 20} MiB is too large for a {what}: give another file.")
        if archive_holds_more(path, MAX_BYTES):
            raise InputError(
                f"{path}: it is compressed and grows beyond {MAX_BYTES >> 20} MiB: give another file."
            )
        with path.open("rb") as file:
            fields = torch.load(file, map_location="cpu", weights_only=True)
    except FileNotFoundError as error:
        raise InputError(f"{path}: there is no such file; check the name and the folder.") from error
    except OSError as error:
        raise InputError(f"{path}: the file cannot be read ({error.strerror}); check it.") from error
    except InputError:
        raise
    except MemoryError as error:
        raise memory_ran_out(str(path)) from error
    except Exception as error:  # torch raises many kinds for files that are damaged or hostile
        raise InputError(f"{path}: this is no {what}, or a damaged one: train it again.") from error
    if not isinstance(fields, dict):
        raise InputError(f"{path}: this is no {what}: train one.")
    return fields


def _digest(fields: dict[str, Any]) -> str:
    """SHA256 over all values: it detects damage, not malice."""
    digest = hashlib.sha256()
    plain = {name: value for name, value in fields.items() if name not in ("state", "digest")}
    digest.update(json.dumps(plain, sort_keys=True).encode())
    for name, value in sorted(fields["state"].items()):
        digest.update(f"{name} {value.dtype} {tuple(value.shape)}".encode())
        digest.update(value.contiguous().numpy().tobytes())
    return digest.hexdigest()
