"""The overlay video: the bones' outlines on the X-rays, frame by frame, as an MP4 file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PolyPoseLib.data.tracking.sequence import Sequence
from PolyPoseLib.data.tracking.track import Track
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.tracking.film_writer import ENDING, FilmWriter
from PolyPoseLib.io.tracking.overlay_frames import OverlayFrames
from PolyPoseLib.io.whole_files import FileClaim, replaced_whole

FASTEST = 30.0
"""Frames per second at which a video is played at most: faster sequences are seen in slow motion."""


def write_overlay_video(
    track: Track,
    sequence: Sequence,
    file: Path | FileClaim,
    progress: Callable[[int, int], None] | None = None,
) -> None:
    """Draw every frame of a track, and write the video whole or not at all.

    One frame is read, drawn and encoded at a time, so that memory does not grow with the sequence.

    Parameters
    ----------
    track : Track
        Poses.
    sequence : Sequence
        What was tracked.
    file : Path or FileClaim
        Ends with ``.mp4``; its folder exists.
    progress : callable, optional
        Called with the number of frames that are done, and of all; an error that it raises ends the video.

    Raises
    ------
    InputError
        Another ending, no frame, PyAV or matplotlib missing, or an X-ray that cannot be read.

    """
    path = file.path if isinstance(file, FileClaim) else file
    if path.suffix.lower() != ENDING:
        raise InputError(f"{path}: the video is written as {ENDING}: let its name end so.")
    if not track.frames:
        raise InputError(f"{path}: the track holds no frame, so that there is nothing to show.")
    frames = OverlayFrames(track, sequence)
    rate = min(track.frames_per_second, FASTEST)
    with replaced_whole(file) as temporary, FilmWriter(temporary, frames.height, frames.width, rate) as film:
        for number, frame in enumerate(track.frames, start=1):
            film.add(frames.picture(frame))
            if progress is not None:
                progress(number, len(track.frames))
