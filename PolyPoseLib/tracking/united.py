"""Structures of a track that unite bones which move against each other."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from PolyPoseLib.data.tracking.track import TrackedFrame
from PolyPoseLib.registration.bones.agreement import Agreement, agreement_in
from PolyPoseLib.registration.bones.parts import agreement_of_bones, united_bones
from PolyPoseLib.registration.uncertainty.united import UnitedBones
from PolyPoseLib.tracking.frame_fit import Frame
from PolyPoseLib.tracking.patient import Patient
from PolyPoseLib.tracking.prediction import is_found

LOOKED_AT = 8
"""Frames in which united bones are compared one by one, evenly spread over the track."""

LEAST = 2
"""Of them, in which a bone is off before it is worth a word, where there are so many."""


def united_warnings(patient: Patient, frames: Sequence[TrackedFrame]) -> Iterator[str]:
    """Warnings about structures that unite bones which moved against each other.

    Parameters
    ----------
    patient : Patient
        What was tracked.
    frames : sequence of TrackedFrame
        Of which up to LOOKED_AT are looked at; their images are read again.

    Yields
    ------
    str
        A sentence a structure, about the frame in which its bones are farthest off.

    Raises
    ------
    CancelledError
        The caller wants to stop.

    """
    bones = united_bones(patient.scene, patient.sequence.source_segmentation)
    if not bones:
        return
    run = patient.run.named("united bones")
    found: dict[int, list[tuple[int, Agreement]]] = {k: [] for k in bones}
    chosen = _spread(frames)
    for n, each in enumerate(chosen):
        run.step(n, len(chosen))
        frame = Frame(patient, each.frame)
        known = {k: united for k, united in bones.items() if is_found(each, k)}
        if frame.observations and known:
            problem, state = frame.posed(patient.enlarged(each.poses))
            parts = agreement_of_bones(problem, state, known)
            agreement = replace(agreement_in(problem, state), parts=parts)
            for k in known:
                found[k].append((each.frame, agreement))
    for k, compared in found.items():
        off = [pair for pair in compared if pair[1].parts_off(k)]
        if off and len(off) >= min(LEAST, len(compared)):
            number, agreement = max(off, key=lambda pair: _largest_shift_mm(pair[1], k))
            united = UnitedBones(
                patient.scene.names,
                agreement,
                magnification=patient.factor,
                label_names=patient.sequence.label_names,
            )
            yield united.warning(k, f" in frame {number} ({len(off)} of {len(compared)} frames looked at)")


def _largest_shift_mm(agreement: Agreement, k: int) -> float:
    """Of the bones of structure k that are off."""
    return max(part.shift_mm for part in agreement.parts_off(k))


def _spread(frames: Sequence[TrackedFrame]) -> list[TrackedFrame]:
    """Up to LOOKED_AT frames, evenly spread, the first and the last with them."""
    count = min(LOOKED_AT, len(frames))
    return [frames[n] for n in np.linspace(0, len(frames) - 1, count).round().astype(int)]
