"""Renderings of the scene's CT for the panel: asked for by camera, handed to a callback by a timer."""

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


class Renderer:
    """Keeps one child process for the CT that was rendered last; it ends with `close`."""

    def __init__(self, failed: Callable[[str], None], command: list[str] | None = None) -> None:
        """failed: called with one sentence when nothing can be rendered. command: another program, for tests."""
        self._failed = failed
        self._command = command
        self._client: RenderClient | None = None
        self._key: tuple[Any, ...] = ()
        self._done: Callable[[np.ndarray, float], None] | None = None
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
        done: Callable[[np.ndarray, float], None],
    ) -> None:
        """Render a CT as it is shown; done gets the image (H, W) and the seconds that it took.

        An earlier request whose image has not come is dropped.
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
        self._done = done
        self._client.ask(camera)
        if not self._timer.isActive():
            self._timer.start()

    def forget(self) -> None:
        """Drop the request; the process stays for the next one."""
        self._done = None

    def close(self) -> None:
        """End the process and remove its files."""
        self._timer.stop()
        self._done = None
        if self._client is not None:
            self._client.close()
            self._client = None

    def _poll(self) -> None:
        client = self._client
        if client is None:
            return
        image = client.poll()
        if client.error:
            self._timer.stop()
            self._failed(client.error)
        elif image is not None and self._done is not None:
            self._done(image, client.seconds or 0.0)
        if self._client is client and not client.busy:
            self._timer.stop()


def _matrix_time(transform: slicer.vtkMRMLTransformNode | None) -> int:
    return transform.GetTransformToWorldMTime() if transform is not None else 0
