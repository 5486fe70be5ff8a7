"""Renders the CT in a persistent child process; the newest wish wins and none is queued."""

from __future__ import annotations

import contextlib
import json
import logging
import queue
import shutil
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import slicer
from slicer.i18n import tr as _

from ..scene.nodes import Voxels
from .environment import child_environment, python_executable
from .process_tree import ProcessTree
from .study_run import TEMPORARY_PREFIX

_JOIN_SECONDS = 0.5


class RenderClient:
    """One child process for one CT. Nothing here waits: `ask` for an image, then `poll` for it.

    error: one sentence once the child cannot render; seconds: from the last wish to its image.
    """

    def __init__(self, ct: Voxels, command: list[str] | None = None) -> None:
        """Start to write the CT and, after it, the process. command: another program, for tests."""
        self.error = ""
        self.seconds: float | None = None
        self._folder = Path(tempfile.mkdtemp(prefix=TEMPORARY_PREFIX, dir=slicer.app.temporaryPath))
        self._command = command or [python_executable(), "-m", "PolyPoseLib"]
        self._lines: queue.Queue[dict[str, Any]] = queue.Queue()
        self._last_words: list[str] = []
        self._closed = threading.Event()
        self._tree: ProcessTree | None = None
        self._ready = False
        self._wanted: dict[str, Any] | None = None
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
        return not self.error and (self._wanted is not None or self._pending is not None)

    def ask(self, intrinsics: np.ndarray, extrinsic: np.ndarray, height: int, width: int) -> None:
        """Wish for the image of a camera; a wish that was not begun yet is forgotten."""
        self._number += 1
        self._wanted = {
            "id": self._number,
            "intrinsics": np.asarray(intrinsics).tolist(),
            "extrinsic": np.asarray(extrinsic).tolist(),
            "height": int(height),
            "width": int(width),
            "output": str(self._folder / f"image{self._number % 2}.raw"),
            "asked": time.monotonic(),
        }
        self._send()

    def poll(self) -> np.ndarray | None:
        """The newest finished image (H, W) float32, None when none has come since the last poll."""
        image = None
        with contextlib.suppress(queue.Empty):
            while True:
                found = self._take(self._lines.get_nowait())
                image = found if found is not None else image
        self._send()
        return image

    def close(self) -> None:
        """End the process and remove its files, at once; harmless when called again."""
        self._closed.set()
        if self._tree is not None:
            self._tree.kill()
        self._thread.join(_JOIN_SECONDS)
        shutil.rmtree(self._folder, ignore_errors=True)

    def _send(self) -> None:
        if not self._ready or self._pending is not None or self._wanted is None or self.error:
            return
        self._pending, self._wanted = self._wanted, None
        try:
            self._tree.process.stdin.write((json.dumps(self._pending) + "\n").encode())
            self._tree.process.stdin.flush()
        except (OSError, ValueError):
            self._fail()

    def _take(self, line: dict[str, Any]) -> np.ndarray | None:
        if line.get("ready"):
            self._ready = True
        elif "ended" in line:
            if not self._closed.is_set():
                self._fail()
        elif self._pending is not None and line.get("id") == self._pending["id"]:
            wish, self._pending = self._pending, None
            if "error" in line:
                self.error = str(line["error"])
                return None
            try:
                image = np.fromfile(wish["output"], np.float32).reshape(wish["height"], wish["width"])
            except (OSError, ValueError) as error:
                self.error = _("The rendering cannot be read: {reason}.").format(reason=error)
                return None
            self.seconds = time.monotonic() - wish["asked"]
            return image
        return None

    def _fail(self) -> None:
        said = next((line for line in reversed(self._last_words) if line.strip()), "")
        said = said.removeprefix("polypose: ").rstrip(".")
        self.error = _("The CT cannot be rendered ({reason}): choose the CT again to retry.").format(
            reason=said or _("its process ended")
        )

    def _start(self, ct: Voxels) -> None:
        """Runs in a thread: write the CT, start the process, hand on what it says."""
        try:
            from PolyPoseLib.data.volume import Volume
            from PolyPoseLib.io.volumes import write_volume

            path = self._folder / "ct.nrrd"
            write_volume(Volume(ct.values, ct.grid.affine), path)
            if self._closed.is_set():
                return
            arguments = [*self._command, "render", str(path)]
            self._tree = ProcessTree(arguments, self._environment, str(self._folder), talks=True)
            if self._closed.is_set():
                self._tree.kill()
            listener = threading.Thread(target=self._hear_errors, daemon=True)
            listener.start()
            self._hear()
            listener.join(_JOIN_SECONDS)
        except Exception as error:
            logging.debug("PolyPose: the renderer did not start", exc_info=True)
            self._last_words.append(str(error))
        finally:
            self._lines.put({"ended": True})
            if self._tree is not None:
                self._tree.kill()
            if self._closed.is_set():
                shutil.rmtree(self._folder, ignore_errors=True)

    def _hear(self) -> None:
        with contextlib.suppress(OSError, ValueError):
            for line in self._tree.process.stdout:
                with contextlib.suppress(ValueError):
                    said = json.loads(line)
                    if isinstance(said, dict):
                        self._lines.put(said)

    def _hear_errors(self) -> None:
        with contextlib.suppress(OSError, ValueError):
            for line in self._tree.process.stderr:
                self._last_words.append(line.decode("utf-8", "replace").strip())
                del self._last_words[:-20]
