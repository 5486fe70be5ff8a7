"""The text of a study file: JSON with the fields that a study may have, and nothing else."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from PolyPoseLib.errors import InputError, unknown_name
from PolyPoseLib.io.files import refuse_special_file

VERSION = 1

MAX_BYTES = 16 << 20
"""Larger study files are refused: one of a thousand X-rays has less than a megabyte."""

MAX_DEPTH = 50
"""Objects and lists that are nested deeper are refused: what is read may be written again, which recursion limits."""

REQUIRED = ("version", "ct", "segmentation", "structures", "anchor", "xrays")

OPTIONAL = ("options", "ct_series", "label_table", "comment")

MORE_XRAY_FIELDS = ("comment",)
"""Fields of an X-ray besides those by which it is read (imaging.xray_fields.FIELDS)."""


def parse(text: str, name: str) -> dict[str, Any]:
    """The JSON object in a text; raises InputError with line and column, and for fields given twice, numbers that are
    not finite or too long, and objects that are nested too deeply.
    """
    try:
        parsed = json.loads(
            text,
            object_pairs_hook=_unique_fields,
            parse_constant=_refuse_constant,
            parse_float=_finite_float,
            parse_int=_short_integer,
        )
        _check_depth(parsed)
    except json.JSONDecodeError as error:
        raise InputError(
            f"{name}: not valid JSON at line {error.lineno}, column {error.colno} ({error.msg}): correct it "
            "there."
        ) from error
    except (InputError, RecursionError) as error:
        reason = (
            str(error) if isinstance(error, InputError) else "its objects are nested too deeply: flatten it."
        )
        raise InputError(f"{name}: {reason}") from error
    if not isinstance(parsed, dict):
        raise InputError(f"{name}: the file must hold one JSON object {{...}}, not {_kind(parsed)}.")
    return parsed


def read(path: Path) -> dict[str, Any]:
    """Read and check a study file; raises InputError naming the file, the field and the mend."""
    if path.is_dir():
        raise InputError(f"{path}: this is a folder; give the study's JSON file in it.")
    refuse_special_file(path)
    try:
        size = path.stat().st_size
        if size > MAX_BYTES:
            raise InputError(
                f"{path}: {size >> 20} MiB is too large for a study; give the JSON file, not an image."
            )
        text = path.read_bytes().decode("utf-8-sig")
    except FileNotFoundError as error:
        raise InputError(f"{path}: there is no such file; check the name and the folder.") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: the file is not UTF-8 text; give the study's JSON file.") from error
    except OSError as error:
        raise InputError(
            f"{path}: the file cannot be read ({error.strerror}); check its permissions."
        ) from error
    fields = parse(text, str(path))
    check(fields, str(path))
    return fields


def check(fields: Mapping[str, Any], name: str) -> None:
    """Check names and types of all fields, without opening any other file; raises InputError."""
    try:
        _check_version(fields)
        known = (*REQUIRED, *OPTIONAL)
        for field in fields:
            if field not in known:
                raise InputError(unknown_name("field", field, known))
        for field in REQUIRED:
            if field not in fields:
                raise InputError(f'the field "{field}" is missing: add it.')
        _check_text(fields["ct"], "ct")
        _check_text(fields["segmentation"], "segmentation")
        check_structures(fields["structures"])
        check_anchor(fields["anchor"], fields["structures"])
        _check_xrays(fields["xrays"])
        _check_optional(fields)
    except InputError as error:
        raise InputError(f"{name}: {error}") from error


def _check_version(fields: Mapping[str, Any]) -> None:
    """Refuse versions other than ours before any field of theirs puzzles the reader."""
    version = fields.get("version", VERSION)
    if isinstance(version, bool) or version != VERSION:
        raise InputError(
            f'"version" is {json.dumps(version)}, but this program reads version {VERSION}: '
            + (
                "update PolyPose."
                if isinstance(version, int) and version > VERSION
                else f"set it to {VERSION}."
            )
        )


def check_structures(structures: Any) -> None:
    """{name: [labels]}, each label a positive whole number or a segment's name."""
    if not isinstance(structures, dict):
        raise InputError(f'"structures" must be an object {{"name": [labels]}}, not {_kind(structures)}.')
    if not structures:
        raise InputError('"structures" is empty: name at least the anchor with its labels.')
    for structure, labels in structures.items():
        where = f'"structures"."{structure}"'
        if not structure.strip():
            raise InputError('"structures" holds a name that is empty: give it one.')
        if not isinstance(labels, list):
            raise InputError(f"{where} must be a list of labels such as [25, 26], not {_kind(labels)}.")
        if not labels:
            raise InputError(f"{where} is empty: list at least one label, or remove the structure.")
        for label in labels:
            number = isinstance(label, int) and not isinstance(label, bool) and label > 0
            if not number and not (isinstance(label, str) and label.strip()):
                raise InputError(
                    f"{where} holds {json.dumps(label)}: a label is a whole number above 0 or the name of a segment."
                )


def check_anchor(anchor: Any, structures: Mapping[str, Any]) -> None:
    """The anchor is one of the structures."""
    _check_text(anchor, "anchor")
    if anchor not in structures:
        raise InputError('"anchor": ' + unknown_name("structure", anchor, structures))


def _check_xrays(xrays: Any) -> None:
    """A list of at least one object with an image."""
    if not isinstance(xrays, list):
        raise InputError(f'"xrays" must be a list of objects, not {_kind(xrays)}.')
    if not xrays:
        raise InputError('"xrays" is empty: at least one X-ray is needed, two or more to find depth.')
    from PolyPoseLib.io.xray.fields import FIELDS, XrayFields

    seen: dict[tuple[str, Any], int] = {}
    for number, xray in enumerate(xrays):
        where = f'"xrays"[{number}]'
        if not isinstance(xray, dict):
            raise InputError(f'{where} must be an object such as {{"image": "ap.dcm"}}, not {_kind(xray)}.')
        known = (*FIELDS, *MORE_XRAY_FIELDS)
        for field in xray:
            if field not in known:
                raise InputError(f"{where}: {unknown_name('field', field, known)}")
        if "image" not in xray:
            raise InputError(f'{where}: the field "image" is missing: name the X-ray\'s file.')
        _check_text(xray["image"], f'xrays"[{number}]."image')
        XrayFields.parse(xray, where)
        key = (xray["image"], str(xray.get("frame")))
        if key in seen:
            raise InputError(f'{where} is the same image as "xrays"[{seen[key]}]: remove one of them.')
        seen[key] = number


def _check_optional(fields: Mapping[str, Any]) -> None:
    """The fields that may be absent."""
    from PolyPoseLib.data.label_names import TABLES
    from PolyPoseLib.data.options import Options

    Options.from_dict(fields.get("options"))
    table = fields.get("label_table")
    if table is not None and table not in TABLES:
        raise InputError('"label_table": ' + unknown_name("label table", str(table), TABLES))
    series = fields.get("ct_series")
    if series is not None and (isinstance(series, bool) or not isinstance(series, (str, int))):
        raise InputError(f'"ct_series" is {_kind(series)}: give a series instance UID or a series number.')


def _check_text(value: Any, field: str) -> None:
    """A text that is not empty."""
    if not isinstance(value, str) or not value.strip():
        raise InputError(f'"{field}" must be a text that is not empty, not {_kind(value)}.')


def _unique_fields(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """A JSON object whose fields are all different."""
    fields: dict[str, Any] = {}
    for name, value in pairs:
        if name in fields:
            raise InputError(f'the field "{name}" is given twice: keep one of them.')
        fields[name] = value
    return fields


def _refuse_constant(constant: str) -> None:
    """NaN and Infinity are no JSON."""
    raise InputError(f"it holds {constant}, which is no number: give a finite number.")


def _finite_float(digits: str) -> float:
    """A number with a point or an exponent; one that is too large for a float is refused."""
    value = float(digits)
    if not math.isfinite(value):
        raise InputError(f"it holds {digits[:40]}, which is too large: give a finite number.")
    return value


def _short_integer(digits: str) -> int:
    """A whole number; one that no float can hold is refused, before it reaches anything that computes."""
    if not math.isfinite(float(digits)):
        raise InputError(f"it holds a whole number of {len(digits)} digits: give a shorter one.")
    return int(digits)


def _check_depth(parsed: Any) -> None:
    """Refuse objects and lists within each other beyond MAX_DEPTH."""
    level = [parsed]
    for _ in range(MAX_DEPTH):
        level = [
            inner
            for each in level
            if isinstance(each, (dict, list))
            for inner in (each.values() if isinstance(each, dict) else each)
        ]
    if any(isinstance(each, (dict, list)) for each in level):
        raise RecursionError


def _kind(value: Any) -> str:
    """What a JSON value is, for people."""
    if value is None:
        return "null"
    names = {bool: "true or false", int: "a number", float: "a number", str: "a text", list: "a list"}
    return names.get(type(value), "an object") if value != "" else "an empty text"
