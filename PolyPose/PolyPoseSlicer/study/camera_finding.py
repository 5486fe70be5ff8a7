"""A camera that was found for an X-ray, and how sure it is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from PolyPoseLib.errors import InputError


@dataclass(frozen=True)
class CameraFinding:
    """What `python -m PolyPoseLib cameras` reports of one X-ray, and whether it was taken.

    extrinsic: rows of the (4, 4), world LPS mm to camera, for the view from the source; within: (degrees, mm).
    similarity, runner_up: of the best view and of the next one that is clearly another, None without a search.
    """

    how: str
    sure: bool
    extrinsic: tuple[tuple[float, ...], ...]
    mirrored: bool = False
    within: tuple[float, float] = (0.0, 0.0)
    warnings: tuple[str, ...] = ()
    similarity: float | None = None
    runner_up: float | None = None
    taken: bool = False

    @classmethod
    def of(cls, fields: Mapping[str, Any]) -> CameraFinding:
        """From a report's entry, or from what `stored` gave; raises InputError when it is damaged."""
        try:
            extrinsic = np.array(fields["extrinsic"], dtype=np.float64).reshape(4, 4)
            if not np.isfinite(extrinsic).all():
                raise ValueError
            numbers = {
                name: None if fields.get(name) is None else float(fields[name])
                for name in ("similarity", "runner_up")
            }
            degrees, millimetres = map(float, fields["within"])
            return cls(
                how=str(fields["how"]),
                sure=bool(fields["sure"]),
                extrinsic=tuple(tuple(row) for row in extrinsic.tolist()),
                mirrored=bool(fields.get("mirrored")),
                within=(degrees, millimetres),
                warnings=tuple(map(str, fields.get("warnings") or ())),
                taken=bool(fields.get("taken")),
                **numbers,
            )
        except (KeyError, TypeError, ValueError) as error:
            raise InputError("What was found of an X-ray's camera is damaged: find it again.") from error

    def stored(self) -> dict[str, Any]:
        """As JSON fields, for the scene."""
        return asdict(self)
