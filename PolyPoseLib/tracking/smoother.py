"""Rauch-Tung-Striebel smoothing of poses on SE(3) with their own covariances.

A pose moves with a velocity that changes by white noise; a frame's pose is an observation of it with the frame's
covariance. Errors are perturbations on the left of a pose, about the structure's centroid, as
:class:`PolyPoseLib.data.tracking.track.TrackedFrame` has its covariances.

A frame's covariance holds errors that neighbouring frames share (labels, cameras, edges) beside those that they do not,
and averaging reduces the second kind alone. How large a share of the variance that is, and how fast velocities change,
are those numbers under which the frames are most likely.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from PolyPoseLib.data.tracking.track import TrackedFrame
from PolyPoseLib.geometry.rigid import rigid_inverse, rotation_matrix, rotation_vectors, skew
from PolyPoseLib.tracking.prediction import is_found

LEAST_SHARE = 1e-4
"""Of the variance that frames do not share; keeps filters sound where all frames agree exactly."""

UNKNOWN_VELOCITY = (20.0, 2000.0)
"""Standard deviations of a velocity before any frame: rad/s and mm/s."""

TERMS = 24
"""Of power series; rotations of half a turn need so many."""

FEWEST = 5
"""Frames with a pose below which nothing is smoothed."""


@dataclass(frozen=True)
class Motion:
    """How a pose may change.

    Attributes
    ----------
    acceleration : (2,) ndarray
        Spectral density of the change of velocity: of rotations (rad^2/s^3), of translations (mm^2/s^3).
    share : float
        Of a frame's variance that it does not share with the frames beside it, 0 to 1.

    """

    acceleration: np.ndarray
    share: float


@dataclass(frozen=True)
class Smoothed:
    """Poses (F, 4, 4), their covariances (F, 6, 6) and velocities (F, 6) per second, and the likelihood's log."""

    poses: np.ndarray
    covariances: np.ndarray
    velocities: np.ndarray
    log_likelihood: float


def smoothed_frames(
    frames: Sequence[TrackedFrame], centroids: np.ndarray, frames_per_second: float
) -> list[TrackedFrame]:
    """Frames with smoothed poses; structures that have few poses of their own stay as they are.

    Parameters
    ----------
    frames : sequence of TrackedFrame
        In the order of time.
    centroids : (K, 3) ndarray
        LPS mm, about which covariances are.
    frames_per_second : float
        For the time between frames.

    Returns
    -------
    list of TrackedFrame
        What was lost stays as it is, bridged from the frames beside it: a velocity that nothing checks would carry it
        away, and its interval with it.

    """
    frames = list(frames)
    times = np.array([each.frame for each in frames]) / frames_per_second
    for k, centre in enumerate(centroids):
        seen = np.array([is_found(each, k) for each in frames])
        poses = np.stack([each.poses[k] for each in frames])
        if seen.sum() < FEWEST or np.ptp(poses[seen], axis=0).max() < 1e-9:
            continue
        covariances = np.stack([each.covariances[k] for each in frames])
        motion = likeliest_motion(poses, covariances, seen, times, centre)
        result = smooth(poses, covariances, seen, times, centre, motion)
        for n in np.flatnonzero(seen):
            frame = frames[n]
            changed, spread = frame.poses.copy(), frame.covariances.copy()
            changed[k], spread[k] = result.poses[n], result.covariances[n]
            frames[n] = replace(frame, poses=changed, covariances=spread)
    return frames


def likeliest_motion(
    poses: np.ndarray, covariances: np.ndarray, seen: np.ndarray, times: np.ndarray, centre: np.ndarray
) -> Motion:
    """The motion under which the frames are most likely; arguments as :func:`smooth` takes them."""

    def of(logs: np.ndarray) -> Motion:
        return Motion(np.exp(logs[:2]), float(np.clip(np.exp(logs[2]), LEAST_SHARE, 1.0)))

    def misfit(logs: np.ndarray) -> float:
        beyond = float(np.maximum(logs[2], 0) + np.maximum(np.log(LEAST_SHARE) - logs[2], 0))
        return beyond - _filter(poses, covariances, seen, times, centre, of(logs))[-1]

    step = np.diff(times).mean()
    start = np.log([0.1**2 / step, 10.0**2 / step, 0.1])
    simplex = start + np.r_[np.zeros((1, 3)), np.diag([2.0, 2.0, 1.5])]
    found = minimize(
        misfit,
        start,
        method="Nelder-Mead",
        options={"initial_simplex": simplex, "xatol": 0.2, "fatol": 0.5, "maxfev": 60},
    )
    return of(found.x)


def smooth(
    poses: np.ndarray,
    covariances: np.ndarray,
    seen: np.ndarray,
    times: np.ndarray,
    centre: np.ndarray,
    motion: Motion,
) -> Smoothed:
    """Smooth the poses of one structure.

    Parameters
    ----------
    poses : (F, 4, 4) ndarray
        Fixed to moving.
    covariances : (F, 6, 6) ndarray
        Of [rotation (rad), translation (mm)] about the centre, on the left.
    seen : (F,) ndarray
        bool, which frames count; at least one.
    times : (F,) ndarray
        Seconds, rising.
    centre : (3,) ndarray
        LPS mm.
    motion : Motion
        How the pose may change.

    Returns
    -------
    Smoothed
        Where a frame is seen its covariance has the share of its own error that is common to all frames in it.

    References
    ----------
    H. Rauch, F. Tung and C. Striebel, "Maximum likelihood estimates of linear dynamic systems", AIAA Journal 3 (1965).
    T. Barfoot, "State Estimation for Robotics", 2017, sections 3.2 and 7.3.

    """
    filtered, likelihood = _filter(poses, covariances, seen, times, centre, motion)
    pose, velocity, spread = filtered[-1].pose, filtered[-1].velocity, filtered[-1].spread
    found = [(pose, velocity, spread)]
    for here, after in zip(filtered[-2::-1], filtered[:0:-1], strict=True):
        gain = np.linalg.solve(after.expected_spread, after.transition @ here.spread).T
        ahead = np.r_[_log(pose @ rigid_inverse(after.expected_pose)), velocity - after.expected_velocity]
        step = gain @ ahead
        spread = here.spread + gain @ (spread - after.expected_spread) @ gain.T
        pose, velocity = _exp(step[:6]) @ here.pose, here.velocity + step[6:]
        found.append((pose, velocity, spread))
    found.reverse()
    common = (1 - motion.share) * covariances * seen[:, None, None]
    if not seen.all():  # what frames share, the nearest one shares too
        places = np.flatnonzero(seen)
        for n in np.flatnonzero(~seen):
            common[n] = common[places[np.abs(places - n).argmin()]]
    forth = np.eye(4)
    forth[:3, 3] = centre
    return Smoothed(
        np.stack([forth @ each[0] for each in found]),
        np.stack([each[2][:6, :6] for each in found]) + common,
        np.stack([each[1] for each in found]),
        likelihood,
    )


@dataclass(frozen=True)
class _Filtered:
    """The filter at one frame: as expected from the frame before, the transition from there, and with its own pose.

    Poses have the centroid as the origin of their moving frame; spreads are (12, 12) of [pose, velocity].
    """

    expected_pose: np.ndarray
    expected_velocity: np.ndarray
    expected_spread: np.ndarray
    transition: np.ndarray
    pose: np.ndarray
    velocity: np.ndarray
    spread: np.ndarray


def _filter(
    poses: np.ndarray,
    covariances: np.ndarray,
    seen: np.ndarray,
    times: np.ndarray,
    centre: np.ndarray,
    motion: Motion,
) -> tuple[list[_Filtered], float]:
    """The forward filter, and the logarithm of the frames' likelihood."""
    back = np.eye(4)
    back[:3, 3] = -centre
    observed = back @ poses
    first = int(np.flatnonzero(seen)[0])
    pose, velocity = observed[first], np.zeros(6)
    # Before its first observation nothing is known of a pose but that it is within reach of it.
    spread = np.diag(np.r_[np.full(3, 1.0), np.full(3, 100.0), np.repeat(UNKNOWN_VELOCITY, 3)] ** 2)
    density = np.diag(np.repeat(motion.acceleration, 3))
    filtered, likelihood = [], 0.0
    for n in range(len(times)):
        transition = np.eye(12)
        if n > 0:
            passed = times[n] - times[n - 1]
            step = passed * velocity
            transition[:6, :6], transition[:6, 6:] = _adjoint(step), passed * _left_jacobian(step)
            pose = _exp(step) @ pose
            noise = np.block(
                [
                    [passed**3 / 3 * density, passed**2 / 2 * density],
                    [passed**2 / 2 * density, passed * density],
                ]
            )
            spread = transition @ spread @ transition.T + noise
        expected = pose, velocity, spread
        if seen[n]:
            innovation = _log(observed[n] @ rigid_inverse(pose))
            total = spread[:6, :6] + motion.share * covariances[n]
            gain = np.linalg.solve(total, spread[:6]).T
            step = gain @ innovation
            pose, velocity = _exp(step[:6]) @ pose, velocity + step[6:]
            left = np.eye(12)
            left[:, :6] -= gain
            spread = left @ spread @ left.T + motion.share * gain @ covariances[n] @ gain.T
            if n > first:
                _, determinant = np.linalg.slogdet(total)
                likelihood -= 0.5 * (
                    float(innovation @ np.linalg.solve(total, innovation)) + float(determinant)
                )
        filtered.append(_Filtered(*expected, transition, pose, velocity, spread))
    return filtered, likelihood


def _exp(vector: np.ndarray) -> np.ndarray:
    """(4, 4) motion of a logarithm [rotation (rad), translation part (mm)]."""
    motion = np.eye(4)
    motion[:3, :3] = rotation_matrix(vector[:3])
    motion[:3, 3] = _series(skew(vector[:3])) @ vector[3:]
    return motion


def _log(motion: np.ndarray) -> np.ndarray:
    """(6,) logarithm of a motion."""
    rotation = rotation_vectors(motion[:3, :3])
    return np.r_[rotation, np.linalg.solve(_series(skew(rotation)), motion[:3, 3])]


def _adjoint(vector: np.ndarray) -> np.ndarray:
    """(6, 6) of the motion with this logarithm (6,): ad J + I, with ad the logarithm's own."""
    own = _own_adjoint(vector)
    return np.eye(6) + own @ _series(own)


def _left_jacobian(vector: np.ndarray) -> np.ndarray:
    """(6, 6) at a logarithm (6,)."""
    return _series(_own_adjoint(vector))


def _own_adjoint(vector: np.ndarray) -> np.ndarray:
    """(6, 6) ad of a logarithm (6,)."""
    own = np.zeros((6, 6))
    own[:3, :3] = own[3:, 3:] = skew(vector[:3])
    own[3:, :3] = skew(vector[3:])
    return own


def _series(matrix: np.ndarray) -> np.ndarray:
    """Sum of matrix^n / (n + 1)!, to the last digit for rotations up to half a turn; faster than torch for one."""
    identity = np.eye(len(matrix))
    total = identity
    for n in range(TERMS, 0, -1):
        total = identity + matrix @ total / (n + 1)
    return total
