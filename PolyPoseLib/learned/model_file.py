"""A trained regressor in a file: plain tensors and numbers, tied to the CT that it was trained on."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from PolyPoseLib.errors import InputError
from PolyPoseLib.imaging.structures import Structures
from PolyPoseLib.imaging.volume import Volume
from PolyPoseLib.input_files import refuse_special_file
from PolyPoseLib.learned.detector import VirtualDetector
from PolyPoseLib.learned.network import Architecture, CameraNetwork
from PolyPoseLib.learned.view_range import ViewRange
from PolyPoseLib.whole_file import replaced_whole

FORMAT = "polypose camera model"
VERSION = 1
MAX_BYTES = 1 << 30


@dataclass(frozen=True)
class CameraModel:
    """A regressor and what it is for.

    fingerprint: of the CT and the anchor (:func:`ct_fingerprint`); views, detector: what it was trained for;
    architecture, state: the network; validation_mm: median projection error on renderings that it was not trained on.
    """

    fingerprint: str
    views: ViewRange
    detector: VirtualDetector
    architecture: Architecture
    state: dict[str, Tensor]
    validation_mm: float

    def network(self) -> CameraNetwork:
        """The network, ready to predict; raises InputError when the state does not fit or MONAI is missing."""
        network = CameraNetwork(self.architecture)
        try:
            network.load_state_dict(self.state)
        except RuntimeError as error:
            raise InputError(
                "The camera model's network does not fit its description: train it anew."
            ) from error
        return network.eval()

    def require(self, ct: Volume, structures: Structures, anchor: str) -> None:
        """Raise InputError when it was trained on another CT or anchor."""
        if ct_fingerprint(ct, structures, anchor) != self.fingerprint:
            raise InputError(
                "The camera model was trained on another CT, or on other labels of the anchor: train one for this "
                "study with python -m PolyPoseLib train."
            )


def ct_fingerprint(ct: Volume, structures: Structures, anchor: str) -> str:
    """SHA256 over the CT's voxels and affine (to 1e-4 mm) and the anchor's mask."""
    digest = hashlib.sha256()
    digest.update(json.dumps([list(ct.shape), np.round(ct.affine, 4).tolist()]).encode())
    for voxels, mask in zip(ct.voxels, structures.mask(anchor), strict=True):
        digest.update(np.ascontiguousarray(voxels, dtype="<f4").data)
        digest.update(np.packbits(mask).data)
    return digest.hexdigest()


def save_model(model: CameraModel, path: Path) -> None:
    """Write a model whole or not at all; raises InputError when the system refuses."""
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
    """Read a model; raises InputError for anything that is not one, or not whole. Nothing in it is executed."""
    fields = read_tensors(path, "camera model")
    kind, version = fields.get("format"), fields.get("version")
    if not isinstance(kind, str) or kind != FORMAT:
        raise InputError(
            f"{path}: this is no camera model: give the file that python -m PolyPoseLib train wrote."
        )
    if type(version) is not int or version != VERSION:
        known = f"version {version}" if type(version) is int and 0 <= version < 10**6 else "no version"
        raise InputError(
            f"{path}: the camera model has {known}, but this program reads version {VERSION}: train it anew."
        )
    try:
        if fields.pop("digest") != _digest(fields):
            raise InputError("The camera model was changed after it was written: train it anew.")
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
        raise InputError(f"{path}: the camera model is damaged: train it anew.") from error


def write_tensors(fields: dict[str, Any], path: Path) -> None:
    """Write tensors and plain values whole or not at all; raises InputError when the system refuses."""
    try:
        with replaced_whole(path) as temporary, temporary.open("wb") as file:
            torch.save(fields, file)
    except (OSError, RuntimeError) as error:
        raise InputError(f"{path}: cannot be written ({error}): choose another --output.") from error


def read_tensors(path: Path, what: str) -> dict[str, Any]:
    """Tensors and plain values of a file, nothing else: code in it is refused.  Raises InputError."""
    refuse_special_file(path)
    try:
        size = path.stat().st_size
        if size > MAX_BYTES:
            raise InputError(f"{path}: {size >> 20} MiB is too large for a {what}: give another file.")
        with path.open("rb") as file:
            fields = torch.load(file, map_location="cpu", weights_only=True)
    except FileNotFoundError as error:
        raise InputError(f"{path}: there is no such file; check the name and the folder.") from error
    except OSError as error:
        raise InputError(f"{path}: the file cannot be read ({error.strerror}); check it.") from error
    except InputError:
        raise
    except Exception as error:  # torch raises many kinds for files that are damaged or hostile
        raise InputError(f"{path}: this is no {what}, or a damaged one: train it anew.") from error
    if not isinstance(fields, dict):
        raise InputError(f"{path}: this is no {what}: train one.")
    return fields


def _digest(fields: dict[str, Any]) -> str:
    """SHA256 over all values: it tells damage, not malice."""
    digest = hashlib.sha256()
    plain = {name: value for name, value in fields.items() if name not in ("state", "digest")}
    digest.update(json.dumps(plain, sort_keys=True).encode())
    for name, value in sorted(fields["state"].items()):
        digest.update(f"{name} {value.dtype} {tuple(value.shape)}".encode())
        digest.update(value.contiguous().numpy().tobytes())
    return digest.hexdigest()
