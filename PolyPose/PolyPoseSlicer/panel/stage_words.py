"""What the core is doing, in the words of the person who waits."""

from __future__ import annotations

from slicer.i18n import tr as _

from PolyPoseLib.data.progress import Progress

SAVING = "done"
"""The core's last stage: it has the result and writes the files."""

_CAMERA = "camera "


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


def _stage(name: str) -> str:
    """A stage of the core; one that is not known bears its own name."""
    if name.startswith(_CAMERA):
        return _("Camera of {name}").format(name=name.removeprefix(_CAMERA))
    known = {
        "preparing": _("Preparing the CT"),
        "bones": _("Fitting the bones"),
        "restarts": _("Looking for better places of bones"),
        "uncertainty": _("Estimating the uncertainty"),
        "warping": _("Warping the CT"),
        "rendering": _("Rendering the X-rays"),
    }
    return known.get(name, name)
