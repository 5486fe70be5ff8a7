"""Bones followed from frame to frame: a sequence goes in, a track comes out."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np

from PolyPoseLib.data.progress import CancelQuery, Monitor, ProgressCallback
from PolyPoseLib.data.result import installed_versions
from PolyPoseLib.data.tracking import sequence as data
from PolyPoseLib.data.tracking.track import Track, TrackedFrame
from PolyPoseLib.errors import InputError
from PolyPoseLib.registration.fit.levels import Level
from PolyPoseLib.tracking.assessment import Assessment, assess, usual_step
from PolyPoseLib.tracking.backward import corrected_backward
from PolyPoseLib.tracking.comparison import better_poses
from PolyPoseLib.tracking.contradicted import with_contradictions
from PolyPoseLib.tracking.first_frame import starting_poses
from PolyPoseLib.tracking.frame_fit import ARRIVING, FOLLOWING, Frame
from PolyPoseLib.tracking.gaps import bridged
from PolyPoseLib.tracking.jumps import with_jumps
from PolyPoseLib.tracking.outcome import lost_frame, tracked_frame
from PolyPoseLib.tracking.patient import Patient
from PolyPoseLib.tracking.prediction import is_found, predicted_poses
from PolyPoseLib.tracking.recovery import fit_again
from PolyPoseLib.tracking.smoother import smoothed_frames
from PolyPoseLib.tracking.summary import reasons_for_distrust, warnings_about

REMEMBERED = 20
"""Frames before one that its fit may look at."""

UNEVEN_MM = 5.0
"""Usual change of a structure's step from frame to frame, mm of the scene, beyond which its prediction is rough."""

Keep = Callable[[TrackedFrame], None]
"""Called once with every frame that is fitted for good in the forward pass."""


def track(
    sequence: data.Sequence,
    progress: ProgressCallback | None = None,
    cancel: CancelQuery | None = None,
    done: Iterable[TrackedFrame] = (),
    keep: Keep | None = None,
) -> Track:
    """Find the poses of all structures in all frames.

    Parameters
    ----------
    sequence : Sequence
        Valid by construction. One frame's images are in memory at a time.
    progress : callable, optional
        Called with a Progress after every frame.
    cancel : callable, optional
        Asked several times a frame; True ends the tracking.
    done : iterable of TrackedFrame
        Frames of the forward pass of an earlier run of the same sequence, from its first one on: the others follow as
        if that run had not been interrupted.
    keep : callable, optional
        Takes every further frame as soon as the forward pass is through with it.

    Returns
    -------
    Track
        ``track.distrust`` says why it must not be trusted, when it must not.

    Raises
    ------
    InputError
        An image that cannot be used, an option that cannot be met on this machine, or frames of another sequence.
    CancelledError
        ``cancel`` returned True.

    """
    monitor = Monitor(progress, cancel)
    monitor.step("preparing", 0, 1, None)
    patient = Patient(sequence, monitor)
    frames = _forward(patient, list(done), keep)
    if sequence.options.backward:
        frames = corrected_backward(patient, frames)
    frames = with_contradictions(patient, with_jumps(patient, bridged(patient, frames)))
    centroids = sequence.structures.centroids(sequence.ct.affine)
    if sequence.options.smooth:
        frames = smoothed_frames(frames, centroids, sequence.frames_per_second)
    monitor.step("done", 1, 1, 1 - float(np.mean([each.residuals for each in frames])))
    return Track(
        names=patient.scene.names,
        reference=sequence.reference,
        centroids=centroids,
        frames=tuple(frames),
        frames_per_second=sequence.frames_per_second,
        cameras={view.name: view.camera for view in sequence.views},
        smoothed=sequence.options.smooth,
        warnings=(*sequence.warnings, *warnings_about(patient, frames)),
        distrust=tuple(reasons_for_distrust(patient, frames)),
        device=f"{patient.device}, {patient.run.backend.name}",
        versions=installed_versions(),
    )


def _forward(patient: Patient, frames: list[TrackedFrame], keep: Keep | None) -> list[TrackedFrame]:
    """All frames in the order of time, after those that are there already."""
    numbers = patient.sequence.frames
    _require_same(patient, frames)
    for number in numbers[len(frames) :]:
        similarity = 1 - float(frames[-1].residuals.mean()) if frames else None
        patient.run.step(len(frames), len(numbers), similarity)
        before = time.process_time()
        found = _next(patient, number, frames[-REMEMBERED:])
        found = replace(found, cpu_seconds=time.process_time() - before)
        frames.append(found)
        if keep is not None:
            keep(found)
    patient.run.step(len(numbers), len(numbers), 1 - float(frames[-1].residuals.mean()))
    return frames


def _require_same(patient: Patient, frames: Sequence[TrackedFrame]) -> None:
    """Refuse frames that cannot be the beginning of this sequence; raises InputError."""
    numbers = list(patient.sequence.frames)[: len(frames)]
    count = len(patient.scene.names)
    if [each.frame for each in frames] != numbers or any(
        each.poses.shape != (count, 4, 4) for each in frames
    ):
        raise InputError(
            "The frames that were kept belong to another sequence or to other options: remove them, and start anew."
        )


def _next(patient: Patient, number: int, past: Sequence[TrackedFrame]) -> TrackedFrame:
    """One frame after those before it."""
    frame = Frame(patient, number)
    if not past:
        return _first(patient, frame)
    options = patient.sequence.options
    centres = patient.sequence.structures.centroids(patient.sequence.ct.affine)
    moves_on = options.prediction == "constant_velocity"
    predicted = predicted_poses(past, centres, patient.reference, moves_on)
    if not frame.observations:
        return lost_frame(patient, number, predicted, "no camera shows anything in this frame", past[-1])
    start = patient.enlarged(predicted)
    found = assess(patient, frame.fit(start, _levels(patient, past), patient.moving), start, past)
    sources = ["forward"] * len(start)
    if found.suspects:
        places = [start, patient.enlarged(past[-1].poses)]
        if any(past[-1].doubts[k] or not is_found(past[-1], k) for k in found.suspects):
            places += [patient.enlarged(each.poses) for each in past[-3:-1]]
        found, sources = look_again(frame, found, start, past, places)
    return tracked_frame(patient, number, found, predicted, sources, past)


def _levels(patient: Patient, past: Sequence[TrackedFrame]) -> tuple[Level, ...]:
    """From coarser pixels on where no velocity is known yet, or where velocities change by too much for fine ones."""
    if len(past) < 2 or max(usual_step(patient, past, k) for k in patient.moving) > UNEVEN_MM:
        return ARRIVING
    return FOLLOWING


def look_again(
    frame: Frame,
    found: Assessment,
    predicted: np.ndarray | None,
    beside: Sequence[TrackedFrame],
    places: Sequence[np.ndarray],
) -> tuple[Assessment, list[str]]:
    """Try other starts for suspects; returns the better poses with what is known of them, and where they come from."""
    patient = frame.patient
    again = fit_again(frame, found.fit.poses, found.suspects, places)
    taken = better_poses(frame, found.fit.poses, again.poses, patient.moving)
    if not taken.any():
        return found, ["forward"] * len(taken)
    fit = again
    if not taken[patient.moving].all():
        mixed = np.where(taken[:, None, None], again.poses, found.fit.poses)
        fit = frame.fit(mixed, FOLLOWING[-1:], patient.moving)
    sources = ["restart" if each else "forward" for each in taken]
    return assess(patient, fit, predicted, beside), sources


def _first(patient: Patient, frame: Frame) -> TrackedFrame:
    """The first frame, from where its structures were put or are found."""
    if not frame.observations:
        raise InputError(
            f"No camera shows anything in frame {frame.number}, the first one: start with another by the option "
            '"first".'
        )
    registers = patient.sequence.options.start == "registration"
    start = starting_poses(patient, frame if registers else None)
    free = [k for k in range(len(start)) if k not in patient.vouched]
    levels = FOLLOWING if registers else ARRIVING
    found = assess(patient, frame.fit(start, levels, free), None, ())
    sources = ["forward"] * len(start)
    if found.suspects:
        found, sources = look_again(frame, found, None, (), [start])
        if "restart" in sources and free != patient.moving:  # what stands still is free in this frame alone
            found = assess(patient, frame.fit(found.fit.poses, FOLLOWING[-1:], free), None, ())
    for k in patient.vouched:
        sources[k] = "given"
    return tracked_frame(patient, frame.number, found, patient.at_true_size(start), sources, ())
