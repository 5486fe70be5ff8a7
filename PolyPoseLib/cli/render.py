"""Subcommand render: a persistent process that renders a CT through cameras that arrive as JSON lines.

Whoever asks writes one object a line to stdin: {"id": 7, "intrinsics": 3x3, "extrinsic": 4x4, "height": H,
"width": W, "output": PATH}. The image is written to PATH as raw float32, row by row, and one object a line on
stdout answers: {"id", "seconds"} or {"id", "error"}; the first line, {"ready": true}, says that the CT is
prepared. A request that is older than another one in the queue is dropped without an answer. The end of stdin
ends the process.
"""

from __future__ import annotations

import argparse
import io
import json
import logging
import sys
import threading
import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from PolyPoseLib.cli._arguments import new_parser
from PolyPoseLib.errors import InputError, PolyPoseError
from PolyPoseLib.io.json_records import Record, kind_of, nonempty, parse_object, whole_number
from PolyPoseLib.io.whole_files import replaced_whole

if TYPE_CHECKING:
    from PolyPoseLib.geometry.camera import Camera
    from PolyPoseLib.rendering.preview import PreviewRenderer

_LOG = logging.getLogger(__name__)

_LARGEST_SIDE = 4096


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    """Add the subcommand."""
    parser = new_parser(
        subparsers,
        "render",
        "render a CT through cameras that arrive as JSON lines on stdin",
        "ct.nii.gz < requests.jsonl",
    )
    parser.add_argument("ct", type=Path, help="CT in Hounsfield units")
    parser.add_argument("--threads", type=int, metavar="N", help="CPU threads (default: all)")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Answer requests until stdin ends."""
    from PolyPoseLib.io.volumes import read_ct
    from PolyPoseLib.rendering.preview import PreviewRenderer
    from PolyPoseLib.rendering.select import select_backend

    requests = LatestRequest(_lenient(sys.stdin))
    if arguments.threads is not None and arguments.threads < 1:
        raise InputError(f"--threads is {arguments.threads}: give 1 or more.")
    renderer = PreviewRenderer(read_ct(arguments.ct), backend=select_backend(threads=arguments.threads))
    _compile(renderer)
    _say({"ready": True})
    while (line := requests.take()) is not None:
        _say(answer(renderer, line))
    return 0


def _lenient(stream: TextIO) -> TextIO:
    """The stream as UTF-8 text; bytes that are none make a request wrong, but do not end the reading."""
    if isinstance(stream, io.TextIOWrapper):
        stream.reconfigure(encoding="utf-8", errors="replace")
    return stream


class LatestRequest:
    """Reads lines in a thread and keeps the last one only."""

    def __init__(self, stream: TextIO) -> None:
        """Start reading."""
        self._condition = threading.Condition()
        self._line: str | None = None
        self._ended = False
        threading.Thread(target=self._read, args=(stream,), daemon=True).start()

    def _read(self, stream: TextIO) -> None:
        """Read to the end; whatever ends it, nobody waits for more."""
        try:
            for line in stream:
                if line.strip():
                    with self._condition:
                        self._line = line
                        self._condition.notify()
        except (OSError, ValueError) as error:
            _LOG.warning("Requests cannot be read any further (%s).", error)
        finally:
            with self._condition:
                self._ended = True
                self._condition.notify()

    def take(self) -> str | None:
        """Wait for a line and return the newest; None when no more will come."""
        with self._condition:
            self._condition.wait_for(lambda: self._line is not None or self._ended)
            line, self._line = self._line, None
            return line


def answer(renderer: PreviewRenderer, line: str) -> dict[str, Any]:
    """Do what one line asks for; whatever is wrong with it is said in the answer."""
    number = None
    try:
        request = Record(parse_object(line, "request"))
        number = request.optional("id", _identity)
        began = time.perf_counter()
        image = renderer.render(_camera(request))
        with replaced_whole(Path(request.required("output", nonempty))) as part:
            image.tofile(part)
    except (PolyPoseError, OSError, ValueError, TypeError, ArithmeticError, MemoryError) as error:
        return {"id": number, "error": str(error) or type(error).__name__}
    return {"id": number, "seconds": round(time.perf_counter() - began, 4)}


def _identity(value: Any, place: str) -> str | int:
    """Parse what the answer is known by."""
    if isinstance(value, str | int):
        return value
    raise InputError(f"{place} is {kind_of(value)}; give a whole number or a text.")


def _camera(request: Record) -> Camera:
    from PolyPoseLib.geometry.camera import Camera, require_intrinsics
    from PolyPoseLib.geometry.rigid import require_rigid

    camera = Camera(
        request.required("intrinsics", require_intrinsics),
        request.required("extrinsic", require_rigid),
        request.required("height", whole_number(1)),
        request.required("width", whole_number(1)),
    )
    if max(camera.height, camera.width) > _LARGEST_SIDE:
        raise InputError(f"The image is larger than {_LARGEST_SIDE} pixels: ask for a smaller one.")
    return camera


def _compile(renderer: PreviewRenderer) -> None:
    """Let the kernels be compiled, or loaded, before the first request."""
    import numpy as np

    from PolyPoseLib.geometry.camera import Camera

    extrinsic = np.eye(4)
    extrinsic[2, 3] = 1000.0
    intrinsics = np.array([[10.0, 0, 4], [0, 10, 4], [0, 0, 1]])
    renderer.render(Camera(intrinsics, extrinsic, 8, 8))


def _say(fields: Mapping[str, Any]) -> None:
    print(json.dumps(fields), flush=True)
