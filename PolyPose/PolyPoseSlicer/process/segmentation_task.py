"""One CT that an extension segments: its nodes, what is said meanwhile, and whether it is still wanted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import slicer
from slicer.i18n import tr as _

from PolyPoseLib.errors import CancelledError, InputError


@dataclass
class SegmentationTask:
    """A CT to segment, and the empty segmentation node that is filled.

    Parameters
    ----------
    ct : vtkMRMLScalarVolumeNode
        The CT; never changed.
    segmentation : vtkMRMLSegmentationNode
        Filled with one segment per bone, and others.
    tell : callable
        Takes one line about what is going on.
    cancelled : bool
        Whether the user asked to stop.

    """

    ct: slicer.vtkMRMLScalarVolumeNode
    segmentation: slicer.vtkMRMLSegmentationNode
    tell: Callable[[str], None]
    cancelled: bool = False

    def check(self) -> None:
        """Raise CancelledError or InputError, one sentence, when the result is no longer wanted."""
        if self.cancelled:
            raise CancelledError(_("The segmentation was cancelled; nothing was changed."))
        for node in (self.ct, self.segmentation):
            if slicer.mrmlScene.GetNodeByID(node.GetID()) is not node:
                raise InputError(
                    _(
                        "'{name}' was deleted while the CT was segmented: start the segmentation again."
                    ).format(name=node.GetName())
                )


class Segmenter(Protocol):
    """An installed extension that segments bones.

    name: the extension's, for people.
    """

    name: str

    def prepare(self, tell: Callable[[str], None]) -> None:
        """Install and download what the extension itself needs, after it has asked the user; raises on refusal."""
        ...

    def run(self, task: SegmentationTask, ended: Callable[[Exception | None], None]) -> None:
        """Segment; then ended gets None or the exception, before this returns or later, on the main thread."""
        ...

    def cancel(self) -> None:
        """End a run at once; `ended` is called all the same, unless it was."""
        ...
