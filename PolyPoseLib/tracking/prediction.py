"""Where a frame's fit starts: from the frames beside it in time, whichever way time goes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from PolyPoseLib.data.tracking.track import TrackedFrame
from PolyPoseLib.geometry.rigid import (
    about,
    orthonormalised,
    perturbation,
    perturbation_between,
    rigid_inverse,
)

EXPECTED_DEG, EXPECTED_MM = 4.0, 4.0
"""Standard deviations of a step from one frame to the next."""


def is_found(frame: TrackedFrame, k: int) -> bool:
    """Whether a structure's pose in a frame is its own, not a stand-in for one that was lost."""
    return frame.sources[k] != "none"


def predicted_poses(
    past: Sequence[TrackedFrame], centres: np.ndarray, reference: int, moves_on: bool
) -> np.ndarray:
    """Poses in the frame after some.

    Parameters
    ----------
    past : sequence of TrackedFrame
        The nearest last; at least one.
    centres : (K, 3) ndarray
        Centroids of the structures in the CT, LPS mm.
    reference : int
        Index of the structure with which those move that were lost.
    moves_on : bool
        Whether structures keep their velocity; otherwise they stay where they were.

    Returns
    -------
    (K, 4, 4) ndarray
        Fixed to moving.

    """
    past = [*past[:-1], _with_what_was_expected(past, centres)]
    poses = past[-1].poses.copy()
    if moves_on and len(past) > 1:
        before, last = past[-2:]
        for k, centre in enumerate(centres):
            if is_found(last, k) and is_found(before, k):
                step = _velocity(before, last, k, centre)
                poses[k] = about(perturbation(step), centre) @ last.poses[k]
    for k in range(len(poses)):
        if k != reference and not is_found(past[-1], k):
            seen = next((each for each in reversed(past) if is_found(each, k)), past[-1])
            poses[k] = seen.poses[k] @ rigid_inverse(seen.poses[reference]) @ poses[reference]
    return orthonormalised(poses)


def _with_what_was_expected(past: Sequence[TrackedFrame], centres: np.ndarray) -> TrackedFrame:
    """The last frame with poses that count as far as they are more certain than what was to be expected.

    Where a single camera saw a structure for a frame, its place along the beam is better taken from the frames before.
    """
    last = past[-1]
    if len(past) == 1:
        return last
    expected, poses = past[-2], last.poses.copy()
    likely = np.diag([np.radians(EXPECTED_DEG)] * 3 + [EXPECTED_MM] * 3) ** 2
    for k, centre in enumerate(centres):
        if is_found(last, k) and is_found(expected, k):
            step = perturbation_between(expected.poses[k], last.poses[k], centre)
            prior = likely + expected.covariances[k]
            share = prior @ np.linalg.solve(prior + last.covariances[k], step)
            poses[k] = about(perturbation(share), centre) @ expected.poses[k]
    return replace(last, poses=poses)


def _velocity(before: TrackedFrame, last: TrackedFrame, k: int, centre: np.ndarray) -> np.ndarray:
    """(6,) the step between two frames as far as it is more than their poses' error.

    Along the beam of a single view two poses differ by their errors; carried on, these would grow.
    """
    step = perturbation_between(before.poses[k], last.poses[k], centre)
    size = np.r_[np.full(3, np.linalg.norm(step[:3])), np.full(3, np.linalg.norm(step[3:]))] + 1e-9
    likely = np.diag(size**2)
    return likely @ np.linalg.solve(likely + before.covariances[k] + last.covariances[k], step)


def between_poses(first: np.ndarray, second: np.ndarray, share: float, centre: np.ndarray) -> np.ndarray:
    """(4, 4) the pose at a share, 0 to 1, of the way between two, along an even rotation about a centre (3,) mm."""
    return about(perturbation(share * perturbation_between(first, second, centre)), centre) @ first
