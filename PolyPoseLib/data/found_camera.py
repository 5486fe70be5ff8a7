"""A camera that was found for an X-ray and how sure it is, as registration, reports and the panel hold it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.rigid import is_real_number, require_rigid

if TYPE_CHECKING:
    from PolyPoseLib.data.xray import Xray

REPORT_VERSION = 1


@dataclass(frozen=True, eq=False)
class FoundCamera:
    """A camera before refinement.

    Parameters
    ----------
    extrinsic : (4, 4) array
        World LPS mm to camera, for the view from the source.
    sure : bool
        Whether it may be used without a person having looked at it.
    within : (float, float)
        Degrees and mm within which the true camera is expected.
    how : str
        One line for people.
    warnings : sequence of str
        What is uncertain, one line each.
    similarity, runner_up : float or None
        Local correlation of the best view and of the next one that is clearly another; None without a search.
    mirrored : bool
        Whether the file shows the detector's side.
    taken : bool
        Whether a person, or the program, took it into the study.

    """

    extrinsic: np.ndarray
    sure: bool
    within: tuple[float, float]
    how: str
    warnings: tuple[str, ...] = ()
    similarity: float | None = None
    runner_up: float | None = None
    mirrored: bool = False
    taken: bool = False

    def __post_init__(self) -> None:
        """Keep a read-only extrinsic; raises InputError when it is not rigid."""
        extrinsic = require_rigid(self.extrinsic)
        extrinsic.flags.writeable = False
        object.__setattr__(self, "extrinsic", extrinsic)
        object.__setattr__(self, "warnings", tuple(self.warnings))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, FoundCamera) and self.to_dict() == other.to_dict()

    def camera_of(self, xray: Xray) -> Camera:
        """The X-ray's camera at this place."""
        return Camera(xray.intrinsics, self.extrinsic, *xray.image.shape)

    def to_dict(self) -> dict[str, Any]:
        """The fields as JSON holds them, in reports and in scenes."""
        return {
            "extrinsic": self.extrinsic.tolist(),
            "mirrored": self.mirrored,
            "sure": self.sure,
            "within": list(self.within),
            "how": self.how,
            "warnings": list(self.warnings),
            "similarity": self.similarity,
            "runner_up": self.runner_up,
            "taken": self.taken,
        }

    @classmethod
    def from_dict(cls, fields: Any) -> FoundCamera:
        """From what ``to_dict`` gave, further fields are ignored; raises InputError when it is damaged."""
        try:
            degrees, millimetres = (_number(each) for each in fields["within"])
            return cls(
                extrinsic=require_rigid(fields["extrinsic"]),
                sure=bool(fields["sure"]),
                within=(degrees, millimetres),
                how=str(fields["how"]),
                warnings=tuple(str(line) for line in fields.get("warnings") or ()),
                similarity=_number_or_none(fields.get("similarity")),
                runner_up=_number_or_none(fields.get("runner_up")),
                mirrored=bool(fields.get("mirrored")),
                taken=bool(fields.get("taken")),
            )
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise InputError("What was found of an X-ray's camera is damaged: find it again.") from error


def camera_report(names: Sequence[str], found: Mapping[int, FoundCamera]) -> dict[str, Any]:
    """What was found, for other programs: one entry an X-ray that was looked for.

    Parameters
    ----------
    names : sequence of str
        Of the study's X-rays.
    found : {int: FoundCamera}
        By the number of the X-ray in the study.

    Returns
    -------
    dict
        "version" and "cameras", a list of FoundCamera.to_dict() with "number" and "name" of the X-ray.

    """
    entries = [{"number": n, "name": names[n], **each.to_dict()} for n, each in found.items()]
    return {"version": REPORT_VERSION, "cameras": entries}


def cameras_in_report(fields: Any) -> dict[int, FoundCamera]:
    """The cameras of a report by the number of their X-ray; raises InputError when it is damaged."""
    try:
        return {int(entry["number"]): FoundCamera.from_dict(entry) for entry in fields["cameras"]}
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise InputError("The report of the cameras found is damaged: find them again.") from error


def _number(value: Any) -> float:
    """A finite number; raises ValueError."""
    if not is_real_number(value):
        raise ValueError("not a number")
    return float(value)


def _number_or_none(value: Any) -> float | None:
    return None if value is None else _number(value)
