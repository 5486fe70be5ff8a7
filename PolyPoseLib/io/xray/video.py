"""One frame of a fluoroscopic run that was saved as a film: AVI, MP4 or MOV, decoded in a child process.

Decoders are large and films hostile now and then: the child has limits of memory and time, and hands over nothing but
the pixels of one frame.
"""

from __future__ import annotations

import importlib.util
import tempfile
from pathlib import Path

import numpy as np

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.dicom import MAX_PIXELS
from PolyPoseLib.io.files import refuse_special_file
from PolyPoseLib.io.guarded import Limits, run_child

VIDEO_ENDINGS = (".avi", ".mp4", ".mov")
"""File names that are read as films."""

VIDEO_LIMITS = Limits(cpu_seconds=60, wall_seconds=180, memory_bytes=4 << 30)
"""Of decoding up to the frame asked for: some thousands of frames of a usual film."""

MAX_FRAME = 100_000
"""Frames beyond this are not looked for."""

GRAY_TOLERANCE = 24
"""Grey levels by which the colours of a gray film may differ: its compression keeps them coarsely."""

_CHILD = """
source, target, wanted, most = sys.argv[1], sys.argv[2], *map(int, sys.argv[3:])
import av
import numpy as np
def end(status, text):
    sys.stdout.write(text)
    sys.stdout.flush()
    sys.exit(status)
try:
    film = av.open(source, options={"protocol_whitelist": "file"})
    if not film.streams.video:
        end(3, "0")
    stream = film.streams.video[0]
    stream.thread_count = 1
    if stream.width * stream.height > most:
        end(4, f"{stream.width} x {stream.height}")
    count = 0
    for frame in film.decode(stream):
        if count == wanted:
            if frame.width * frame.height > most:
                end(4, f"{frame.width} x {frame.height}")
            deep = frame.format.name.startswith("gray") and frame.format.components[0].bits > 8
            np.save(target, frame.to_ndarray(format="gray16le" if deep else "rgb24"), allow_pickle=False)
            end(0, "")
        count += 1
        if wanted < 0 and count > 1:
            break
    end(3, str(stream.frames or count) if wanted < 0 else str(count))
except Exception as error:
    end(2, type(error).__name__)
"""


def read_video_frame(path: Path, where: str, frame: int | None) -> np.ndarray:
    """One frame of a film.

    Parameters
    ----------
    path
        The film.
    where
        Opening of the sentences of errors.
    frame
        Counted from 0.

    Returns
    -------
    np.ndarray
        (H, W) uint8, or uint16 where the film has more than 8 bits of gray.

    Raises
    ------
    InputError
        PyAV is absent, no frame or none of this number, damaged, in colour, too large, or takes too long.

    """
    refuse_special_file(path, where)
    if importlib.util.find_spec("av") is None:
        raise InputError(f"{where} is a film, which PyAV reads: pip install av, or save the frame as PNG.")
    if frame is not None and frame > MAX_FRAME:
        raise InputError(f'{where}: "frame" {frame} is beyond {MAX_FRAME}; save the frame as PNG.')
    pixels, text = _decoded(path, where, -1 if frame is None else frame)
    if pixels is None and frame is None:
        raise InputError(
            f'{where} is a film of {text} frames; add "frame", counted from 0, to choose one of them.'
        )
    if pixels is None:
        raise InputError(
            f'{where} is a film of {text} frames, so "frame" {frame} does not exist; give a number below {text}.'
        )
    if pixels.ndim == 2:
        return pixels
    if np.percentile(np.ptp(pixels.astype(np.int16), axis=-1), 99) > GRAY_TOLERANCE:
        raise InputError(f"{where} is a colour film; save the X-ray itself, in gray.")
    return pixels[..., 1]


def _decoded(path: Path, where: str, frame: int) -> tuple[np.ndarray | None, str]:
    """The pixels of a frame, or None and the number of frames."""
    limits = VIDEO_LIMITS
    with tempfile.TemporaryDirectory(prefix="polypose-") as folder:
        target = Path(folder) / "frame.npy"
        done = run_child(_CHILD, [path.resolve(), target, frame, MAX_PIXELS], limits, folder)
        if done is None:
            raise InputError(
                f"{where}: the frame was not reached after {limits.cpu_seconds} seconds of decoding; save it as PNG."
            )
        text = "".join(each for each in done.stdout.decode("ascii", "replace") if each in "0123456789 x")[:40]
        if done.returncode == 0 and target.is_file():
            return np.load(target, allow_pickle=False), ""
        if done.returncode == 3:
            return None, text
        if done.returncode == 4:
            raise InputError(f"{where} claims {text} pixels, more than an X-ray has; export the film again.")
    raise InputError(f"{where} is damaged or no film that can be decoded; save the frame as PNG or DICOM.")
