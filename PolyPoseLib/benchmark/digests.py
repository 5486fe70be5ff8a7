"""Digests of cases and of runs, by which a finished row is known again."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from PolyPoseLib import __version__
from PolyPoseLib.data.benchmark.case import BenchmarkCase
from PolyPoseLib.data.benchmark.job import RunSettings

_BLOCK_BYTES = 1 << 22

_PLAIN = (str, bool, int, float, np.generic, Path)


def digest_of(value: Any) -> str:
    """SHA256 (64 hexadecimal digits) of dataclasses, arrays, mappings, sequences and plain values within each other.

    Two values have one digest only when all their parts have the same types and contents. Fields that a class computes
    for itself are left out. Raises TypeError for anything else: what cannot be compared must not pass for unchanged.
    """
    found = hashlib.sha256()
    _feed(found, value)
    return found.hexdigest()


def _feed(found: Any, value: Any) -> None:
    kind = type(value).__name__
    if isinstance(value, np.ndarray) and not value.dtype.hasobject:
        found.update(f"{kind} {value.dtype.str} {value.shape}\n".encode())
        found.update(np.ascontiguousarray(value).reshape(-1).view(np.uint8).data)
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        found.update(f"{kind}\n".encode())
        for field in dataclasses.fields(value):
            if field.init:
                _feed(found, field.name)
                _feed(found, getattr(value, field.name))
    elif isinstance(value, Mapping):
        found.update(f"mapping {len(value)}\n".encode())
        for key in sorted(value, key=repr):
            _feed(found, key)
            _feed(found, value[key])
    elif isinstance(value, list | tuple):
        found.update(f"sequence {len(value)}\n".encode())
        for each in value:
            _feed(found, each)
    elif value is None or isinstance(value, _PLAIN):
        text = str(value) if isinstance(value, Path) else repr(value)
        found.update(f"{kind} {len(text)} {text}\n".encode("utf-8", "surrogateescape"))
    else:
        raise TypeError(f"No digest is known for a {kind}.")


def file_digest(path: Path) -> str:
    """SHA256 of a file's content; raises OSError where the system refuses."""
    found = hashlib.sha256()
    with path.open("rb") as stream:
        while block := stream.read(_BLOCK_BYTES):
            found.update(block)
    return found.hexdigest()


def content_digest(files: Iterable[Path], root: Path) -> str:
    """SHA256 of the names below a root and the contents of some files; raises OSError where the system refuses."""
    names = {os.path.relpath(path, root): path for path in files}
    return digest_of({name: file_digest(path) for name, path in names.items()})


def case_digest(case: BenchmarkCase, content: str) -> str:
    """SHA256 of what a case is made of; content: of its files.

    Nothing that was computed is in it: the last bit of that is another one on another processor or by another version
    of a library, where the case is still the same. What rendered its X-rays is, since projectors differ by more.
    """
    return digest_of([case.dataset, case.name, case.views, case.projector, content])


def system_digest(code: str) -> str:
    """SHA256 of what a system is; code: as of ``run_digest``."""
    return hashlib.sha256(code.encode()).hexdigest()


def run_digest(case: str, code: str, settings: RunSettings, weights: str) -> str:
    """SHA256 of all that a row depends on.

    Parameters
    ----------
    case : str
        Digest of the case.
    code : str
        Path of the system's class, with versions of its packages, or of a user's own the digest of its file.
    settings : RunSettings
        How it runs.
    weights : str
        Digest of its file of weights; empty without.

    """
    parts = [__version__, case, code, dataclasses.asdict(settings), weights]
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()
