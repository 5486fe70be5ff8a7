"""Whether a truth is that of a track's sequence, by all that both hold."""

from __future__ import annotations

import numpy as np

from PolyPoseLib.data.tracking.track import Track
from PolyPoseLib.data.tracking.track_truth import TrackTruth
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera

RATE = 1e-3
"""Share by which the frames per second may differ: a table's are rounded."""

TURN_DEG, SHIFT_MM, SHARE, SHIFT_PX = 0.1, 1.0, 1e-3, 1.0
"""By which a camera may differ: direction, place of the source, focal length, principal point. Files round them."""

BEYOND_MM = 5.0
"""How far outside the box of the truth's points a centroid may lie: the CT that was tracked may end sooner."""


def require_truth_of(track: Track, truth: TrackTruth) -> None:
    """Refuse the truth of another sequence; a track may have fewer structures, cameras and frames.

    Raises
    ------
    InputError
        The first thing that differs.

    """
    of_the_same = "score the track against the truth of the same sequence"
    for name in track.names:
        if name not in truth.names:
            raise InputError(f'The truth has no structure "{name}": {of_the_same}.')
    if not track.frames or track.numbers.max() >= len(truth.poses):
        last = track.numbers.max() if track.frames else "none"
        raise InputError(
            f"The truth has {len(truth.poses)} frames and the track's last frame is {last}: {of_the_same}."
        )
    if not np.isclose(track.frames_per_second, truth.frames_per_second, rtol=RATE, atol=0):
        raise InputError(
            f"The track has {track.frames_per_second:g} frames per second and the truth "
            f"{truth.frames_per_second:g}: {of_the_same}."
        )
    for name, camera in track.cameras.items():
        if not any(_alike(camera, other) for other in truth.cameras.values()):
            raise InputError(
                f'The truth has no camera with the calibration and the place of the track\'s "{name}": {of_the_same}.'
            )
    for name, centroid in zip(track.names, track.centroids, strict=True):
        points = truth.points[name]
        if ((centroid < points.min(0) - BEYOND_MM) | (centroid > points.max(0) + BEYOND_MM)).any():
            raise InputError(
                f'The structure "{name}" lies elsewhere in the CT of the truth than in that of the track: '
                f"{of_the_same}."
            )


def _alike(first: Camera, second: Camera) -> bool:
    """Whether two cameras are one, but for rounding."""
    turn = first.extrinsic[:3, :3] @ second.extrinsic[:3, :3].T
    angle = np.degrees(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1)))
    focal = [np.diag(each.intrinsics)[:2] for each in (first, second)]
    middle = [each.intrinsics[:2, 2] for each in (first, second)]
    return bool(
        (first.height, first.width) == (second.height, second.width)
        and angle <= TURN_DEG
        and np.linalg.norm(first.source - second.source) <= SHIFT_MM
        and np.allclose(*focal, rtol=SHARE, atol=0)
        and np.abs(middle[0] - middle[1]).max() <= SHIFT_PX
    )
