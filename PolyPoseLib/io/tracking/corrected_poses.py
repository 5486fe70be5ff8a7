"""Poses of structures in one frame as a hand placed them: a JSON file, from which a track is continued."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from PolyPoseLib.errors import InputError, unknown_name
from PolyPoseLib.geometry.rigid import require_rigid
from PolyPoseLib.io.files import read_text
from PolyPoseLib.io.json_records import Record, json_text, object_of, parse_object, whole_number

VERSION = 1

FIELDS = ("version", "poses", "comment")

MAX_BYTES = 1 << 24
"""A thousand structures have a fiftieth."""


def read_corrected_poses(path: str | Path, names: Sequence[str]) -> dict[str, np.ndarray]:
    """Read {structure: pose (4, 4)}, the rig's world to the CT's LPS mm.

    Parameters
    ----------
    path : path
        ``{"version": 1, "poses": {"tibia": 4x4 matrix, ...}}``.
    names : sequence of str
        Of the structures that there are.

    Raises
    ------
    InputError
        No such file, an unknown structure, no pose at all, or one that is not rigid; the sentence names it.

    """
    path = Path(path)
    return poses_of(
        parse_object(read_text(path, "a file of corrected poses", MAX_BYTES), str(path)), names, str(path)
    )


def poses_of(fields: Mapping[str, Any], names: Sequence[str], path: str) -> dict[str, np.ndarray]:
    """The poses that the fields of such a file hold; raises InputError, whose sentences begin with the path."""
    record = Record(fields, f"{path}: ")
    record.require_known(FIELDS)
    version = record.optional("version", whole_number(1))
    if version not in (None, VERSION):
        raise InputError(f"{path}: version {version} is not {VERSION}: write the file anew.")
    poses = record.required("poses", object_of(require_rigid))
    if not poses:
        raise InputError(f'{path}: "poses" is empty: give the pose of at least one structure.')
    for name in poses:
        if name not in names:
            raise InputError(f'{path}: "poses": ' + unknown_name("structure", name, names))
    return poses


def write_corrected_poses(path: str | Path, poses: Mapping[str, np.ndarray]) -> None:
    """Write {structure: pose (4, 4)}, the rig's world to the CT's LPS mm; raises OSError as the system does."""
    Path(path).write_text(json_text({"version": VERSION, "poses": dict(poses)}), encoding="utf-8")
