"""Which of two sets of poses a frame's X-rays agree with better, structure by structure."""

from __future__ import annotations

import numpy as np

from PolyPoseLib.geometry.rigid import rigid_inverse
from PolyPoseLib.registration.fit.problem import State
from PolyPoseLib.registration.fit.views import REACH_MM
from PolyPoseLib.registration.fit.weighting import region_around, reliability
from PolyPoseLib.tracking.frame_fit import FINE, Frame, LevelFit

BETTER = 0.005
"""Share of the cost by which the second poses must be better: equal ones are not exchanged."""


def better_poses(frame: Frame, first: np.ndarray, second: np.ndarray, which: list[int]) -> np.ndarray:
    """Choose between two poses of each structure by the image cost.

    Both are compared over the same pixels, around either, so that a structure which is nowhere to be seen does not win;
    each with the soft tissue that follows it.

    Parameters
    ----------
    frame : Frame
        The X-rays, not all of them blank.
    first, second : (K, 4, 4) ndarray
        In the scene; the first is kept where the second is not better.
    which : list of int
        Structures for which it may be taken; the others have the first's pose in any case.

    Returns
    -------
    (K,) ndarray
        bool, where the second's is taken.

    """
    patient = frame.patient
    base = first[patient.reference]
    level = LevelFit(patient, frame.around([first, second], base), FINE, ())
    states = [
        State.of_poses(each @ rigid_inverse(base), len(level.problem.views)) for each in (first, second)
    ]
    for n, view in enumerate(level.problem.views):
        regions = [region_around(level.problem, state, n, range(len(first)), REACH_MM) for state in states]
        region = np.logical_or(*regions) & (view.contrast.support > 0)
        view.weight = np.where(region, reliability(view), 0).astype(np.float32)

    def cost(taken: np.ndarray) -> float:
        poses = np.where(taken[:, None, None], states[1].poses, states[0].poses)
        state = State(poses, states[0].corrections)
        level.follow(state)
        return level.problem.cost(state)

    taken = np.zeros(len(first), bool)
    everything = taken.copy()
    everything[which] = True
    best = cost(taken) * (1 - BETTER)
    if len(which) > 1 and (together := cost(everything)) < best:
        taken, best = everything, together
    for k in which:
        other = taken.copy()
        other[k] = not other[k]
        found = cost(other)
        if found < best * (1 if taken[k] else 1 - BETTER):
            taken, best = other, found
    return taken
