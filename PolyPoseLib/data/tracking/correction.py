"""A frame of a track that somebody corrected by hand, and which frames are tracked anew from there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from PolyPoseLib.data.tracking.track import Track, TrackedFrame
from PolyPoseLib.errors import InputError, unknown_name
from PolyPoseLib.geometry.rigid import require_rigid

DIRECTIONS = ("forward", "backward", "both")
"""Which way time goes from the corrected frame."""


@dataclass(frozen=True, eq=False)
class Correction:
    """An earlier track, and the poses that one of its frames should have; a correction that exists is valid.

    Parameters
    ----------
    track : Track
        Of the same sequence, whose other frames are kept. It must not be smoothed.
    frame : int
        Number of the corrected frame.
    poses : mapping of str to (4, 4) array
        Of corrected structures, the rig's world (fixed) to the CT's LPS mm (moving), as good as a hand places them.
        The other structures start at the earlier track's poses.
    direction : {"forward", "backward", "both"}
        Which way time goes from that frame.
    until : int, optional
        Number of the last frame that is tracked anew, the frame itself or one on its side: with "both" it bounds the
        side on which it lies. None for the end of the track.

    Raises
    ------
    InputError
        A frame or a structure that the track does not have, a pose that is none, or a smoothed track.

    """

    track: Track
    frame: int
    poses: Mapping[str, np.ndarray] = field(default_factory=dict)
    direction: str = "both"
    until: int | None = None

    def __post_init__(self) -> None:
        """Check the values; raises InputError."""
        if self.direction not in DIRECTIONS:
            raise InputError(unknown_name("direction", self.direction, DIRECTIONS))
        if self.track.smoothed:
            raise InputError(
                "The earlier track was smoothed, so that its own poses are gone: correct a track without smoothing, "
                "and smooth with the last correction."
            )
        numbers = [each.frame for each in self.track.frames]
        for number, what in ((self.frame, "The corrected frame"), (self.until, "The frame to end at")):
            if number is not None and number not in numbers:
                raise InputError(
                    f"{what}, {number}, is none of the track's: give one from {numbers[0]} to {numbers[-1]}."
                )
        if self.until is not None and (
            (self.direction == "forward" and self.until < self.frame)
            or (self.direction == "backward" and self.until > self.frame)
        ):
            side = "before" if self.until < self.frame else "after"
            raise InputError(
                f"The frame to end at, {self.until}, lies {side} frame {self.frame}, and the direction is "
                f'"{self.direction}": change one of them.'
            )
        poses = {}
        for name, pose in self.poses.items():
            if name not in self.track.names:
                raise InputError(unknown_name("structure", str(name), self.track.names))
            poses[name] = require_rigid(pose, f'The corrected pose of "{name}"')
        object.__setattr__(self, "poses", poses)

    @property
    def corrected(self) -> TrackedFrame:
        """The earlier track's frame."""
        return next(each for each in self.track.frames if each.frame == self.frame)

    @property
    def renewed(self) -> range:
        """Numbers of the frames that are tracked anew, the corrected one among them."""
        first, last = self.track.frames[0].frame, self.track.frames[-1].frame
        if self.until is not None:
            first = self.until if self.until <= self.frame else first
            last = self.until if self.until >= self.frame else last
        first = self.frame if self.direction == "forward" else first
        last = self.frame if self.direction == "backward" else last
        return range(first, last + 1)
