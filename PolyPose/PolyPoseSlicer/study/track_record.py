"""A track as the scene remembers it: exactly, beside what its sequences show."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..scene.frames import flip_map
from ..scene.track_outlines import PoseState, states_of

if TYPE_CHECKING:
    from PolyPoseLib.data.tracking.track import Track


_SAME_FRAME = 1e-3
"""Slicer's file of a sequence writes the numbers of frames with so many digits."""


class TrackRecord:
    """A track in the words of the scene.

    Parameters
    ----------
    track : Track
        As PolyPoseLib reads it.

    """

    def __init__(self, track: Track) -> None:
        self.track = track
        self.names = tuple(track.names)
        self.numbers = [int(each) for each in track.numbers]
        self._rows = {number: row for row, number in enumerate(self.numbers)}

    @classmethod
    def from_text(cls, text: str) -> TrackRecord:
        """From what track.json holds; raises InputError."""
        from PolyPoseLib.io.json_records import parse_object
        from PolyPoseLib.io.tracking.track_fields import track_of

        return cls(track_of(parse_object(text, "track.json")))

    def nearest(self, frame: float) -> int:
        """The last tracked frame up to a number; the first where there is none."""
        return self.numbers[max(bisect_right(self.numbers, frame + _SAME_FRAME) - 1, 0)]

    @cached_property
    def poses(self) -> np.ndarray:
        """(F, K, 4, 4) rig's world to the CT, LPS mm; a bone without a pose is where the nearest frame has it."""
        poses = self.track.poses.copy()
        for bone in range(len(self.names)):
            known = np.flatnonzero(np.isfinite(poses[:, bone]).all(axis=(1, 2)))
            for row in np.setdiff1d(np.arange(len(poses)), known):
                nearest = known[np.argmin(np.abs(known - row))] if len(known) else None
                poses[row, bone] = np.eye(4) if nearest is None else poses[nearest, bone]
        return poses

    @cached_property
    def to_patient(self) -> np.ndarray:
        """(F, K, 4, 4) from the CT to where the frames have the bones, RAS mm."""
        return np.array([[to_patient(pose) for pose in row] for row in self.poses])

    def pose(self, name: str, frame: int) -> np.ndarray:
        """The tracked pose (4, 4) of a bone, rig's world to the CT, LPS mm."""
        return self.poses[self._rows[frame], self.names.index(name)]

    def states(self, frame: int) -> Mapping[str, PoseState]:
        """How far the bones' poses are to be relied on in a frame."""
        found = self.track.frames[self._rows[frame]]
        sources = dict(zip(self.names, found.sources, strict=True))
        return states_of(sources, dict(zip(self.names, found.doubts, strict=True)))

    def doubtful_frames(self) -> list[int]:
        """Frames in which a bone is lost, or its pose flagged as uncertain."""
        return [
            number
            for number in self.numbers
            if any(state is not PoseState.TRACKED for state in self.states(number).values())
        ]

    def seconds(self, frame: int) -> float:
        """Time of a frame."""
        return frame / self.track.frames_per_second


def to_patient(pose: np.ndarray) -> np.ndarray:
    """From a pose (4, 4), rig's world to the CT in LPS, to the CT's map to the patient in RAS; and back."""
    return np.linalg.inv(flip_map(pose))
