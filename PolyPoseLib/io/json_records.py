"""The one JSON codec: strict reading of a text, typed access to its fields, and plain values for writing.

A *parser* takes a value and its place in the file (``"cameras"[0]."K"``, for the sentences) and gives back the checked
value, or raises InputError. ``require_rigid`` and ``require_intrinsics`` are parsers, too:

    record = Record(parse_object(text, name), f"{name}: ")
    pose = record.required("extrinsic", require_rigid)
    frame = record.optional("frame", whole_number(0))
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from PolyPoseLib.errors import InputError, shown, unknown_name
from PolyPoseLib.geometry.rigid import is_real_number, real_array

T = TypeVar("T")
Parser = Callable[[Any, str], T]

LONGEST_TEXT = 10_000
"""Characters of a text; longer ones are refused: they are no name, path or sentence."""

MAX_DEPTH = 50
"""Objects and lists that are nested deeper are refused: what is read may be written again, which recursion limits."""


def parse_json(text: str, name: str, allow_nan: bool = False) -> Any:
    """The JSON value in a text.

    Parameters
    ----------
    text : str
        UTF-8, What the file holds.
    name : str
        Opening of the sentences of errors, a file's path as a rule.
    allow_nan : bool
        Whether NaN and Infinity, which JSON does not know, are read as numbers.

    Raises
    ------
    InputError
        No JSON (with line and column), fields given twice, numbers that are not finite or too long, and objects that
        are nested too deeply.

    """
    try:
        value = json.loads(
            text,
            object_pairs_hook=_unique_fields,
            parse_float=_finite_float,
            parse_int=_short_integer,
            parse_constant=float if allow_nan else _refuse_constant,
        )
        _check_depth(value)
    except json.JSONDecodeError as error:
        raise InputError(
            f"{name}: not valid JSON at line {error.lineno}, column {error.colno} ({error.msg}): correct it there."
        ) from error
    except RecursionError as error:
        raise InputError(f"{name}: its objects are nested too deeply: flatten it.") from error
    except InputError as error:
        raise InputError(f"{name}: {error}") from error
    return value


def parse_object(text: str, name: str, allow_nan: bool = False) -> dict[str, Any]:
    """The JSON object in a text; as parse_json, and any other value raises InputError."""
    value = parse_json(text, name, allow_nan)
    if not isinstance(value, dict):
        raise InputError(f"{name}: the file must hold one JSON object {{...}}, not {kind_of(value)}.")
    return value


def plain(value: Any) -> Any:
    """The same value as JSON can hold it: arrays become lists, paths texts, numbers that are not finite null."""
    if isinstance(value, Mapping):
        return {str(name): plain(each) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [plain(each) for each in value]
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, Path):
        return str(value)
    return None if isinstance(value, float) and not math.isfinite(value) else value


def json_text(value: Any) -> str:
    """What a file holds of a value: its plain form, indented, with a line's end."""
    return json.dumps(plain(value), indent=1, allow_nan=False) + "\n"


class Record:
    """The fields of one JSON object, each read by a parser.

    Parameters
    ----------
    fields : dict
        The object; any other value raises InputError.
    opening : str
        What stands before a field's name in sentences: ``"ap.dcm: "``, or ``'"structures"."femur".'``.

    """

    def __init__(self, fields: Any, opening: str = "") -> None:
        if not isinstance(fields, Mapping):
            raise _wrong(fields, opening.rstrip(".: ") or "the value", "an object {...}")
        self.fields: Mapping[str, Any] = fields
        self.opening = opening

    @classmethod
    def within(cls, value: Any, place: str) -> Record:
        """Parse an object into a record whose fields are named after its place."""
        return cls(value, f"{place}.")

    def place(self, key: str) -> str:
        """How sentences name a field."""
        return self.opening + quoted(key)

    def require_known(self, names: Collection[str]) -> None:
        """Raise InputError for a field that is none of the names."""
        for field in self.fields:
            if field not in names:
                opening = f"{self.opening[:-1]}: " if self.opening.endswith(".") else self.opening
                raise InputError(opening + unknown_name("field", str(field), names))

    def required(self, key: str, parser: Parser[T]) -> T:
        """A field's value; raises InputError where it is missing or wrong."""
        if key not in self.fields:
            raise InputError(f'{self.opening}the field "{key}" is missing: add it.')
        return parser(self.fields[key], self.place(key))

    def optional(self, key: str, parser: Parser[T]) -> T | None:
        """A field's value, or None where it is absent or null; raises InputError where it is wrong."""
        value = self.fields.get(key)
        return None if value is None else parser(value, self.place(key))


def string(value: Any, place: str) -> str:
    """Parse a text."""
    if not isinstance(value, str):
        raise _wrong(value, place, "a text")
    return _short(value, place)


def nonempty(value: Any, place: str) -> str:
    """Parse a text that holds more than blanks."""
    if not isinstance(value, str) or not value.strip():
        raise _wrong(value, place, "a text that is not empty")
    return _short(value, place)


def file_path(value: Any, place: str) -> str | Path:
    """Parse a path: a text of a file, or a Path of a caller."""
    if not isinstance(value, str | Path) or not str(value).strip():
        raise _wrong(value, place, "the path of a file")
    return value if isinstance(value, Path) else _short(value, place)


def boolean(value: Any, place: str) -> bool:
    """Parse true or false."""
    if not isinstance(value, bool):
        raise _wrong(value, place, "true or false")
    return value


def real(value: Any, place: str) -> float:
    """Parse a finite number."""
    if not is_real_number(value):
        raise _wrong(value, place, "a finite number")
    return float(value)


def real_or_nan(value: Any, place: str) -> float:
    """Parse a finite number, or null, by which ``plain`` writes all others, as NaN."""
    return math.nan if value is None else real(value, place)


def number_in(bounds: tuple[float, float], unit: str) -> Parser[float]:
    """Parser of a number within bounds, ends included; the unit is for the sentence."""

    def parse(value: Any, place: str) -> float:
        if not is_real_number(value) or not bounds[0] <= value <= bounds[1]:
            raise _wrong(value, place, f"a number from {bounds[0]:g} to {bounds[1]:g} ({unit})")
        return float(value)

    return parse


def whole_number(least: int, meaning: str = "") -> Parser[int]:
    """Parser of a whole number that is at least ``least``."""

    def parse(value: Any, place: str) -> int:
        if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
            raise _wrong(value, place, f"a whole number, {meaning or f'{least} or more'}")
        return int(value)

    return parse


def one_of(choices: Collection[str]) -> Parser[str]:
    """Parser of a text that is one of the choices."""

    def parse(value: Any, place: str) -> str:
        if not isinstance(value, str) or value not in choices:
            raise _wrong(value, place, "one of " + ", ".join(f'"{choice}"' for choice in choices))
        return value

    return parse


def numbers(count: int, meaning: str, largest: float = math.inf) -> Parser[tuple[float, ...]]:
    """Parser of a list of ``count`` finite numbers, none farther from 0 than ``largest``."""
    span = f" from {-largest:g} to {largest:g}" if math.isfinite(largest) else ""

    def parse(value: Any, place: str) -> tuple[float, ...]:
        items = list(value) if isinstance(value, list | tuple | np.ndarray) else []
        if len(items) != count or not all(is_real_number(item) and abs(item) <= largest for item in items):
            raise _wrong(value, place, f"{count} finite numbers{span}: {meaning}")
        return tuple(float(item) for item in items)

    return parse


def array(*shape: int, finite: bool = True) -> Parser[np.ndarray]:
    """Parser of a float64 array of a shape, -1 for any length; null counts as NaN unless it must be finite."""
    size = " x ".join("N" if side < 0 else str(side) for side in shape)
    what = f"{size}{' finite' if finite else ''} numbers" if shape else "one number"

    def parse(value: Any, place: str) -> np.ndarray:
        try:
            read = real_array(value if finite else _null_as_nan(value))
        except (TypeError, ValueError):
            raise _wrong(value, place, what) from None
        fits = read.ndim == len(shape) and all(
            side in (-1, got) for side, got in zip(shape, read.shape, strict=True)
        )
        if not fits or (finite and not np.isfinite(read).all()):
            raise _wrong(value, place, what)
        return read

    return parse


def list_of(parser: Parser[T]) -> Parser[list[T]]:
    """Parser of a list of any length, each member read by a parser."""

    def parse(value: Any, place: str) -> list[T]:
        if not isinstance(value, list | tuple):
            raise _wrong(value, place, "a list")
        return [parser(each, f"{place}[{number}]") for number, each in enumerate(value)]

    return parse


def object_of(parser: Parser[T]) -> Parser[dict[str, T]]:
    """Parser of an object whose fields have names of any kind, each value read by a parser."""

    def parse(value: Any, place: str) -> dict[str, T]:
        if not isinstance(value, Mapping):
            raise _wrong(value, place, "an object {...}")
        return {str(name): parser(each, f"{place}.{quoted(name)}") for name, each in value.items()}

    return parse


def anything(value: Any, _place: str) -> Any:
    """Parse nothing: the value as it is."""
    return value


def quoted(name: str) -> str:
    """A field's name in a sentence, as JSON writes it, cut where it is long."""
    text = json.dumps(str(name), ensure_ascii=False)
    return text if len(text) <= 60 else text[:57] + '..."'


def kind_of(value: Any) -> str:
    """What a JSON value is, for people."""
    if value is None:
        return "null"
    names = {bool: "true or false", int: "a number", float: "a number", str: "a text", list: "a list"}
    return names.get(type(value), "an object") if value != "" else "an empty text"


def _short(text: str, place: str) -> str:
    """A text that is not too long; raises InputError for others."""
    if len(text) > LONGEST_TEXT:
        raise InputError(
            f"{place} is {_written(text)} and has {len(text)} characters: give at most {LONGEST_TEXT}."
        )
    return text


def _wrong(value: Any, place: str, rule: str) -> InputError:
    """The sentence about a value that breaks its rule."""
    return InputError(f"{place} is {_written(value)}; give {rule}.")


def _written(value: Any) -> str:
    """A value as its file has it, cut where it is long."""
    try:
        text = json.dumps(value[:100] if isinstance(value, str | list | tuple) else value, ensure_ascii=False)
    except (TypeError, ValueError, RecursionError):
        return " ".join(shown(value).split())
    return text if len(text) <= 60 else text[:57] + "..."


def _null_as_nan(value: Any) -> Any:
    if isinstance(value, list | tuple):
        return [_null_as_nan(each) for each in value]
    return math.nan if value is None else value


def _unique_fields(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """A JSON object whose fields are all different."""
    fields: dict[str, Any] = {}
    for name, value in pairs:
        if name in fields:
            raise InputError(f"the field {quoted(name)} is given twice: keep one of them.")
        fields[name] = value
    return fields


def _refuse_constant(constant: str) -> float:
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


def _check_depth(value: Any) -> None:
    """Refuse objects and lists within each other beyond MAX_DEPTH."""
    level = [value]
    for _ in range(MAX_DEPTH):
        level = [
            inner
            for each in level
            if isinstance(each, dict | list)
            for inner in (each.values() if isinstance(each, dict) else each)
        ]
    if any(isinstance(each, dict | list) for each in level):
        raise RecursionError
