"""What the Motion section says of a plan, a run and a track, in the words of the person who waits."""

from __future__ import annotations

from typing import TYPE_CHECKING

from slicer.i18n import tr as _

from ..process.track_run import TrackRun
from ..study.track_plan import TrackPlan
from .verdict import CHECK, DISTRUSTED, FINE, Verdict

if TYPE_CHECKING:
    from PolyPoseLib.data.tracking.track import Track, TrackedFrame


def state_text(plan: TrackPlan) -> str:
    """The sequences, and what is odd about them, one line each."""
    lines = [
        _("{name}: {count} images; frame 0 is image {first}.").format(
            name=each.name, count=each.count, first=each.first + 1
        )
        for each in plan.cameras
    ]
    return "\n".join([*lines, *plan.notes])


def done_text(run: TrackRun) -> str:
    """What came of a run: its frames and time, or why its track must not be trusted; and what its folder lacks."""
    return "\n".join([_outcome(run), *_left_out(run.log)])


def _left_out(log: list[str]) -> list[str]:
    """The child's sentences about files that it could not make, an overlay video without PyAV for one."""
    from PolyPoseLib.io.tracking.tracks import WITHOUT

    return [line[line.index(WITHOUT) :] for line in log if WITHOUT in line]


def _outcome(run: TrackRun) -> str:
    if run.error is not None:
        return str(run.error)
    frames = len(run.track.frames) if run.track is not None else 0
    seconds = run.progress.seconds if run.progress is not None else 0.0
    return _("{frames} frames are tracked, in {seconds:.0f} s.").format(frames=frames, seconds=seconds)


def track_verdict(track: Track) -> Verdict:
    """The verdict on a track, with how often each bone was lost or doubtful among its lines."""
    from PolyPoseLib.data.tracking.summary import summary_of

    counts = [
        _("{name}: {doubtful} doubtful frames, lost in {lost} of them.").format(
            name=each.name, lost=each.lost, doubtful=each.doubtful
        )
        for each in summary_of(track)
        if each.doubtful
    ]
    warnings = [_("Warning: {text}").format(text=each) for each in track.warnings]
    if track.distrust:
        reasons = [_("Why: {why}").format(why=each) for each in track.distrust]
        advice = _("What to do: correct a doubtful frame and track on from there, or give better cameras.")
        return Verdict(_("DO NOT TRUST THIS TRACK"), (*reasons, *counts, advice, *warnings), *DISTRUSTED)
    if counts or warnings:
        return Verdict(_("Check the doubtful frames before you use the track"), (*counts, *warnings), *CHECK)
    advice = _("Look at the outlines on the X-rays all the same.")
    return Verdict(_("The checks found no sign of failure"), (advice,), *FINE)


def frame_text(frame: TrackedFrame | None, names: tuple[str, ...], number: int, corrected: list[str]) -> str:
    """What is known of the poses of one frame."""
    lines = [_("Frame {number}").format(number=number)]
    if frame is not None:
        for name, source, doubts in zip(names, frame.sources, frame.doubts, strict=True):
            if source == "none":
                lines.append(_("{name} was lost.").format(name=name))
            elif doubts:
                lines.append(_("{name} is doubtful: {why}.").format(name=name, why="; ".join(doubts)))
    if corrected:
        lines.append(_("Corrected by hand: {names}.").format(names=", ".join(corrected)))
    return "\n".join(lines)
