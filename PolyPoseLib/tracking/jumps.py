"""Frames whose poses do not lie between those beside them are flagged at the end, when all poses are known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from PolyPoseLib.data.tracking.track import TrackedFrame
from PolyPoseLib.geometry.rigid import perturbation_between
from PolyPoseLib.tracking.assessment import JUMP_MM, JUMPS, SURE, distance_mm
from PolyPoseLib.tracking.patient import Patient
from PolyPoseLib.tracking.prediction import between_poses, is_found

BESIDE = "mm from the middle of its poses in the frames beside it"
"""How the line about a jump ends."""


def with_jumps(patient: Patient, frames: Sequence[TrackedFrame]) -> list[TrackedFrame]:
    """The frames, with a doubt about every pose that is far from the middle of its neighbours'."""
    marked = list(frames)
    for k in patient.moving:
        centre = patient.scene.centres[k]
        away = np.zeros(len(frames))
        certain = np.zeros(len(frames), bool)
        for n in range(1, len(frames) - 1):
            three = frames[n - 1 : n + 2]
            if not all(is_found(each, k) for each in three):
                continue
            before, here, after = (patient.enlarged(each.poses[k]) for each in three)
            middle = between_poses(before, after, 0.5, centre)
            away[n] = distance_mm(patient, middle, here, k)
            delta = perturbation_between(
                patient.at_true_size(middle), frames[n].poses[k], centre / patient.factor
            )
            spread = sum(each.covariances[k] for each in three)
            certain[n] = delta @ np.linalg.solve(spread, delta) > SURE**2
        usual = float(np.quantile(away[away > 0], 0.25)) if (away > 0).any() else 0.0
        for n in np.flatnonzero((away > max(JUMP_MM, JUMPS * usual)) & certain):
            distance = away[n] / patient.factor
            line = f"it is {distance:.1f} {BESIDE}"
            doubts = list(marked[n].doubts)
            doubts[k] = (*doubts[k], line)
            marked[n] = replace(marked[n], doubts=tuple(doubts))
    return marked


def without_jumps(frame: TrackedFrame) -> TrackedFrame:
    """A frame without the doubts that :func:`with_jumps` added."""
    doubts = (tuple(line for line in lines if not line.endswith(BESIDE)) for lines in frame.doubts)
    return replace(frame, doubts=tuple(doubts))
