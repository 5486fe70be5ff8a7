"""Renders the CT in a persistent child process; of each purpose the newest request wins and none is queued."""

from __future__ import annotations

import contextlib
import json
import logging
import queue
import shutil
import tempfile
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import slicer
from slicer.i18n import tr as _

from PolyPoseLib.geometry.camera import Camera

from ..scene.nodes import Voxels
from .environment import child_environment, python_executable
from .process_tree import ProcessTree
from .study_run import TEMPORARY_PREFIX

_JOIN_SECONDS = 0.5


@dataclass(frozen=True, eq=False)
class Rendering:
    """An image (H, W) float32, the number of the request that it answers, and the seconds since that."""

    number: int
    image: np.ndarray
    seconds: float


class RenderClient:
    """One child process for one CT. Nothing here waits: `ask` for an image, then `poll` for it.

    error: one sentence once the child cannot render.
    """

    def __init__(self, ct: Voxels, command: list[str] | None = None) -> None:
        """Start to write the CT and, after it, the process. command: another program, for tests."""
        self.error = ""
        self._folder = Path(tempfile.mkdtemp(prefix=TEMPORARY_PREFIX, dir=slicer.app.temporaryPath))
        self._command = command or [python_executable(), "-m", "PolyPoseLib"]
        self._lines: queue.Queue[dict[str, Any]] = queue.Queue()
        self._log: list[str] = []
        self._closed = threading.Event()
        self._tree: ProcessTree | None = None
        self._ready = False
        self._wanted: dict[str, dict[str, Any]] = {}
        self._pending: dict[str, Any] | None = None
        self._number = 0
        self._environment = child_environment()
        self._thread = threading.Thread(target=self._start, args=(ct,), daemon=True)
        self._thread.start()

    @property
    def ready(self) -> bool:
        """Whether the CT is prepared."""
        return self._ready

    @property
    def busy(self) -> bool:
        """Whether an image is still to come."""
        return not self.error and (bool(self._wanted) or self._pending is not None)

    def ask(self, camera: Camera, purpose: str = "") -> int:
        """Request the image of a camera; an earlier request of the same purpose that has not begun is dropped.

        Returns the request's number, which its image will bear.
        """
        self._number += 1
        self._wanted[purpose] = {
            "id": self._number,
            "intrinsics": camera.intrinsics.tolist(),
            "extrinsic": camera.extrinsic.tolist(),
            "height": camera.height,
            "width": camera.width,
            "output": str(self._folder / f"image{self._number % 2}.raw"),
            "asked": time.monotonic(),
        }
        self._send()
        return self._number

    def drop(self, purpose: str) -> None:
        """Drop the request of a purpose that has not begun."""
        self._wanted.pop(purpose, None)

    def poll(self) -> Rendering | None:
        """The image that has come since the last poll, if there is one."""
        rendering = None
        with contextlib.suppress(queue.Empty):
            while True:
                found = self._take(self._lines.get_nowait())
                rendering = found if found is not None else rendering
        self._send()
        return rendering

    def close(self) -> None:
        """End the process and remove its files, at once; harmless when called again."""
        self._closed.set()
        if self._tree is not None:
            self._tree.kill()
        self._thread.join(_JOIN_SECONDS)
        shutil.rmtree(self._folder, ignore_errors=True)

    def _send(self) -> None:
        pipe = self._tree.process.stdin if self._tree is not None else None
        if not self._ready or pipe is None or self._pending is not None or not self._wanted or self.error:
            return
        self._pending = self._wanted.pop(min(self._wanted, key=lambda each: self._wanted[each]["id"]))
        try:
            pipe.write((json.dumps(self._pending) + "\n").encode())
            pipe.flush()
        except (OSError, ValueError):
            self._fail()

    def _take(self, line: dict[str, Any]) -> Rendering | None:
        if line.get("ready"):
            self._ready = True
        elif "ended" in line:
            if not self._closed.is_set():
                self._fail()
        elif self._pending is not None and line.get("id") == self._pending["id"]:
            request, self._pending = self._pending, None
            if "error" in line:
                self.error = str(line["error"])
                return None
            try:
                image = np.fromfile(request["output"], np.float32).reshape(
                    request["height"], request["width"]
                )
            except (OSError, ValueError) as error:
                self.error = _("The rendering cannot be read: {reason}.").format(reason=error)
                return None
            return Rendering(request["id"], image, time.monotonic() - request["asked"])
        return None

    def _fail(self) -> None:
        sentence = next((line for line in reversed(self._log) if line.strip()), "")
        sentence = sentence.removeprefix("polypose: ").rstrip(".")
        self.error = _("The CT cannot be rendered ({reason}): choose the CT again to retry.").format(
            reason=sentence or _("its process ended")
        )

    def _start(self, ct: Voxels) -> None:
        """Runs in a thread: write the CT, start the process, pass on what it writes."""
        try:
            from PolyPoseLib.data.volume import Volume
            from PolyPoseLib.io.volumes import write_volume

            path = self._folder / "ct.nrrd"
            write_volume(Volume(ct.values, ct.grid.affine), path)
            if self._closed.is_set():
                return
            arguments = [*self._command, "render", str(path)]
            tree = self._tree = ProcessTree(arguments, self._environment, str(self._folder), writable=True)
            if self._closed.is_set():
                tree.kill()
            listener = threading.Thread(target=self._read_log, args=(tree,), daemon=True)
            listener.start()
            self._read_answers(tree)
            listener.join(_JOIN_SECONDS)
        except Exception as error:
            logging.debug("PolyPose: the renderer did not start", exc_info=True)
            self._log.append(str(error))
        finally:
            self._lines.put({"ended": True})
            if self._tree is not None:
                self._tree.kill()
            if self._closed.is_set():
                shutil.rmtree(self._folder, ignore_errors=True)

    def _read_answers(self, tree: ProcessTree) -> None:
        with contextlib.suppress(OSError, ValueError):
            for line in tree.stdout:
                with contextlib.suppress(ValueError):
                    answer = json.loads(line)
                    if isinstance(answer, dict):
                        self._lines.put(answer)

    def _read_log(self, tree: ProcessTree) -> None:
        with contextlib.suppress(OSError, ValueError):
            for line in tree.stderr:
                self._log.append(line.decode("utf-8", "replace").strip())
                del self._log[:-20]
