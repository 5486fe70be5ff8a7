"""One tracked frame as a JSON object and back, number for number; what is not known is null."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from PolyPoseLib.data.tracking.track import SOURCES, TrackedFrame
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.rigid import require_rigid
from PolyPoseLib.io.json_records import (
    Parser,
    Record,
    array,
    list_of,
    one_of,
    plain,
    real,
    string,
    whole_number,
)


def frame_fields(frame: TrackedFrame) -> dict[str, Any]:
    """What a file holds of a frame: plain numbers, lists and texts."""
    return plain(
        {
            "frame": frame.frame,
            "poses": frame.poses,
            "covariances": frame.covariances,
            "residuals": frame.residuals,
            "doubts": frame.doubts,
            "sources": frame.sources,
            "cpu_seconds": frame.cpu_seconds,
        }
    )


def frame_of(structures: int) -> Parser[TrackedFrame]:
    """A parser of a frame of so many structures; a structure that was lost may have no pose."""

    def parse(value: Any, place: str) -> TrackedFrame:
        record = Record.within(value, place)
        doubts = record.required("doubts", list_of(list_of(string)))
        sources = record.required("sources", list_of(one_of(SOURCES)))
        frame = TrackedFrame(
            frame=record.required("frame", whole_number(0)),
            poses=record.required("poses", array(structures, 4, 4, finite=False)),
            covariances=record.required("covariances", array(structures, 6, 6, finite=False)),
            residuals=record.required("residuals", array(structures, finite=False)),
            doubts=tuple(map(tuple, doubts)),
            sources=tuple(sources),
            cpu_seconds=record.required("cpu_seconds", real),
        )
        require_sound(frame, structures, lambda k: f'{place}."poses"[{k}]')
        return frame

    return parse


def require_sound(frame: TrackedFrame, structures: int, place: Callable[[int], str]) -> None:
    """Refuse a frame whose parts do not fit together, or with a pose that is none; raises InputError.

    place: how a sentence names the pose of the kth structure.
    """
    shapes = {
        "poses": (structures, 4, 4), "covariances": (structures, 6, 6), "residuals": (structures,),
    }  # fmt: skip
    for name, shape in shapes.items():
        if np.shape(getattr(frame, name)) != shape:
            raise InputError(
                f"Frame {frame.frame} has {name} of shape {np.shape(getattr(frame, name))}, not {shape}: give "
                f"{structures} structures in every frame."
            )
    if len(frame.doubts) != structures or len(frame.sources) != structures:
        raise InputError(
            f"Frame {frame.frame} needs doubts and a source for each of {structures} structures."
        )
    for k, (pose, source) in enumerate(zip(frame.poses, frame.sources, strict=True)):
        if source == "none" and np.isnan(pose).all():
            continue
        require_rigid(pose, place(k))
