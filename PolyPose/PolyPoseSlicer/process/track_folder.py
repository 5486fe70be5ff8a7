"""Where tracks lie while they are in the scene: a temporary folder, and in it the frames of interrupted runs."""

from __future__ import annotations

import atexit
import shutil
import tempfile
from pathlib import Path

import slicer

PREFIX = "PolyPoseTracks-"


class TrackFolder:
    """One folder per scene, made when it is first needed, and removed with all tracks in it by `remove`."""

    def __init__(self) -> None:
        """Nothing is made yet."""
        self._root: Path | None = None
        self._count = 0

    def new(self) -> Path:
        """The path of another track, which does not exist yet."""
        if self._root is None or not self._root.is_dir():
            self._root = Path(tempfile.mkdtemp(prefix=PREFIX, dir=slicer.app.temporaryPath))
        self._count += 1
        return self._root / f"track_{self._count}"

    def remove(self) -> None:
        """Remove all of it; what cannot be removed is left behind."""
        root, self._root = self._root, None
        if root is not None:
            shutil.rmtree(root, ignore_errors=True)


TRACKS = TrackFolder()
"""Of the scene; gone when it is closed, and when the application ends."""

atexit.register(TRACKS.remove)


def frames_kept(output: Path) -> int:
    """How many frames an interrupted run towards an output has left."""
    from PolyPoseLib.errors import InputError
    from PolyPoseLib.io.tracking.checkpoint import checkpoint_path, frames_left

    try:
        return frames_left(checkpoint_path(output)) or 0
    except InputError:
        return 0


def discard(output: Path) -> None:
    """Remove what an interrupted run towards an output has left."""
    from PolyPoseLib.io.tracking.checkpoint import checkpoint_path

    checkpoint_path(output).unlink(missing_ok=True)
