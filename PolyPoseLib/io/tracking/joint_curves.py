"""Reads what a track's folder says of its joints, from joints.json."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from PolyPoseLib.data.tracking.joint_curves import Curve, JointCurves
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.files import read_text
from PolyPoseLib.io.json_records import (
    Record,
    array,
    boolean,
    list_of,
    nonempty,
    parse_object,
    string,
    whole_number,
)
from PolyPoseLib.io.tracking.joint_tables import RECORD, VERSION

MAX_BYTES = 1 << 30
"""Larger files are refused: ten thousand frames of ten joints have a tenth."""


def load_joint_curves(folder: str | Path) -> tuple[JointCurves, ...]:
    """The angles and translations of all joints of a track.

    Parameters
    ----------
    folder : path
        Of the track.

    Returns
    -------
    tuple of JointCurves
        None where the folder has no joints.json, as that of a single structure.

    Raises
    ------
    InputError
        The file is damaged; the sentence names it and what is wrong.

    """
    path = Path(folder) / RECORD
    if not path.exists():
        return ()
    fields = parse_object(read_text(path, "the joints of a track", MAX_BYTES), str(path))
    try:
        return _curves_of(fields)
    except InputError as error:
        raise InputError(f"{path}: the file is damaged, track again: {error}") from error


def _curves_of(fields: dict[str, Any]) -> tuple[JointCurves, ...]:
    record = Record(fields)
    if fields.get("version") != VERSION:
        raise InputError(f'"version" is not {VERSION}.')
    frames = np.array(record.required("frame", list_of(whole_number(0))), dtype=np.int64)
    seconds = record.required("time_s", array(len(frames)))
    if not len(frames) or (np.diff(frames) <= 0).any():
        raise InputError('"frame" must hold numbers in the order of time, each once.')
    return tuple(record.required("joints", list_of(partial(_joint, frames=frames, seconds=seconds))))


def _joint(value: Any, place: str, frames: np.ndarray, seconds: np.ndarray) -> JointCurves:
    record = Record.within(value, place)
    doubtful = record.required("doubtful", list_of(boolean))
    if len(doubtful) != len(frames):
        raise InputError(f"{record.place('doubtful')} has {len(doubtful)} values for {len(frames)} frames.")
    return JointCurves(
        name=record.required("name", nonempty),
        frames=frames,
        seconds=seconds,
        angles=tuple(record.required("angles", list_of(partial(_curve, unit="deg", count=len(frames))))),
        translations=tuple(
            record.required("translations", list_of(partial(_curve, unit="mm", count=len(frames))))
        ),
        doubtful=np.array(doubtful),
    )


def _curve(value: Any, place: str, unit: str, count: int) -> Curve:
    record = Record.within(value, place)
    return Curve(
        name=record.required("name", nonempty),
        positive=record.required("positive", string),
        values=record.required(unit, array(count, finite=False)),
        half_widths_95=record.required(f"half_width_95_{unit}", array(count, finite=False)),
    )
