"""The ways to the first camera of an X-ray, and what each writes into a study."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from typing import Any

from slicer.i18n import tr as _


class CameraSource(enum.Enum):
    """Where an X-ray's first camera comes from; the registration refines it in any case."""

    AUTO = "auto"
    CARM = "carm"
    DICOM = "dicom"
    LANDMARKS = "landmarks"
    SEARCH = "search"
    LEARNED = "learned"
    CALIBRATION = "calibration"

    @classmethod
    def of(cls, text: str | None) -> CameraSource:
        """From what a scene has stored; anything unknown is AUTO."""
        return next((way for way in cls if way.value == text), cls.AUTO)

    def label(self) -> str:
        """What people read."""
        return {
            "auto": _("whatever is at hand"),
            "carm": _("the C-arm placed by hand"),
            "dicom": _("the angles in DICOM"),
            "landmarks": _("landmarks"),
            "search": _("search"),
            "learned": _("a model trained on this CT"),
            "calibration": _("a calibrated camera"),
        }[self.value]

    @property
    def by_transform(self) -> bool:
        """Whether the registration starts from the camera's transform node."""
        return self in (CameraSource.AUTO, CameraSource.CARM)


_POSES = ("extrinsic", "camera", "landmarks", "standard_view")
"""Fields of a study that name another way than the one that is chosen."""


def entry_of_source(
    way: CameraSource,
    fields: Mapping[str, Any],
    extrinsic: list[list[float]] | None,
    landmarks: list[dict[str, Any]],
) -> dict[str, Any]:
    """The fields of an X-ray's entry in a study, so that the registration goes this way.

    fields: what was typed. extrinsic: (4, 4) of the camera's transform, when the registration starts from it.
    landmarks: picked pairs, see PolyPoseLib.data.landmarks; empty when there are none.
    """
    entry = dict(fields)
    if extrinsic is not None:
        return entry | {"extrinsic": extrinsic} | ({} if way.by_transform else {"camera": "initial"})
    if way.by_transform:
        return entry
    kept = {
        CameraSource.SEARCH: ("standard_view",),
        CameraSource.LEARNED: ("standard_view",),
        CameraSource.CALIBRATION: ("camera",) if fields.get("camera") == "known" else (),
    }.get(way, ())
    for field in _POSES:
        if field not in kept:
            entry.pop(field, None)
    entry.pop("calibration_frame", None)
    if way is CameraSource.LANDMARKS and landmarks:
        entry["landmarks"] = landmarks
    elif way in (CameraSource.SEARCH, CameraSource.LEARNED):
        entry["camera"] = "absent"
    elif way is CameraSource.CALIBRATION and entry.get("calibration"):
        entry.pop("intrinsics", None)
        entry["calibration_frame"] = "ct"
    return entry
