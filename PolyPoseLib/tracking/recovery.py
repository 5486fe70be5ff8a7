"""A frame in which structures were lost, looked at again from other starting poses."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from PolyPoseLib.geometry.rigid import about, perturbation, rigid_inverse
from PolyPoseLib.registration.bones.restarts import best_of
from PolyPoseLib.registration.fit.levels import Level
from PolyPoseLib.registration.fit.problem import State
from PolyPoseLib.tracking.frame_fit import FOLLOWING, Frame, FrameFit, LevelFit

TURN_DEG, SHIFT_MM = 12.0, 12.0
"""Rotations about a structure's centroid, and shifts, of the starts about a pose; mm of the scene."""

RESTART = Level(4.0, 28.0, 10)
"""At which structures are started again one by one."""

TOGETHER = Level(6.0, 40.0, 8)
"""At which all are started again as one."""

TOGETHER_TURN_DEG, TOGETHER_SHIFT_MM = 12.0, 20.0
"""Rotations and shifts of all structures as one."""

_AXES = tuple(sign * axis for axis in np.eye(3) for sign in (-1.0, 1.0))


def fit_again(
    frame: Frame, poses: np.ndarray, suspects: Sequence[int], places: Sequence[np.ndarray]
) -> FrameFit:
    """Fit a frame whose structures may be in a wrong local minimum.

    Each suspect is started from every place, and about the first of them, with the others where they are; where most
    are suspects, all that move are moved as one before, as a patient moves.

    Parameters
    ----------
    frame : Frame
        The X-rays, not all of them blank.
    poses : (K, 4, 4) ndarray
        As they were found.
    suspects : sequence of int
        Indices of the structures in question.
    places : sequence of (K, 4, 4) ndarray
        Poses of frames beside it; at least one, the likeliest first.

    Returns
    -------
    FrameFit
        Of the best starts, which may be no better than what was found before.

    """
    patient = frame.patient
    moving = patient.moving
    poses = poses.copy()
    if 2 * len([k for k in suspects if k in moving]) > len(moving):
        poses = _moved_as_one(frame, [poses, *places])
        places = [poses, *places]
    base = poses[patient.reference]
    places = [each @ rigid_inverse(base) for each in places]
    spread = [poses, *(each @ base for each in places)]
    level = LevelFit(patient, frame.around(spread, base), RESTART, moving)
    state = State.of_poses(poses @ rigid_inverse(base), len(level.problem.views))
    level.refresh(state)
    for k in sorted(suspects, key=lambda k: -patient.radii[k]):
        patient.run.monitor.poll()
        starts = [state.poses[k], *_starts([each[k] for each in places], patient.scene.centres[k])]
        found = best_of(level.problem, state, k, starts, RESTART.iterations)
        if found is not None:
            state = state.with_pose(k, found)
    return frame.fit(state.poses @ base, FOLLOWING, moving)


def _moved_as_one(frame: Frame, places: Sequence[np.ndarray]) -> np.ndarray:
    """(K, 4, 4) poses of the best fit from places, and from the second of them moved as a whole.

    What stands still stays where it is in the first.
    """
    patient = frame.patient
    middle = (
        rigid_inverse(places[1])[:, :3] @ np.c_[patient.scene.centres, np.ones(len(places[0]))][..., None]
    ).mean(axis=0)[:, 0]
    starts = [each.copy() for each in places]
    for axis in _AXES:
        turn = perturbation(np.r_[np.radians(TOGETHER_TURN_DEG) * axis, np.zeros(3)])
        shift = perturbation(np.r_[np.zeros(3), TOGETHER_SHIFT_MM * axis])
        starts += [places[1] @ about(turn, middle), places[1] @ shift]
    best, least = places[0], np.inf
    for start in starts:
        patient.run.monitor.poll()
        start[patient.still] = places[0][patient.still]
        fit = frame.fit(start, [TOGETHER], patient.moving)
        residuals = np.where(np.isnan(fit.agreement.residuals), 2.0, fit.agreement.residuals)
        if residuals.mean() < least:
            best, least = fit.poses, float(residuals.mean())
    return best


def _starts(places: Sequence[np.ndarray], centre: np.ndarray) -> Iterator[np.ndarray]:
    """Poses (4, 4): the places, and the first of them turned and shifted."""
    yield from places
    for axis in _AXES:
        yield about(perturbation(np.r_[np.radians(TURN_DEG) * axis, np.zeros(3)]), centre) @ places[0]
        yield about(perturbation(np.r_[np.zeros(3), SHIFT_MM * axis]), centre) @ places[0]
