"""Renderings of the scene's CT for the panel: asked for by camera, each handed to its own callback by a timer."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import qt
import slicer

from PolyPoseLib.errors import PolyPoseError
from PolyPoseLib.geometry.camera import Camera

from ..scene.nodes import read_volume
from .render_client import RenderClient

_POLL_MS = 10

Done = Callable[[np.ndarray, float], None]
"""Gets an image (H, W) and the seconds that it took."""


class Renderer:
    """Keeps one child process for the CT that was rendered last; it ends with `close`."""

    def __init__(self, failed: Callable[[str], None], command: list[str] | None = None) -> None:
        """failed: called with one sentence when nothing can be rendered. command: another program, for tests."""
        self._failed = failed
        self._command = command
        self._client: RenderClient | None = None
        self._key: tuple[Any, ...] = ()
        self._done: dict[int, tuple[str, Done]] = {}
        self._timer = qt.QTimer()
        self._timer.interval = _POLL_MS
        self._timer.connect("timeout()", self._poll)

    @property
    def running(self) -> bool:
        """Whether there is a child process."""
        return self._client is not None

    @property
    def busy(self) -> bool:
        """Whether an image is still to come."""
        return self._client is not None and self._client.busy

    def ask(
        self,
        ct: slicer.vtkMRMLScalarVolumeNode,
        camera: Camera,
        done: Done,
        purpose: str,
    ) -> None:
        """Render a CT as it is shown; done gets this request's image and no other.

        Of the requests of one purpose that have not begun the newest stays; those for another CT are dropped.
        """
        transform = ct.GetParentTransformNode()
        key = (
            ct.GetID(),
            ct.GetImageData() and ct.GetImageData().GetMTime(),
            transform,
            _matrix_time(transform),
        )
        if self._client is None or key != self._key or self._client.error:
            self.close()
            try:
                self._client = RenderClient(read_volume(ct), self._command)
            except PolyPoseError as error:
                self._failed(str(error))
                return
            self._key = key
        self._done[self._client.ask(camera, purpose)] = (purpose, done)
        if not self._timer.isActive():
            self._timer.start()

    def forget(self, purpose: str) -> None:
        """Drop what was asked for a purpose; the process stays for the next request."""
        self._done = {number: each for number, each in self._done.items() if each[0] != purpose}
        if self._client is not None:
            self._client.drop(purpose)

    def close(self) -> None:
        """End the process and remove its files."""
        self._timer.stop()
        self._done.clear()
        if self._client is not None:
            self._client.close()
            self._client = None

    def _poll(self) -> None:
        client = self._client
        if client is None:
            return
        rendering = client.poll()
        if client.error:
            self._timer.stop()
            self._failed(client.error)
        elif rendering is not None:
            purpose, done = self._done.pop(rendering.number, ("", None))
            older = [n for n, each in self._done.items() if n < rendering.number and each[0] == purpose]
            for number in older:  # never begun
                del self._done[number]
            if done is not None:
                done(rendering.image, rendering.seconds)
        if self._client is client and not client.busy:
            self._timer.stop()


def _matrix_time(transform: slicer.vtkMRMLTransformNode | None) -> int:
    return transform.GetTransformToWorldMTime() if transform is not None else 0
