"""Weights of a trained system with what they were trained for; in a file plain tensors and numbers, nothing else."""

from __future__ import annotations

import hashlib
import json
import math
import re
import stat
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from PolyPoseLib.baselines.trained.network_grid import NetworkGrid
from PolyPoseLib.baselines.trained.view_directions import matched_views, require_sources, sources_of
from PolyPoseLib.errors import InputError, memory_ran_out
from PolyPoseLib.geometry.camera import Camera

FORMAT = "polypose trained system"
VERSION = 2

MAX_BYTES = 4 << 30
"""Larger files are not read; LiftReg's components alone take 1.4 GiB at 160 nodes and 56 components."""

EXTENT_TOLERANCE = 0.15
"""Share by which a CT may be longer or shorter than those of the training: the grid is stretched over its box."""

SIDES = tuple(range(16, 257, 16))
"""Nodes along an axis that both networks can halve four times."""

_DIGEST = re.compile("[0-9a-f]{64}")


@dataclass(frozen=True, eq=False)
class TrainedWeights:
    """A network's weights; valid when made by a training or by :func:`read_weights`.

    Attributes
    ----------
    system : str
        "liftreg" or "2d3d-regnet".
    side : int
        Nodes of the network's grid along every axis.
    directions : (V, 3) array
        Axes of the cameras, LPS.
    extent_mm : (2, 3) array
        Shortest and longest CT of the training along left, posterior, superior.
    sources_mm : (2, V, 3) array
        Least and largest coordinates of each view's source in training, LPS from the CT's middle.
    state : dict[str, Tensor]
        Of the network.
    report : dict
        JSON-able: steps, pairs, mean error in mm of the held-out pairs, and of doing nothing to them.
    cts : tuple[str, ...], optional
        Digests of the CTs that it was trained on, by which a benchmark knows them again; None of files that were
        written before there were any.

    """

    system: str
    side: int
    directions: np.ndarray
    extent_mm: np.ndarray
    sources_mm: np.ndarray
    state: dict[str, Tensor]
    report: dict[str, Any] = field(default_factory=dict)
    cts: tuple[str, ...] | None = None

    def require(self, grid: NetworkGrid, cameras: Sequence[Camera]) -> list[int]:
        """Which X-ray stands for each that the network was trained for.

        Raises InputError when the study's CT or X-rays are not of the kind that the weights were trained for.
        """
        (low, high), extent = self.extent_mm, grid.extent_mm
        low, high = low * (1 - EXTENT_TOLERANCE), high * (1 + EXTENT_TOLERANCE)
        for axis, name in enumerate(("left to right", "front to back", "bottom to top")):
            if not low[axis] <= extent[axis] <= high[axis]:
                raise InputError(
                    f"they were trained for CTs of {low[axis]:.0f} to {high[axis]:.0f} mm from {name}, "
                    f"but the study's CT has {extent[axis]:.0f} mm"
                )
        order = matched_views(self.directions, cameras)
        require_sources(self.sources_mm, sources_of([cameras[number] for number in order], grid.middle))
        return order

    def to_fields(self) -> dict[str, Any]:
        """Plain values and tensors, for torch.save, with a digest that detects damage."""
        fields = {
            "format": FORMAT,
            "version": VERSION,
            "settings": {
                "system": self.system,
                "side": self.side,
                "directions": np.asarray(self.directions, dtype=np.float64).tolist(),
                "extent_mm": np.asarray(self.extent_mm, dtype=np.float64).tolist(),
                "sources_mm": np.asarray(self.sources_mm, dtype=np.float64).tolist(),
                "report": self.report,
                "cts": None if self.cts is None else list(self.cts),
            },
            "state": {name: value.detach().cpu().contiguous() for name, value in self.state.items()},
        }
        return {**fields, "digest": _digest(fields)}

    @classmethod
    def from_fields(cls, fields: Any) -> TrainedWeights:
        """From what :meth:`to_fields` gave; raises InputError for anything else."""
        if not isinstance(fields, dict) or fields.get("format") != FORMAT or "settings" not in fields:
            raise InputError("it holds no weights of a trained system")
        if fields.get("version") != VERSION:
            raise InputError(f"it is of another version than {VERSION}, which this program reads")
        try:
            settings, state = fields["settings"], fields["state"]
            if fields["digest"] != _digest(fields):
                raise InputError("it was damaged or changed after it was written")
            weights = cls(
                str(settings["system"]),
                int(settings["side"]),
                np.array(settings["directions"], dtype=np.float64),
                np.array(settings["extent_mm"], dtype=np.float64),
                np.array(settings["sources_mm"], dtype=np.float64),
                dict(state),
                dict(settings["report"]),
                None if settings.get("cts") is None else tuple(settings["cts"]),
            )
        except (KeyError, TypeError, ValueError, AttributeError, OverflowError, RuntimeError) as error:
            if isinstance(error, InputError):
                raise
            raise InputError("it is damaged") from error
        weights._check()
        return weights

    def _check(self) -> None:
        """Refuse settings that no training writes; raises InputError."""
        unit = self.directions.ndim == 2 and self.directions.shape[1:] == (3,) and len(self.directions) > 0
        unit = unit and bool(np.allclose(np.linalg.norm(self.directions, axis=1), 1, atol=1e-6))
        extent = self.extent_mm.shape == (2, 3) and bool((self.extent_mm > 0).all())
        sources = self.sources_mm.shape == (2, *self.directions.shape) and bool(
            (self.sources_mm[0] <= self.sources_mm[1]).all()
        )
        finite = all(bool(torch.isfinite(value).all()) for value in self.state.values())
        cts = all(isinstance(each, str) and _DIGEST.fullmatch(each) for each in self.cts or ())
        if self.side not in SIDES or not unit or not extent or not sources or not finite or not cts:
            raise InputError("its settings or weights are not those of a training")


def read_weights(path: Path, system: str, train: str) -> TrainedWeights:
    """Weights from a file; nothing in it is executed.

    Parameters
    ----------
    path : Path
        The file.
    system : str
        Whose weights are wanted.
    train : str
        The command that makes such a file, for the sentences.

    Raises
    ------
    InputError
        Absent, another kind of file, damaged, too large, or another system's.

    """
    path = Path(path)
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            raise InputError(f"{path}: this is no file: give the weights that {train} wrote.")
        if _size(path, status.st_size) > MAX_BYTES:
            raise InputError(
                f"{path}: it holds more than {MAX_BYTES >> 30} GiB, too much for weights: {_made(train)}."
            )
        with path.open("rb") as file:
            fields = torch.load(file, map_location="cpu", weights_only=True)
    except FileNotFoundError as error:
        raise InputError(f"{path}: there is no such file; check the name, or {_made(train)}.") from error
    except InputError:
        raise
    except OSError as error:
        raise InputError(f"{path}: the file cannot be read ({error.strerror}); check it.") from error
    except MemoryError as error:
        raise memory_ran_out(str(path)) from error
    except Exception as error:  # torch raises many kinds for files that are damaged or hostile
        raise InputError(f"{path}: these are no weights, or damaged ones: {_made(train)}.") from error
    try:
        weights = TrainedWeights.from_fields(fields)
    except InputError as error:
        raise InputError(f"{path}: these are no weights of {system}: {error}; {_made(train)}.") from error
    if weights.system != system:
        raise InputError(f"{path}: these are weights of {weights.system}, not of {system}: {_made(train)}.")
    return weights


def _made(train: str) -> str:
    """What to do."""
    return f"train them with {train}"


def _size(path: Path, bytes_in_file: int) -> int:
    """What a file holds once its archive, if it is one, is unpacked; raises when it is none."""
    with zipfile.ZipFile(path) as archive:
        return max(bytes_in_file, sum(entry.file_size for entry in archive.infolist()))


def _digest(fields: dict[str, Any]) -> str:
    """SHA256 over settings and tensors: it detects damage, not malice."""
    digest = hashlib.sha256(json.dumps(fields["settings"], sort_keys=True).encode())
    for name, value in sorted(fields["state"].items()):
        digest.update(f"{name} {value.dtype} {tuple(value.shape)}".encode())
        digest.update(value.contiguous().numpy().tobytes())
    return digest.hexdigest()


def jsonable(value: float) -> float | None:
    """A number as JSON has it: None where it is not finite."""
    return float(value) if math.isfinite(value) else None
