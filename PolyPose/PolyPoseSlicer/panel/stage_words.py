"""What the core is doing, in the words of the person who waits."""

from __future__ import annotations

from slicer.i18n import tr as _

from PolyPoseLib.data.progress import Progress

SAVING = "done"
"""The core's last stage: it has the result and writes the files."""

_CAMERA = "camera "
_PASSES = ("tracking", "tracking back")


def stage_text(progress: Progress) -> str:
    """What is going on, how far it is, and the similarity where there is one."""
    if progress.stage == SAVING:
        return _("Saving the result...")
    text = _("{stage}: {iteration} of {of}").format(
        stage=_stage(progress.stage), iteration=progress.iteration, of=progress.of
    )
    if progress.similarity is not None:
        text += _(", similarity {similarity:.4f}").format(similarity=progress.similarity)
    return text


def track_stage_text(progress: Progress, seconds_left: float | None) -> str:
    """The same of a tracking, with how long the present pass over the frames still takes, where that is known."""
    if progress.stage == SAVING:
        return _("Saving the track...")
    if progress.stage not in _PASSES:
        return stage_text(progress)
    frame = min(progress.iteration + 1, progress.of)
    text = (
        _("Tracking: {frame} of {of} frames")
        if progress.stage == "tracking"
        else _("Back: {frame} of {of} frames")
    )
    text = text.format(frame=frame, of=progress.of)
    return text if seconds_left is None else f"{text}, {_left(seconds_left)}"


def _left(seconds: float) -> str:
    if seconds < 90:
        return _("about {seconds:.0f} s left in this pass").format(seconds=max(seconds, 1))
    return _("about {minutes:.0f} min left in this pass").format(minutes=seconds / 60)


def _stage(name: str) -> str:
    """A stage of the core; one that is not known bears its own name."""
    if name.startswith(_CAMERA):
        return _("Camera of {name}").format(name=name.removeprefix(_CAMERA))
    known = {
        "preparing": _("Preparing the CT"),
        "bones": _("Fitting the bones"),
        "restarts": _("Looking for better places of bones"),
        "united bones": _("Looking at united bones one by one"),
        "uncertainty": _("Estimating the uncertainty"),
        "warping": _("Warping the CT"),
        "rendering": _("Rendering the X-rays"),
    }
    return known.get(name, name)
