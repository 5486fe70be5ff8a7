"""Flags by which a track is continued from a frame that was corrected by hand."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PolyPoseLib.data.tracking.correction import DIRECTIONS
from PolyPoseLib.errors import InputError

if TYPE_CHECKING:
    from PolyPoseLib.data.tracking.correction import Correction

_ONLY_WITH = {"at": "--at", "poses": "--poses", "direction": "--direction", "until": "--until"}
"""Flags that mean nothing without --continue."""

_NOT_WITH = {"first": "--first", "last": "--last", "start": "--start"}
"""Flags that say where a track begins, which the earlier track does."""


def add_continuation(parser: argparse.ArgumentParser) -> None:
    """Add the flags of a continued track."""
    group = parser.add_argument_group("tracking on from a frame that was corrected by hand")
    group.add_argument(
        "--continue",
        dest="earlier",
        type=Path,
        metavar="TRACK",
        help="folder of an earlier track of this sequence, whose other frames are kept",
    )
    group.add_argument("--at", type=int, metavar="N", help="number of the corrected frame")
    group.add_argument(
        "--poses",
        type=Path,
        metavar="FILE",
        help="JSON file of corrected poses in that frame, from the rig's world to the CT in LPS mm (without it: those "
        "of the earlier track)",
    )
    group.add_argument(
        "--direction",
        choices=DIRECTIONS,
        help="which way time goes from the corrected frame (default: both)",
    )
    group.add_argument(
        "--until", type=int, metavar="M", help="last frame that is tracked anew (default: the track's end)"
    )


def correction_of(arguments: argparse.Namespace) -> Correction | None:
    """The correction that the flags ask for, None without --continue; raises InputError where they do not fit."""
    if arguments.earlier is None:
        lone = [flag for name, flag in _ONLY_WITH.items() if getattr(arguments, name) is not None]
        if lone:
            raise InputError(f"{lone[0]} needs --continue: name the folder of the track that is corrected.")
        return None
    odd = [flag for name, flag in _NOT_WITH.items() if getattr(arguments, name) is not None]
    if odd:
        raise InputError(f"{odd[0]} and --continue exclude each other: a track goes on with its own frames.")
    if arguments.at is None:
        raise InputError("--continue needs --at: give the number of the corrected frame.")
    from PolyPoseLib.data.tracking.correction import Correction
    from PolyPoseLib.io.tracking.corrected_poses import read_corrected_poses
    from PolyPoseLib.io.tracking.tracks import load_track

    track = load_track(arguments.earlier)
    poses = {} if arguments.poses is None else read_corrected_poses(arguments.poses, track.names)
    try:
        return Correction(track, arguments.at, poses, arguments.direction or "both", arguments.until)
    except InputError as error:
        raise InputError(f"{arguments.earlier}: {error}") from error


def options_of_earlier(earlier: Correction | None) -> dict[str, Any]:
    """The range of frames with which the earlier track was made: the images' scale is decided on it."""
    if earlier is None:
        return {}
    inputs, frames = earlier.track.inputs, earlier.track.frames
    if inputs is not None:
        return {"first": inputs.first, "last": inputs.last}
    return {"first": frames[0].frame, "last": frames[-1].frame}
