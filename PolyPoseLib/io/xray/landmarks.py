"""The field "landmarks" of an X-ray's entry."""

from __future__ import annotations

from typing import Any

import numpy as np

from PolyPoseLib.data.landmarks import Landmarks
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.json_records import list_of, numbers, quoted

FARTHEST = 1e6
"""Millimetres or pixels beyond which a point must be in a wrong unit."""

FORM = '{"point": [x, y, z], "pixel": [column, row]}'
"""One landmark; it may have a "name" besides."""

_POINT = numbers(3, "[x, y, z] in LPS mm", FARTHEST)
_PIXEL = numbers(2, "[column, row]", FARTHEST)


def parse_landmarks(value: Any, place: str) -> Landmarks | None:
    """Parse a list of landmarks; None and an empty list count as absent.

    Whether a camera follows from them is decided later (:func:`PolyPoseLib.geometry.pnp.camera_from_landmarks`).

    Parameters
    ----------
    value
        A list of objects of the form `FORM`.
    place
        The field's place, for the sentences of errors.

    Raises
    ------
    InputError
        The value has another form.

    """
    if value is None or value == []:
        return None
    if not isinstance(value, list):
        raise InputError(f"{place} must be a list of objects {FORM}.")
    pairs = list_of(_landmark)(value, place)
    return Landmarks(np.array([point for point, _ in pairs]), np.array([pixel for _, pixel in pairs]))


def _landmark(value: Any, place: str) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Parse one landmark: (point, pixel)."""
    if not isinstance(value, dict):
        raise InputError(f"{place} must be an object {FORM}.")
    for field in value:
        if field not in ("point", "pixel", "name"):
            raise InputError(f"{place} has the unknown field {quoted(field)}; give {FORM}.")
    return _POINT(value.get("point"), f'{place}."point"'), _PIXEL(value.get("pixel"), f'{place}."pixel"')
