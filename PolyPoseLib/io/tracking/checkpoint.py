"""The checkpoint of a run: a file beside the output to which every frame is appended once a pass is through with it.

The first line says what is tracked, every further one holds a frame, in the order in which they were made: those of the
pass forward, then the same frames again on the way back; each line begins with the checksum of its rest. A line
is written by one call and flushed to the disk, so that a process that is killed at any moment, or a machine that loses
power, leaves whole lines and at most the beginning of another one, which the next run cuts off.
"""

from __future__ import annotations

import json
import os
import re
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from PolyPoseLib.data.tracking.track import TrackedFrame
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.disk_space import write_failure
from PolyPoseLib.io.files import refuse_special_file
from PolyPoseLib.io.json_records import Record, list_of, parse_object, string
from PolyPoseLib.io.tracking.frame_records import frame_fields, frame_of, require_sound

FORMAT = "polypose track checkpoint 2"

ENDING = ".partial"

MAX_LINE_BYTES = 1 << 26
"""A frame of a thousand structures has less."""


def checkpoint_path(output: Path) -> Path:
    """Where the checkpoint of a run with this output lies: beside it."""
    target = output.resolve()
    return target.with_name(f"{target.name}{ENDING}")


_BEGINNING = re.compile(rb"[0-9a-f]{0,8}|[0-9a-f]{8} (\{[^\n]*)?")
"""What a process that is killed may leave of the first line."""


class Checkpoint:
    """An open checkpoint, to which frames are appended.

    Attributes
    ----------
    done : tuple of TrackedFrame
        What the interrupted run kept, in its order.

    """

    def __init__(
        self, descriptor: int, path: Path, names: Sequence[str], done: tuple[TrackedFrame, ...]
    ) -> None:
        self._descriptor, self.path, self._names, self.done = descriptor, path, tuple(names), done
        self._numbers = [each.frame for each in done]

    @property
    def kept(self) -> int:
        """How many frames are in the file, each counted once."""
        return len(set(self._numbers))

    def keep(self, frame: TrackedFrame) -> None:
        """Append a frame; it is on the disk when this returns. Raises InputError."""
        require_sound(
            frame, len(self._names), lambda k: f'The pose of "{self._names[k]}" in frame {frame.frame}'
        )
        # Counted first: a signal may end the run once the frame is on the disk, and a file without frames is removed.
        self._numbers.append(frame.frame)
        try:
            _append(self._descriptor, json.dumps(frame_fields(frame), allow_nan=False), self.path)
        except InputError:
            self._numbers.pop()
            raise


@contextmanager
def opened_checkpoint(path: Path, digest: str, names: Sequence[str], resume: bool) -> Iterator[Checkpoint]:
    """Open the checkpoint of a run, which must be the only one towards its output.

    Parameters
    ----------
    path : Path
        As ``checkpoint_path`` gives it.
    digest : str
        Fingerprint of the sequence.
    names : sequence of str
        Of the structures.
    resume : bool
        Whether frames of an interrupted run are taken over; otherwise the file begins anew.

    Raises
    ------
    InputError
        What is there is no checkpoint or that of another sequence, or the system refuses.

    """
    done: tuple[TrackedFrame, ...] = ()
    size = 0
    if resume and os.path.lexists(path):
        done, size = _read(path, digest, names)
    flags = os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
    try:
        descriptor = os.open(path, flags | getattr(os, "O_CLOEXEC", 0), 0o666)
    except OSError as error:
        raise InputError(write_failure(path, error)) from error
    try:
        os.ftruncate(descriptor, size)
        os.lseek(descriptor, 0, os.SEEK_END)
        if size == 0:
            header = {"format": FORMAT, "inputs": digest, "structures": list(names)}
            _append(descriptor, json.dumps(header), path)
        checkpoint = Checkpoint(descriptor, path, names, done)
        try:
            yield checkpoint
        finally:
            if not checkpoint.kept:
                with suppress(OSError):
                    path.unlink()
    finally:
        os.close(descriptor)


def frames_left(path: Path) -> int | None:
    """How many frames an interrupted run has left, None where there is no checkpoint; raises InputError for others."""
    if not os.path.lexists(path):
        return None
    lines = _lines(path)
    header = next(lines, None)
    if header is None:
        return 0
    _require_ours(header[0], path)
    return len({_number(text) for text, _ in lines})


def _read(path: Path, digest: str, names: Sequence[str]) -> tuple[tuple[TrackedFrame, ...], int]:
    """Frames of a checkpoint and the size of its whole lines; raises InputError for that of another sequence."""
    lines = _lines(path)
    first = next(lines, None)
    if first is None:
        return (), 0
    header = _require_ours(first[0], path)
    record = Record(header, f"{path}: ")
    if record.required("inputs", string) != digest or record.required("structures", list_of(string)) != list(
        names
    ):
        raise InputError(
            f"{path}: the interrupted run tracked something else (other images, CT, labels, cameras, initial poses, "
            "options, another correction or another version): replace --resume by --overwrite to begin anew."
        )
    parser, size = frame_of(len(names)), first[1]
    frames: list[TrackedFrame] = []
    for text, end in lines:
        try:
            frame = parser(parse_object(text, "a line"), "a frame")
        except InputError:
            break  # written by another program: what follows cannot be relied on, either
        frames.append(frame)
        size = end
    return tuple(frames), size


def _number(text: str) -> object:
    """The number of the frame that a line holds."""
    try:
        return parse_object(text, "a line").get("frame")
    except InputError:
        return None


def _require_ours(text: str, path: Path) -> dict[str, object]:
    """The header of a checkpoint; raises InputError for any other file, which is not touched."""
    try:
        header = parse_object(text, str(path))
    except InputError:
        header = {}
    if header.get("format") != FORMAT:
        raise InputError(
            f"{path}: this file is no checkpoint of this version: move it away, or choose another --output."
        )
    return header


def _lines(path: Path) -> Iterator[tuple[str, int]]:
    """Whole lines with a right checksum, each with the place of its end, up to the first that is not.

    Raises InputError for a file whose first line is none, which another program wrote.
    """
    refuse_special_file(path)
    if path.is_symlink() or not path.is_file():
        raise InputError(f"{path}: this is no file: move it away, or choose another --output.")
    place = 0
    try:
        with path.open("rb") as stream:
            while line := stream.readline(MAX_LINE_BYTES):
                content = _checked(line)
                if content is None:
                    if place == 0 and not _BEGINNING.fullmatch(line):
                        raise InputError(
                            f"{path}: this file is no checkpoint of this version: move it away, or choose another "
                            "--output."
                        )
                    return
                place += len(line)
                yield content, place
    except OSError as error:
        raise InputError(
            f"{path}: the file cannot be read ({error.strerror}): check its permissions."
        ) from error


def _checked(line: bytes) -> str | None:
    """The text of a whole line, without its checksum; None where it is not whole."""
    checksum, _, content = line.rstrip(b"\n").partition(b" ")
    if not line.endswith(b"\n") or checksum != _checksum(content):
        return None
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError:
        return None


def _checksum(content: bytes) -> bytes:
    return f"{zlib.crc32(content):08x}".encode()


def _append(descriptor: int, text: str, path: Path) -> None:
    """Write a line and have the system put it on the disk; raises InputError."""
    content = text.encode("ascii")
    line = memoryview(_checksum(content) + b" " + content + b"\n")
    try:
        while line:
            line = line[os.write(descriptor, line) :]
        os.fsync(descriptor)
    except OSError as error:
        raise InputError(write_failure(path, error)) from error
