"""Landmarks of one X-ray: points in the CT with the pixels that show them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.rigid import is_real_number

FARTHEST = 1e6
"""Millimetres or pixels beyond which a point is taken for a wrong unit."""

FORM = '{"point": [x, y, z], "pixel": [column, row]}'


@dataclass(frozen=True, eq=False)
class Landmarks:
    """points: (N, 3) LPS mm; pixels: (N, 2) [column, row] with centres at whole numbers."""

    points: np.ndarray
    pixels: np.ndarray

    def mirrored(self, width: int) -> Landmarks:
        """The same for the image with its ``width`` columns in reverse order."""
        return Landmarks(self.points, self.pixels * [-1, 1] + [width - 1, 0])


def parse_landmarks(value: Any, where: str) -> Landmarks | None:
    """The field "landmarks" of an X-ray's entry, a list of FORM; None and an empty list count as absent.

    Raises InputError when it has another form.  Whether a camera follows from them is decided later
    (:func:`PolyPoseLib.geometry.pnp.camera_from_landmarks`).
    """
    if value is None or value == []:
        return None
    if not isinstance(value, list):
        raise InputError(f'{where}: "landmarks" must be a list of objects {FORM}.')
    points, pixels = [], []
    for number, each in enumerate(value):
        place = f'{where}: "landmarks"[{number}]'
        if not isinstance(each, Mapping):
            raise InputError(f"{place} must be an object {FORM}.")
        for field in each:
            if field not in ("point", "pixel", "name"):
                raise InputError(f'{place} has the unknown field "{field}"; give {FORM}.')
        points.append(_numbers(each.get("point"), 3, f'{place}."point"', "[x, y, z] in LPS mm"))
        pixels.append(_numbers(each.get("pixel"), 2, f'{place}."pixel"', "[column, row]"))
    return Landmarks(np.array(points), np.array(pixels))


def _numbers(value: Any, count: int, where: str, meaning: str) -> list[float]:
    """A list of numbers up to FARTHEST."""
    numbers = value if isinstance(value, (list, tuple)) else ()
    if len(numbers) != count or not all(map(is_real_number, numbers)):
        raise InputError(f"{where} must be {count} finite numbers, {meaning}.")
    if max(map(abs, numbers)) > FARTHEST:
        raise InputError(f"{where} must be {count} numbers from {-FARTHEST:g} to {FARTHEST:g}, {meaning}.")
    return [float(n) for n in numbers]
