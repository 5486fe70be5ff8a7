"""What the folder of a track holds besides poses: tables and plots of joints, and the overlay video."""

from __future__ import annotations

from pathlib import Path

from PolyPoseLib.data.tracking.sequence import Sequence
from PolyPoseLib.data.tracking.track import Track
from PolyPoseLib.io.tracking.joint_tables import write_joint_tables
from PolyPoseLib.io.tracking.overlay_video import write_overlay_video
from PolyPoseLib.io.tracking.plots import write_plots
from PolyPoseLib.kinematics.joint_motions import joint_motions

PLOTS, VIDEO = "plots", "overlay.mp4"


def write_tables_of(track: Track, sequence: Sequence, folder: Path) -> None:
    """Write joints.csv and joints.json into a folder, if there is a joint; raises InputError."""
    write_joint_tables(track, joint_motions(track, sequence), folder)


def write_plots_of(track: Track, sequence: Sequence, folder: Path) -> None:
    """Write plots of all joints into the folder's PLOTS, if there is a joint; raises InputError without matplotlib."""
    motions = joint_motions(track, sequence)
    if motions:
        (folder / PLOTS).mkdir(exist_ok=True)
        write_plots(track, motions, folder / PLOTS)


def write_video_of(track: Track, sequence: Sequence, folder: Path) -> None:
    """Write VIDEO into a folder; raises InputError without matplotlib or PyAV, and for X-rays that cannot be read."""
    write_overlay_video(track, sequence, folder / VIDEO)
