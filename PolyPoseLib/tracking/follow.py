"""Bones followed from frame to frame: a sequence goes in, a track comes out."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from PolyPoseLib.data.progress import CancelQuery, Monitor, ProgressCallback
from PolyPoseLib.data.result import installed_versions
from PolyPoseLib.data.tracking import sequence as data
from PolyPoseLib.data.tracking.correction import Correction
from PolyPoseLib.data.tracking.same_sequence import require_same_sequence
from PolyPoseLib.data.tracking.track import Corrected, Track, TrackedFrame
from PolyPoseLib.tracking.backward import looked_at_again
from PolyPoseLib.tracking.continuation import joined, tracked_on
from PolyPoseLib.tracking.contradicted import with_contradictions
from PolyPoseLib.tracking.gaps import bridged
from PolyPoseLib.tracking.given import given_warnings
from PolyPoseLib.tracking.jumps import with_jumps
from PolyPoseLib.tracking.kept import Keep, Kept
from PolyPoseLib.tracking.one_frame import first_frame
from PolyPoseLib.tracking.patient import Patient
from PolyPoseLib.tracking.smoother import smoothed_frames
from PolyPoseLib.tracking.summary import reasons_for_distrust, warnings_about
from PolyPoseLib.tracking.sweep import Course, swept
from PolyPoseLib.tracking.united import united_warnings


def track(
    sequence: data.Sequence,
    progress: ProgressCallback | None = None,
    cancel: CancelQuery | None = None,
    done: Iterable[TrackedFrame] = (),
    keep: Keep | None = None,
    earlier: Correction | None = None,
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
        All that an interrupted run of the same sequence gave to its ``keep``, in that order: the rest follows as if
        that run had not been interrupted.
    keep : callable, optional
        Takes every further frame as soon as a pass is through with it: those of the pass forward, then the same
        frames again on the way back.
    earlier : Correction, optional
        A track of the same sequence of which a frame was corrected by hand: tracking goes on from there, and the other
        frames are kept. Initial poses and the option "start" do not count then.

    Returns
    -------
    Track
        ``track.distrust`` says why it must not be trusted, when it must not.

    Raises
    ------
    InputError
        An image that cannot be used, an option that cannot be met on this machine, or frames or a track of another
        sequence.
    CancelledError
        ``cancel`` returned True.

    """
    monitor = Monitor(progress, cancel)
    monitor.step("preparing", 0, 1, None)
    if earlier is not None:
        require_same_sequence(sequence, earlier.track)
    patient = Patient(sequence, monitor)
    kept = Kept(len(patient.scene.names), done, keep)
    if earlier is None:
        frames = _tracked(patient, kept)
    else:
        frames = joined(patient, earlier.track.frames, tracked_on(patient, earlier, kept))
    centroids = sequence.structures.centroids(sequence.ct.affine)
    if sequence.options.smooth:
        frames = smoothed_frames(frames, centroids, sequence.frames_per_second)
    given, united = tuple(given_warnings(patient, frames[0])), tuple(united_warnings(patient, frames))
    monitor.step("done", 1, 1, 1 - float(np.nanmean([each.residuals for each in frames])))
    return Track(
        names=patient.scene.names,
        reference=sequence.reference,
        centroids=centroids,
        frames=tuple(frames),
        frames_per_second=sequence.frames_per_second,
        cameras={view.name: view.camera for view in sequence.views},
        smoothed=sequence.options.smooth,
        warnings=(*sequence.warnings, *warnings_about(patient, frames), *given, *united),
        distrust=tuple(reasons_for_distrust(patient, frames)),
        device=f"{patient.device}, {patient.run.backend.name}",
        versions=installed_versions(),
        inputs=sequence.inputs,
        corrections=_corrections(earlier),
    )


def _tracked(patient: Patient, kept: Kept) -> list[TrackedFrame]:
    """All frames, forward in time from the first one, and back."""
    first, *others = patient.sequence.frames
    patient.run.step(0, 1 + len(others), None)
    frames = [kept.frame(first, lambda: first_frame(patient, first))]
    frames = swept(patient, frames, Course(range(first + 1, first + 1 + len(others))), kept)
    if patient.sequence.options.backward:
        frames = looked_at_again(patient, frames, "backward", kept)
    return with_contradictions(patient, with_jumps(patient, bridged(patient, frames)))


def _corrections(earlier: Correction | None) -> tuple[Corrected, ...]:
    """All corrections of a track, the last one with them."""
    if earlier is None:
        return ()
    numbers = earlier.renewed
    last = Corrected(earlier.frame, tuple(earlier.poses), numbers.start, numbers.stop - 1)
    return (*earlier.track.corrections, last)
