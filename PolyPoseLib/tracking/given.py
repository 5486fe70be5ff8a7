"""Poses that somebody gave for structures that stand still: taken as they are, and compared with one frame's X-rays."""

from __future__ import annotations

from collections.abc import Iterator

from PolyPoseLib.data.tracking.track import TrackedFrame
from PolyPoseLib.registration.bones.agreement import agreement_in
from PolyPoseLib.tracking.frame_fit import Frame
from PolyPoseLib.tracking.patient import Patient


def given_warnings(patient: Patient, first: TrackedFrame) -> Iterator[str]:
    """Warnings about given poses which the X-rays of the first frame contradict.

    No frame flags them: somebody vouches for them, and they are not fitted.

    Parameters
    ----------
    patient : Patient
        What was tracked.
    first : TrackedFrame
        The first frame, whose images are read again.

    Yields
    ------
    str
        A sentence a structure.

    """
    if not patient.vouched:
        return
    frame = Frame(patient, first.frame)
    if not frame.observations:
        return
    against = agreement_in(*frame.posed(patient.enlarged(first.poses))).contradicted
    names = [patient.sequence.views[n].name for n in frame.shown]
    for k in patient.vouched:
        cameras = [f'"{name}"' for name, each in zip(names, against[k], strict=True) if each]
        if cameras:
            yield (
                f'"{patient.scene.names[k]}" stands still at the pose that was given, which frame {first.frame} of the '
                f"camera {' and '.join(cameras)} does not match: check that pose, or let the structure move."
            )
