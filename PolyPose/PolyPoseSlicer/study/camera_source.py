"""Where the initial camera of an X-ray comes from, and what each source writes into a study."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from typing import Any

from slicer.i18n import tr as _


class CameraSource(enum.Enum):
    """Where an X-ray's initial camera comes from; the registration refines it unless it is known exactly."""

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
        return next((source for source in cls if source.value == text), cls.AUTO)

    def label(self) -> str:
        """Its label for people."""
        return {
            "auto": _("automatic: the best available"),
            "carm": _("C-arm placed by hand"),
            "dicom": _("DICOM angles"),
            "landmarks": _("landmarks"),
            "search": _("search"),
            "learned": _("model trained on this CT"),
            "calibration": _("calibrated camera"),
        }[self.value]

    @property
    def by_transform(self) -> bool:
        """Whether the registration starts from the camera's transform node."""
        return self in (CameraSource.AUTO, CameraSource.CARM)


_POSES = ("extrinsic", "camera", "landmarks", "standard_view")
"""Fields of a study that would give a camera from another source than the chosen one."""


def entry_of_source(
    source: CameraSource,
    fields: Mapping[str, Any],
    extrinsic: list[list[float]] | None,
    landmarks: list[dict[str, Any]],
) -> dict[str, Any]:
    """The fields of an X-ray's entry in a study, so that the registration uses this camera source.

    fields: what was entered. extrinsic: (4, 4) of the camera's transform, when the registration starts from it.
    landmarks: picked pairs, see PolyPoseLib.data.landmarks; empty when there are none.
    """
    entry = dict(fields)
    if extrinsic is not None:
        return entry | {"extrinsic": extrinsic} | ({} if source.by_transform else {"camera": "initial"})
    if source.by_transform:
        return entry
    kept = {
        CameraSource.SEARCH: ("standard_view",),
        CameraSource.LEARNED: ("standard_view",),
        CameraSource.CALIBRATION: ("camera",) if fields.get("camera") == "known" else (),
    }.get(source, ())
    for field in _POSES:
        if field not in kept:
            entry.pop(field, None)
    entry.pop("calibration_frame", None)
    if source is CameraSource.LANDMARKS and landmarks:
        entry["landmarks"] = landmarks
    elif source in (CameraSource.SEARCH, CameraSource.LEARNED):
        entry["camera"] = "absent"
    elif source is CameraSource.CALIBRATION and entry.get("calibration"):
        entry.pop("intrinsics", None)
        entry["calibration_frame"] = "ct"
    return entry
