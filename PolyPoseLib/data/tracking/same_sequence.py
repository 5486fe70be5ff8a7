"""Whether a track is of the sequence at hand, by all that a track keeps of its own."""

from __future__ import annotations

import numpy as np

from PolyPoseLib.data.tracking.sequence import Sequence, TrackView
from PolyPoseLib.data.tracking.track import Track
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera

CENTROID_MM = 1e-3
"""By which centroids of the same labels differ at most."""


def require_same_sequence(sequence: Sequence, track: Track) -> None:
    """Refuse an earlier track of another sequence.

    Raises
    ------
    InputError
        The first thing that differs; digests of CT, labels and images count where the track has them.

    """
    differs = _of_the_patient(sequence, track) or _of_the_cameras(sequence, track)
    if differs:
        raise InputError(
            f"The earlier track is of another sequence, its {differs}: go on with the sequence of which it is."
        )
    numbers = [each.frame for each in track.frames]
    if numbers != list(sequence.frames):
        raise InputError(
            f"The earlier track holds the frames {numbers[0]} to {numbers[-1]}, the sequence {sequence.frames.start} "
            f'to {sequence.frames.stop - 1}: give all of its images, and the options "first" and "last" of that track.'
        )
    differs = _of_the_arrays(sequence, track)
    if differs:
        raise InputError(
            f"The earlier track is of another sequence, its {differs}: go on with the sequence of which it is."
        )


def _of_the_patient(sequence: Sequence, track: Track) -> str:
    """What of structures and times differs, or ""."""
    if track.names != sequence.structures.names:
        return f"structures are {', '.join(track.names)}"
    if track.reference != sequence.reference:
        return f'reference is "{track.reference}"'
    if not np.isclose(track.frames_per_second, sequence.frames_per_second, rtol=1e-9):
        return f"frames per second are {track.frames_per_second:g}"
    centroids = sequence.structures.centroids(sequence.ct.affine)
    away = np.linalg.norm(track.centroids - centroids, axis=1)
    if not away.max() <= CENTROID_MM:
        name = track.names[int(away.argmax())]
        return f'structure "{name}" has its centroid elsewhere in the CT'
    return ""


def _of_the_cameras(sequence: Sequence, track: Track) -> str:
    """What of the cameras differs, or ""."""
    names = tuple(view.name for view in sequence.views)
    if tuple(track.cameras) != names:
        return f"cameras are {', '.join(track.cameras)}"
    for view in sequence.views:
        if not _same_camera(track.cameras[view.name], view):
            return f'camera "{view.name}" has another calibration or another place'
    return ""


def _same_camera(camera: Camera, view: TrackView) -> bool:
    here = view.camera
    return (
        (camera.height, camera.width) == (here.height, here.width)
        and np.allclose(camera.intrinsics, here.intrinsics, rtol=1e-9, atol=1e-6)
        and np.allclose(camera.extrinsic, here.extrinsic, rtol=1e-9, atol=1e-6)
    )


def _of_the_arrays(sequence: Sequence, track: Track) -> str:
    """What of CT, labels and images differs, or ""; "" where the track has no digests."""
    if track.inputs is None:
        return ""
    here = sequence.inputs
    if track.inputs.ct != here.ct:
        return "CT has other voxels"
    if track.inputs.labels != here.labels:
        return "structures have other voxels"
    for name, digest in here.images.items():
        if track.inputs.images.get(name) != digest:
            return f'camera "{name}" has other images, or they are read otherwise'
    return ""
