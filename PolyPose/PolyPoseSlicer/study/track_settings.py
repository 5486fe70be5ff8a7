"""What the scene keeps of a track beside its nodes, as attributes of these."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
import slicer
from slicer.i18n import tr as _

from PolyPoseLib.errors import InputError

_ATTRIBUTE = "PolyPose.Track"
"""Attribute of the track's browser."""

_KEPT = "PolyPose.Kept"
"""Attribute of a bone's sequence: poses that a person changed and kept."""


@dataclass(frozen=True)
class TrackSettings:
    """How the track's X-rays lie.

    Parameters
    ----------
    first : dict of str to int
        Image of frame 0 of each camera.
    mirrored : dict of str to bool
        Whether a camera's images are stored the other way round than seen from the source.
    detectors : dict of str to float
        Distance from each source at which the X-ray is shown, mm.

    """

    first: dict[str, int] = field(default_factory=dict)
    mirrored: dict[str, bool] = field(default_factory=dict)
    detectors: dict[str, float] = field(default_factory=dict)

    @staticmethod
    def given(browser: slicer.vtkMRMLSequenceBrowserNode) -> bool:
        """Whether a browser is that of a track."""
        return browser.GetAttribute(_ATTRIBUTE) is not None

    @classmethod
    def of(cls, browser: slicer.vtkMRMLSequenceBrowserNode) -> TrackSettings:
        """Those of a track's browser; raises InputError where they are damaged."""
        try:
            stored = json.loads(browser.GetAttribute(_ATTRIBUTE))
            return cls(
                _each(stored, "first", int),
                _each(stored, "mirrored", bool),
                _each(stored, "detectors", float),
            )
        except (ValueError, TypeError, AttributeError, KeyError) as error:
            raise _damaged(browser) from error

    def store(self, browser: slicer.vtkMRMLSequenceBrowserNode) -> None:
        """Keep them with the browser."""
        browser.SetAttribute(_ATTRIBUTE, json.dumps(asdict(self)))


def _damaged(node: slicer.vtkMRMLNode) -> InputError:
    sentence = _("The track '{name}' of the scene is damaged: delete it, and track again.")
    return InputError(sentence.format(name=node.GetName()))


def _each(stored: dict[str, dict[str, Any]], name: str, kind: type) -> dict[str, Any]:
    return {str(camera): kind(value) for camera, value in stored[name].items()}


class KeptPoses:
    """The poses of one bone that a person changed and kept, by frame: (4, 4) rig's world to the CT, LPS mm."""

    def __init__(self, sequence: slicer.vtkMRMLSequenceNode | None) -> None:
        self._sequence = sequence

    @property
    def poses(self) -> dict[int, np.ndarray]:
        """All of them; raises InputError where they are damaged."""
        if self._sequence is None:
            return {}
        text = self._sequence.GetAttribute(_KEPT) or "{}"
        try:
            return {
                int(frame): np.array(pose, dtype=np.float64).reshape(4, 4)
                for frame, pose in json.loads(text).items()
            }
        except (ValueError, TypeError, AttributeError) as error:
            raise _damaged(self._sequence) from error

    @property
    def frames(self) -> set[int]:
        """Their frames."""
        return set(self.poses)

    def remember(self, frame: int, pose: np.ndarray) -> None:
        """Take note of one."""
        self._store({**self.poses, frame: pose})

    def forget(self, frame: int) -> None:
        """Drop that of a frame, if there is one."""
        if frame in self.poses:
            self._store({number: pose for number, pose in self.poses.items() if number != frame})

    def _store(self, poses: dict[int, np.ndarray]) -> None:
        if self._sequence is not None:
            text = json.dumps({str(frame): np.asarray(pose).tolist() for frame, pose in poses.items()})
            self._sequence.SetAttribute(_KEPT, text if poses else None)
