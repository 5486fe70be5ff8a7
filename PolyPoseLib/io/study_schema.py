"""The text of a study file: JSON with the fields that a study may have, and nothing else."""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from PolyPoseLib.data.label_names import TABLES
from PolyPoseLib.data.options import Options
from PolyPoseLib.data.structures import MAX_STRUCTURES
from PolyPoseLib.errors import InputError, cut, unknown_name
from PolyPoseLib.geometry.rigid import require_rigid
from PolyPoseLib.io.files import read_text
from PolyPoseLib.io.json_records import Parser, Record, anything, kind_of, nonempty, parse_object, quoted
from PolyPoseLib.io.xray.fields import FIELDS, XrayFields

VERSION = 1

MAX_BYTES = 16 << 20
"""Larger study files are refused: one of a thousand X-rays has less than a megabyte."""

MAX_XRAYS = 10_000
"""More X-rays are refused."""

MAX_LABELS = 65_536
"""A structure with more labels is refused."""

LONGEST_NAME = 200
"""Characters of a structure's name."""

REQUIRED = ("ct", "segmentation", "structures", "anchor", "xrays")

OPTIONAL = ("version", "options", "ct_series", "label_table", "initial_poses", "comment")

MORE_XRAY_FIELDS = ("comment",)
"""Fields of an X-ray besides those by which it is read (io.xray.fields.FIELDS)."""


def read(path: Path) -> dict[str, Any]:
    """The fields of a study file, checked.

    Raises
    ------
    InputError
        The file cannot be read, is no JSON object, or a field is unknown, missing or of the wrong form; the sentence
        names the file, the field and the fix.

    """
    fields = parse_object(read_text(path, "the study's JSON file", MAX_BYTES), str(path))
    check(fields, str(path))
    return fields


def check(fields: Mapping[str, Any], name: str) -> None:
    """Check names and types of all fields, without opening any other file; raises InputError."""
    try:
        record = Record(fields)
        check_version(record)
        record.require_known((*REQUIRED, *OPTIONAL))
        for field in REQUIRED:
            record.required(field, anything)
        record.required("ct", nonempty)
        record.required("segmentation", nonempty)
        check_grouping(record)
        _check_xrays(fields["xrays"])
        _check_optional(fields)
        record.optional("initial_poses", initial_poses(fields["structures"]))
    except InputError as error:
        raise InputError(f"{name}: {error}") from error


def check_grouping(record: Record) -> None:
    """Check "structures" and "anchor", which is one of them; raises InputError."""
    record.required("structures", check_structures)
    record.required("anchor", structure_name(record.fields["structures"]))


def structure_name(structures: Collection[str]) -> Parser[str]:
    """A parser of the name of a known structure."""

    def parse(name: Any, place: str) -> str:
        if nonempty(name, place) not in structures:
            raise InputError(f"{place}: " + unknown_name("structure", name, structures))
        return name

    return parse


def check_version(record: Record) -> None:
    """Refuse versions other than ours before any field of theirs puzzles the reader."""
    version = record.fields.get("version", VERSION)
    if isinstance(version, bool) or version != VERSION:
        newer = isinstance(version, int) and version > VERSION
        raise InputError(
            f'"version" is {cut(json.dumps(version), 60)}, but this program reads version {VERSION}: '
            + ("update PolyPose." if newer else f"set it to {VERSION}.")
        )


def check_structures(structures: Any, place: str) -> None:
    """{name: [labels]}, each label a positive whole number or a segment's name."""
    if not isinstance(structures, Mapping):
        raise InputError(f'{place} must be an object {{"name": [labels]}}, not {kind_of(structures)}.')
    if not structures:
        raise InputError(f"{place} is empty: name at least the anchor with its labels.")
    if len(structures) > MAX_STRUCTURES:
        raise InputError(f"{place} holds {len(structures)} names: give at most {MAX_STRUCTURES}.")
    for structure, labels in structures.items():
        where = f"{place}.{quoted(structure)}"
        if not structure.strip():
            raise InputError(f"{place} holds a name that is empty: give it one.")
        if len(structure) > LONGEST_NAME:
            raise InputError(
                f"{where} has a name of {len(structure)} characters: give at most {LONGEST_NAME}."
            )
        if not isinstance(labels, list):
            raise InputError(f"{where} must be a list of labels such as [25, 26], not {kind_of(labels)}.")
        if not labels:
            raise InputError(f"{where} is empty: list at least one label, or remove the structure.")
        if len(labels) > MAX_LABELS:
            raise InputError(f"{where} lists {len(labels)} labels: give at most {MAX_LABELS}.")
        for label in labels:
            number = isinstance(label, int) and not isinstance(label, bool) and label > 0
            if not number and not (isinstance(label, str) and label.strip()):
                raise InputError(
                    f"{where} holds {json.dumps(label)[:60]}: a label is a whole number above 0 or the name of a "
                    "segment."
                )


def initial_poses(structures: Mapping[str, Any]) -> Parser[dict[str, np.ndarray]]:
    """A parser of {structure: pose (4, 4)} of known structures."""

    def parse(poses: Any, place: str) -> dict[str, np.ndarray]:
        if not isinstance(poses, Mapping):
            raise InputError(f'{place} must be an object {{"name": 4x4 matrix}}, not {kind_of(poses)}.')
        for name in poses:
            if name not in structures:
                raise InputError(f"{place}: " + unknown_name("structure", str(name), structures))
        return {name: require_rigid(pose, f"{place}.{quoted(name)}") for name, pose in poses.items()}

    return parse


def _check_xrays(xrays: Any) -> None:
    """A list of at least one object with an image."""
    if not isinstance(xrays, list):
        raise InputError(f'"xrays" must be a list of objects, not {kind_of(xrays)}.')
    if not xrays:
        raise InputError('"xrays" is empty: at least one X-ray is needed, two or more to find depth.')
    if len(xrays) > MAX_XRAYS:
        raise InputError(f'"xrays" holds {len(xrays)} entries: give at most {MAX_XRAYS}.')
    seen: dict[tuple[str, str], int] = {}
    for number, xray in enumerate(xrays):
        where = f'"xrays"[{number}]'
        if not isinstance(xray, dict):
            raise InputError(f'{where} must be an object such as {{"image": "ap.dcm"}}, not {kind_of(xray)}.')
        record = Record(xray, f"{where}: ")
        record.require_known((*FIELDS, *MORE_XRAY_FIELDS))
        if "image" not in xray:
            raise InputError(f'{where}: the field "image" is missing: name the X-ray\'s file.')
        image = record.required("image", nonempty)
        XrayFields.parse(xray, where)
        key = (image, str(xray.get("frame")))
        if key in seen:
            raise InputError(f'{where} is the same image as "xrays"[{seen[key]}]: remove one of them.')
        seen[key] = number


def _check_optional(fields: Mapping[str, Any]) -> None:
    """The fields that may be absent."""
    Options.from_dict(fields.get("options"))
    check_ct_fields(fields)


def check_ct_fields(fields: Mapping[str, Any]) -> None:
    """Check "label_table" and "ct_series", which may be absent; raises InputError."""
    table = fields.get("label_table")
    if table is not None and table not in TABLES:
        raise InputError('"label_table": ' + unknown_name("label table", str(table), TABLES))
    series = fields.get("ct_series")
    if series is not None and (isinstance(series, bool) or not isinstance(series, str | int)):
        raise InputError(f'"ct_series" is {kind_of(series)}: give a series instance UID or a series number.')
