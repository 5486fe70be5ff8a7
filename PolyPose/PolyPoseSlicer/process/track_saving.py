"""A track of the scene as a folder, as the command line writes it."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

from ..study.track_nodes import TrackNodes

_FOLDER = "PolyPose.TrackFolder"
"""Attribute of a track's browser: the temporary folder that it was read from."""


def remember_folder(nodes: TrackNodes, folder: Path) -> None:
    """Note where the whole folder of a track lies, as long as its scene is open."""
    nodes.browser.SetAttribute(_FOLDER, str(folder))


def track_text(nodes: TrackNodes) -> str:
    """The text of the track.json of a track in the scene, which scenes keep."""
    return nodes.parts.get("record").GetText()


def is_whole(nodes: TrackNodes) -> bool:
    """Whether the folder of a track is still there; without it the scene has the track's numbers alone."""
    folder = Path(nodes.browser.GetAttribute(_FOLDER) or "-")
    try:
        return (folder / "track.json").read_text(encoding="utf-8") == track_text(nodes)
    except OSError:
        return False


def saving(nodes: TrackNodes, target: Path) -> Callable[[], Path]:
    """What writes a track into a new folder without touching nodes: all of it, or its numbers where that is all.

    What is called raises OSError or InputError, and then leaves nothing behind.
    """
    folder = Path(nodes.browser.GetAttribute(_FOLDER) or "-") if is_whole(nodes) else None
    track = nodes.record.track

    def save() -> Path:
        if folder is None:
            from PolyPoseLib.io.tracking.tracks import save_track

            return save_track(track, target)
        from PolyPoseLib.io.whole_folders import claimed_folder

        with claimed_folder(target, None) as claim, claim.whole() as temporary:
            shutil.copytree(folder, temporary, dirs_exist_ok=True)
        return target

    return save
