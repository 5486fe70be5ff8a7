"""Chosen frames of a track as shapes: bones' surfaces in the rig's world, and the CT in the frame's posture."""

from __future__ import annotations

from collections.abc import Iterator
from collections.abc import Sequence as Many
from pathlib import Path

import numpy as np

from PolyPoseLib.data.tracking.sequence import Sequence
from PolyPoseLib.data.tracking.track import Track, TrackedFrame
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.rigid import rigid_inverse
from PolyPoseLib.io.tracking.file_names import file_stems
from PolyPoseLib.io.tracking.vtp_surface import uncertainty_mm, write_vtp
from PolyPoseLib.io.volumes import write_volume

SURFACES, WARPED = "surfaces", "warped"
"""Folders of a track."""

SURFACE_FORMATS = ("stl", "vtp")

BYTES_OF_SURFACES = 20e6
"""Of all surfaces of one frame, at most about."""


def write_surfaces(
    track: Track, sequence: Sequence, folder: Path, frames: Many[int], surface_format: str = "stl"
) -> None:
    """Write every bone's surface where it is in chosen frames: STL or VTP, mm, in the rig's world.

    A VTP file also holds how far each vertex may be off, see :mod:`PolyPoseLib.io.tracking.vtp_surface`.

    Raises
    ------
    InputError
        VTK is missing, or a frame was not tracked.

    """
    from PolyPoseLib.carrying.surfaces import surfaces_of
    from PolyPoseLib.io.carried.meshes import require_vtk

    require_vtk()
    count = len(track.names)
    surfaces = surfaces_of(Volume(sequence.structures.labels, sequence.ct.affine), list(range(1, count + 1)))
    stems = file_stems(track.names)
    for frame in _frames(track, frames):
        place = folder / SURFACES / f"frame_{frame.frame:06d}"
        place.mkdir(parents=True)
        for k, surface in enumerate(surfaces):
            if _has_pose(frame, k):
                moved = surface.moved(rigid_inverse(frame.poses[k]))
                if surface_format == "stl":
                    write_stl(place / f"{stems[k]}.stl", moved.points, moved.triangles)
                    continue
                off = uncertainty_mm(surface.points, frame.covariances[k], track.centroids[k])
                write_vtp(place / f"{stems[k]}.vtp", moved.points, moved.triangles, off)


def write_stl(path: Path, points: np.ndarray, triangles: np.ndarray) -> None:
    """Write a surface as binary STL: vertices (N, 3) in mm, triangles (M, 3) of indices, normals by the right hand."""
    corners = np.asarray(points, np.float32)[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    facets = np.zeros(len(triangles), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("unused", "<u2")])
    facets["normal"], facets["corners"] = normals, corners
    header = b"PolyPose SPACE=LPS".ljust(80)
    path.write_bytes(header + np.uint32(len(triangles)).astype("<u4").tobytes() + facets.tobytes())


def write_warped(track: Track, sequence: Sequence, folder: Path, frames: Many[int]) -> None:
    """Write the CT and its structures in the posture of chosen frames, with the reference where the CT has it.

    Bones move rigidly, soft tissue between them follows smoothly, on the CT's own grid.

    Raises
    ------
    InputError
        A frame was not tracked, or a structure was lost in it or turned too far to be warped.

    """
    from PolyPoseLib.registration.outputs import TRANSFORM_MM, transform_grid
    from PolyPoseLib.registration.presets import PRESETS
    from PolyPoseLib.warp.composition import compose_warped_ct, compose_warped_labels
    from PolyPoseLib.warp.dense import displacement_field
    from PolyPoseLib.warp.polyrigid import PolyrigidWarp, RotationFalloff
    from PolyPoseLib.warp.weights import distance_maps

    ct, structures, preset = sequence.ct, sequence.structures, PRESETS["default"]
    chosen = list(_frames(track, frames))
    if not chosen:
        return
    distances = distance_maps(structures, ct.affine)
    affine, shape, _ = transform_grid(ct, TRANSFORM_MM)
    reference = track.names.index(track.reference)
    falloff = None
    if preset.rotation_reach_mm is not None:
        falloff = RotationFalloff(preset.rotation_reach_mm, track.centroids)
    (folder / WARPED).mkdir()
    for frame in chosen:
        poses = relative_poses(track, frame, reference)
        warp = PolyrigidWarp(
            distances,
            structures.volume_share(),
            poses,
            preset.weight_frame,
            preset.weights,
            center=track.centroids[reference],
            rotation_falloff=falloff,
        )
        field = displacement_field(warp, affine, shape)
        stem = f"frame_{frame.frame:06d}"
        warped = compose_warped_ct(ct, structures, poses, field)
        write_volume(
            warped.with_voxels(np.rint(warped.voxels).clip(-32768, 32767).astype(np.int16)),
            folder / WARPED / f"{stem}_ct.nii.gz",
        )
        labels = compose_warped_labels(Volume(structures.labels, ct.affine), structures, poses, field)
        write_volume(labels, folder / WARPED / f"{stem}_labels.nii.gz")


def relative_poses(track: Track, frame: TrackedFrame, reference: int) -> np.ndarray:
    """(K, 4, 4) poses of a frame from the world in which the reference stands where the CT has it.

    Raises InputError where a structure was lost.
    """
    lost = [name for k, name in enumerate(track.names) if not _has_pose(frame, k)]
    if lost:
        raise InputError(
            f'In frame {frame.frame} "{lost[0]}" was lost, so that the CT cannot be warped to it.'
        )
    return frame.poses @ rigid_inverse(frame.poses[reference])


def require_frames(wanted: Many[int], frames: range, option: str) -> None:
    """Refuse numbers of frames that are not tracked; raises InputError."""
    for number in wanted:
        if number not in frames:
            raise InputError(
                f"{option}: frame {number} is not tracked; give numbers from {frames.start} to {frames.stop - 1}."
            )


def _frames(track: Track, wanted: Many[int]) -> Iterator[TrackedFrame]:
    """Chosen frames of a track, each once; raises InputError for one that it has not."""
    known = {each.frame: each for each in track.frames}
    for number in dict.fromkeys(wanted):
        if number not in known:
            raise InputError(f"Frame {number} was not tracked: choose another.")
        yield known[number]


def _has_pose(frame: TrackedFrame, k: int) -> bool:
    """Whether a structure was found in a frame."""
    return frame.sources[k] != "none" and bool(np.isfinite(frame.poses[k]).all())
