"""What an attribute with one value a frame adds for one frame of a run."""

from __future__ import annotations

import re

from PolyPoseLib.data.notes import Notes
from PolyPoseLib.io.xray.tags import XrayTags


def frame_increment(tags: XrayTags, keyword: str, notes: Notes) -> float:
    """Increment that holds for this frame; 0 when the file has none.

    Parameters
    ----------
    tags
        The frame's attributes.
    keyword
        Of an attribute such as Positioner Primary Angle Increment (0018,1520).
    notes
        Receives a warning where the file does not have as many increments as frames, and they are not all 0.

    """
    values = tags.numbers(keyword) or ()
    frames = tags.number("NumberOfFrames") or 1
    if not any(values):
        return 0.0
    if len(values) == frames:
        return values[tags.frame]
    used = min(tags.frame, len(values) - 1)
    notes.warn(
        f"the run has {frames:.0f} frames but {len(values)} values of {_in_words(keyword)}: number {used} (counted "
        f"from 0) was used for frame {tags.frame}, and the direction may be wrong by as much as the run turned; give "
        '"primary_angle_deg" and "secondary_angle_deg" of this frame.'
    )
    return values[used]


def _in_words(keyword: str) -> str:
    """An attribute's name as the standard writes it."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", keyword)
