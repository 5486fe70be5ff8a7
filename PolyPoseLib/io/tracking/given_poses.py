"""Poses of every frame from a table, such as a track's poses.csv, to simulate that motion."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.rigid import MAX_TRANSLATION_MM
from PolyPoseLib.io.files import read_text
from PolyPoseLib.simulation.sequence_options import MOST_FRAMES

PLACE = tuple(f"centroid_{axis}_mm" for axis in "xyz")
TURN = tuple(f"quaternion_{part}" for part in "xyzw")

COLUMNS = ("frame", "structure", *PLACE, *TURN)
"""What is read of the table: the structure's centroid in the rig's world, and how it is turned from the CT to there."""

MAX_BYTES = 1 << 30


def read_poses(path: Path, names: Sequence[str], centroids: np.ndarray) -> np.ndarray:
    """Poses (F, K, 4, 4), the rig's world to the CT's LPS mm, of all frames from 0 on.

    Parameters
    ----------
    path : Path
        CSV with the columns COLUMNS; others are left alone.
    names : sequence of str
        Of the K structures; rows of others are left out.
    centroids : (K, 3) array
        Of the structures in the CT, LPS mm.

    Raises
    ------
    InputError
        A column, a frame or a structure is missing, or a number is none; the sentence names the line.

    """
    rows = csv.DictReader(io.StringIO(read_text(path, "a table of poses", MAX_BYTES)))
    lacking = [name for name in COLUMNS if name not in (rows.fieldnames or ())]
    if lacking:
        raise InputError(
            f'{path}: the table lacks the column "{lacking[0]}": give a poses.csv that track wrote.'
        )
    found: dict[tuple[int, int], np.ndarray] = {}
    for row in rows:
        if row["structure"] not in names:
            continue
        where = f"{path}, line {rows.line_num}"
        bone = list(names).index(row["structure"])
        frame = _frame(row["frame"], where)
        if (frame, bone) in found:
            raise InputError(f'{where}: frame {frame} of "{names[bone]}" is there already: keep one of them.')
        found[frame, bone] = _pose(row, centroids[bone], where)
    if not found:
        raise InputError(
            f"{path}: the table has no row of {', '.join(names)}: give a table of this CT's structures."
        )
    count = max(frame for frame, _ in found) + 1
    for frame in range(count):
        for bone, name in enumerate(names):
            if (frame, bone) not in found:
                raise InputError(f'{path}: there is no row of frame {frame} and "{name}": add it.')
    return np.array([[found[frame, bone] for bone in range(len(names))] for frame in range(count)])


def _frame(text: str, where: str) -> int:
    """The number of a frame; raises InputError."""
    if not (text.isascii() and text.isdigit() and len(text) < 10 and int(text) < MOST_FRAMES):
        raise InputError(
            f'{where}: the frame is "{text[:20]}": give a whole number from 0 to {MOST_FRAMES - 1}.'
        )
    return int(text)


def _pose(row: dict[str, str], centroid: np.ndarray, where: str) -> np.ndarray:
    """A pose (4, 4), the rig's world to the CT's; raises InputError."""
    try:
        numbers = np.array([float(row[name]) for name in (*PLACE, *TURN)])
    except (TypeError, ValueError):
        raise InputError(
            f"{where}: a centroid or quaternion is missing or no number: complete the row."
        ) from None
    length = np.linalg.norm(numbers[3:])
    if (
        not np.isfinite(numbers).all()
        or np.abs(numbers[:3]).max() > MAX_TRANSLATION_MM
        or abs(length - 1) > 1e-3
    ):
        raise InputError(
            f"{where}: the centroid is far off or the quaternion is not of length 1: correct the row."
        )
    turn = Rotation.from_quat(numbers[3:]).as_matrix()
    pose = np.eye(4)
    pose[:3, :3] = turn.T
    pose[:3, 3] = centroid - turn.T @ numbers[:3]
    return pose
