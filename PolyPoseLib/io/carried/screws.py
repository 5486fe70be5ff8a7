"""Plans of screws: entry and target of each, JSON in LPS millimetres.

{"version": 1, "screws": [{"name": "L4 left", "entry": [x, y, z], "target": [x, y, z], "diameter_mm": 6.5}]}
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from PolyPoseLib.data.carried import CarriedPoints
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.carried.table import FARTHEST_MM
from PolyPoseLib.io.files import read_text
from PolyPoseLib.io.json_records import Record, json_text, list_of, nonempty, number_in, numbers, parse_object

VERSION = 1

_ENDS = ("entry", "target")


@dataclass(frozen=True)
class ScrewPlan:
    """Screws of a plan.

    Attributes
    ----------
    names : tuple of str
        Of the N screws.
    entries, targets : (N, 3) array
        LPS mm.
    fields : tuple of dict
        Of every screw, as the file has them.

    """

    names: tuple[str, ...]
    entries: np.ndarray
    targets: np.ndarray
    fields: tuple[dict[str, Any], ...]

    @property
    def points(self) -> np.ndarray:
        """(2 N, 3) entry and target of every screw in turn."""
        return np.stack([self.entries, self.targets], axis=1).reshape(-1, 3)

    @property
    def labels(self) -> tuple[str, ...]:
        """Of these points."""
        return tuple(f"{name} {end}" for name in self.names for end in _ENDS)


def read_screws(path: Path) -> ScrewPlan:
    """Read a plan of screws; raises InputError that names the field and the fix."""
    fields = parse_object(read_text(path, "a plan of screws"), str(path))
    record = Record(fields, f"{path}: ")
    if fields.get("version") != VERSION:
        raise InputError(f'{path}: "version" is {str(fields.get("version"))[:40]}; give {VERSION}.')
    names, ends = [], []
    place = numbers(3, "a place in LPS mm", FARTHEST_MM)
    screws = record.required("screws", list_of(Record.within))
    for each in screws:
        names.append(each.required("name", nonempty))
        ends.append([each.required(end, place) for end in _ENDS])
        each.optional("diameter_mm", number_in((0.1, 50.0), "mm"))
        if ends[-1][0] == ends[-1][1]:
            raise InputError(
                f'{path}: screw "{names[-1][:60]}" has its entry at its target: give two places.'
            )
    if not names:
        raise InputError(f'{path}: "screws" is empty: give at least one with name, entry and target.')
    array = np.array(ends)
    return ScrewPlan(tuple(names), array[:, 0], array[:, 1], tuple(dict(each.fields) for each in screws))


def write_screws(path: Path, plan: ScrewPlan, carried: CarriedPoints, warning: str = "") -> None:
    """Write the plan again with carried ends, their covariances, what moved them, and a warning."""
    screws = []
    for n, fields in enumerate(plan.fields):
        moved = {end: carried.points[2 * n + m] for m, end in enumerate(_ENDS)}
        known = {f"{end}_covariance_mm2": carried.covariances[2 * n + m] for m, end in enumerate(_ENDS)}
        by = {f"{end}_moved_by": carried.moved_by[2 * n + m] for m, end in enumerate(_ENDS)}
        screws.append({**fields, **moved, **known, **by})
    warned = {"warning": warning} if warning else {}
    path.write_text(json_text({"version": VERSION, **warned, "screws": screws}), encoding="utf-8")
