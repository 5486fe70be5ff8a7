"""Poses as Autoscoper reads them: a .tra file a bone, one line a frame.

Autoscoper's world is that of the calibration (a MayaCam 2.0 text's), in mm; here the rig's world. Its volume is a stack
of TIFF pages without a place in the patient: x runs along the columns, y against the rows, z against the pages, and the
origin is the outer corner of the first column, the last row and the first page (as its ray caster samples it):

    x = (i + 1/2) s_i,   y = (H - j - 1/2) s_j,   z = -(k + 1/2) s_k

for the voxel of column i, row j and page k, H rows, and voxels of s_i x s_j x s_k mm. A line of a .tra file is the
motion from there to the world, 16 numbers row by row.

Source: the ray caster, the volume's description and the reading of tracking data in the code of Autoscoper 2
(github.com/BrownBiomechanics/Autoscoper).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from PolyPoseLib.data.tracking.track import Track
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.geometry.rigid import rigid_inverse

LOST = ",".join(["NaN"] * 16)
"""The line of a frame without a pose."""


def is_mirrored(ct: Volume) -> bool:
    """Whether a CT's grid is left-handed: its stack must then be loaded with its pages in reverse order."""
    return bool(np.linalg.det(ct.affine[:3, :3]) < 0)


def volume_to_ct(ct: Volume) -> np.ndarray:
    """(4, 4) rigid, from Autoscoper's volume (mm) to the CT's LPS mm, of the CT as a stack of its slices.

    Of a left-handed grid the slices are in reverse order: Autoscoper knows no mirrored volumes.
    """
    depth, height, _ = ct.shape
    spacing = ct.spacing
    to_index = np.diag([1 / spacing[0], -1 / spacing[1], -1 / spacing[2], 1.0])
    to_index[:3, 3] = -0.5, height - 0.5, -0.5
    if is_mirrored(ct):
        to_index[2] *= -1
        to_index[2, 3] += depth - 1
    return ct.affine @ to_index


def volume_poses(track: Track, structure: int, volume: np.ndarray) -> dict[int, np.ndarray]:
    """{frame: (4, 4) from Autoscoper's volume to the world} of a structure, without frames in which it was lost."""
    return {
        frame.frame: rigid_inverse(frame.poses[structure]) @ volume
        for frame in track.frames
        if frame.sources[structure] != "none" and np.isfinite(frame.poses[structure]).all()
    }


def write_tra(path: Path, poses: dict[int, np.ndarray], frames: int) -> None:
    """Write poses of a structure by frame, one line for each of so many frames from 0, NaN where there is none."""
    lines = [
        ",".join(f"{value:.16f}" for value in poses[n].ravel()) if n in poses else LOST for n in range(frames)
    ]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
