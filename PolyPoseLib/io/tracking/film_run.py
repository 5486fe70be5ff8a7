"""All frames of a film (AVI, MP4, MOV), decoded once by a child process into a temporary file.

Films are compressed against earlier frames, so that each frame costs the decoding of those before it; tracking reads
them forward and backward. Decoded once, one after the other, 2,000 frames cost what they last, and any frame is then
read from its place. The temporary file is unlinked while it is open, so that nothing is left behind, however the
process ends (Windows, which cannot do so, removes it with the object).
"""

from __future__ import annotations

import importlib.util
import os
import shutil
import tempfile
import weakref
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from PolyPoseLib.data.notes import Notes
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.dicom import MAX_PIXELS
from PolyPoseLib.io.files import refuse_special_file
from PolyPoseLib.io.guarded import Limits, run_child
from PolyPoseLib.io.tracking.image_run import image_of, require_index
from PolyPoseLib.io.xray.fields import XrayFields
from PolyPoseLib.io.xray.values import PixelValues, meant
from PolyPoseLib.io.xray.video import GRAY_TOLERANCE, MAX_FRAME

FILM_LIMITS = Limits(cpu_seconds=3600, wall_seconds=4 * 3600, memory_bytes=4 << 30)
"""Of decoding a whole film."""

MAX_FILM_BYTES = 64 << 30
"""Decoded frames that are kept."""

SPARE_BYTES = 512 << 20
"""Of the temporary folder, that are left free."""

CHECKED_EVERY = 97
"""Of so many frames one is looked at for colours."""

_CHILD = """
source, target, most_pixels, most_bytes, most_frames, tolerance, every = sys.argv[1:3] + [int(x) for x in sys.argv[3:]]
import av
import numpy as np
def end(status, *words):
    sys.stdout.write(" ".join(map(str, words)))
    sys.stdout.flush()
    sys.exit(status)
count, size, kind, written = 0, None, None, 0
def done(status):
    end(status, count, *(size or (0, 0)), kind or "none")
try:
    film = av.open(source, options={"protocol_whitelist": "file"})
    if not film.streams.video:
        done(3)
    stream = film.streams.video[0]
    stream.thread_count = 1
    if stream.width * stream.height > most_pixels:
        end(4, stream.width, stream.height)
except Exception as error:
    end(2, type(error).__name__)
frames = film.decode(stream)
with open(target, "wb") as kept:
    while True:
        try:
            frame = next(frames, None)
        except Exception:
            done(7 if count else 3)
        if frame is None:
            break
        shape = (frame.height, frame.width)
        if shape[0] * shape[1] > most_pixels:
            end(4, shape[1], shape[0])
        deep = frame.format.name.startswith("gray") and frame.format.components[0].bits > 8
        if size is None:
            size, kind = shape, "u2" if deep else "u1"
        if shape != size or deep != (kind == "u2"):
            end(6, count, *shape)
        pixels = frame.to_ndarray(format="gray16le" if deep else "rgb24")
        if not deep:
            if count % every == 0 and np.percentile(np.ptp(pixels.astype(np.int16), axis=-1), 99) > tolerance:
                end(5)
            pixels = pixels[..., 1]
        content = pixels.astype("<" + kind).tobytes()
        written += len(content)
        if written > most_bytes or count >= most_frames:
            end(8, count)
        kept.write(content)
        count += 1
done(3 if not count else 7 if count < stream.frames else 0)
"""
"""Statuses: 0 all frames, 2 no film, 3 no frame, 4 too large, 5 in colour, 6 another size, 7 cut short, 8 too long."""


@dataclass(frozen=True)
class _Decoded:
    """The temporary file of a film's frames, and what it holds."""

    descriptor: int
    count: int
    shape: tuple[int, int]
    kind: np.dtype


class FilmRun:
    """The frames of a film.

    Parameters
    ----------
    path
        The film.
    where
        Opening of the sentences of errors.

    Raises
    ------
    InputError
        PyAV is absent, no film or none that can be decoded, in colour, of changing size, or too long.

    """

    def __init__(self, path: Path, where: str) -> None:
        self.path, self.where = path, where
        refuse_special_file(path, where)
        if importlib.util.find_spec("av") is None:
            raise InputError(
                f"{where} is a film, which PyAV reads: pip install av, or save its frames as PNG."
            )
        folder = tempfile.TemporaryDirectory(prefix="polypose-", ignore_cleanup_errors=True)
        try:
            self._frames, self.warnings = _decode(path, where, Path(folder.name))
        except BaseException:
            folder.cleanup()
            raise
        if os.name == "posix":
            folder.cleanup()  # the open file stays readable
            self._finalizer = weakref.finalize(self, os.close, self._frames.descriptor)
        else:
            self._finalizer = weakref.finalize(self, _close_and_remove, self._frames.descriptor, folder)
        self.count = self._frames.count

    def tags(self) -> None:
        """Films have none of DICOM's attributes."""

    def decided(self, index: int, given: XrayFields, notes: Notes) -> PixelValues:
        """Values of one frame with meaning and mask, as of a single X-ray; raises InputError."""
        return meant(self.values(index, given), True, self.path, given, notes)

    def values(self, index: int, given: XrayFields) -> np.ndarray:
        """Values of one frame (H, W) float32; raises InputError."""
        require_index(index, self.count, self.where)
        frames = self._frames
        size = frames.shape[0] * frames.shape[1] * frames.kind.itemsize
        content = _read_at(frames.descriptor, size, index * size)
        if len(content) < size:
            raise InputError(
                f"{image_of(self.where, index)} is missing in the temporary folder; start again."
            )
        return np.frombuffer(content, frames.kind).reshape(frames.shape).astype(np.float32)


def _decode(path: Path, where: str, folder: Path) -> tuple[_Decoded, tuple[str, ...]]:
    """Decode a film into a file of a folder, and open that; raises InputError."""
    target = folder / "frames.raw"
    most_bytes = min(MAX_FILM_BYTES, max(shutil.disk_usage(folder).free - SPARE_BYTES, 0))
    limits = (MAX_PIXELS, most_bytes, MAX_FRAME, GRAY_TOLERANCE, CHECKED_EVERY)
    done = run_child(_CHILD, [path.resolve(), target, *limits], FILM_LIMITS, str(folder))
    if done is None:
        raise InputError(f"{where}: decoding the film takes too long; save its frames as PNG.")
    words = done.stdout.decode("ascii", "replace").split()[:4]
    status = done.returncode
    if status in (0, 7) and len(words) == 4 and target.is_file():
        count, height, width = map(int, words[:3])
        descriptor = os.open(target, os.O_RDONLY | getattr(os, "O_BINARY", 0))
        warnings = ()
        if status == 7:
            warnings = (
                f"The film is cut short: it can be decoded up to image {count - 1} (counted from 0) alone.",
            )
        return _Decoded(descriptor, count, (height, width), np.dtype("<" + words[3])), warnings
    shown = " x ".join(each for each in words if each.isdigit())
    raise InputError(where + _faults(shown).get(status, _faults(shown)[2]))


def _faults(shown: str) -> dict[int, str]:
    """What the child's statuses say to people, after the film's name."""
    return {
        2: " is damaged or no film that can be decoded; save its frames as PNG or DICOM.",
        3: " holds no frame that can be decoded; save its frames as PNG or DICOM.",
        4: f" claims {shown} pixels, more than an X-ray has; export the film again.",
        5: " is a colour film; save the X-rays themselves, in gray.",
        6: " changes the size or depth of its frames on the way; export the film again, all frames of one size.",
        8: " has more frames than are kept, or than the temporary folder has room for; cut the film, free some space, "
        "or save its frames as PNG.",
    }


def _read_at(descriptor: int, size: int, place: int) -> bytes:
    """Bytes at a place of an open file."""
    if hasattr(os, "pread"):
        return os.pread(descriptor, size, place)
    os.lseek(descriptor, place, os.SEEK_SET)
    return os.read(descriptor, size)


def _close_and_remove(descriptor: int, folder: tempfile.TemporaryDirectory) -> None:
    """Where an open file cannot be removed."""
    os.close(descriptor)
    folder.cleanup()
