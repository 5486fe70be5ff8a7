"""Lets the CT and its bones follow the transform while a registration runs, and puts them back."""

from __future__ import annotations

from typing import Any

import slicer

from ..scene.drawing import drawn_once


class LivePreview:
    """Puts nodes that are under no transform under the one that is being found; `restore` undoes it."""

    def __init__(self, *nodes: slicer.vtkMRMLTransformableNode | None) -> None:
        """nodes: what is to move; those under a transform of their own stay where they are."""
        self._nodes = [each for each in nodes if each is not None and each.GetTransformNodeID() is None]
        self._transform: Any = None

    def show(self, transform: slicer.vtkMRMLTransformNode) -> None:
        """Let them follow a transform."""
        if transform is self._transform or transform.GetScene() is None:
            return
        self._transform = transform
        for node in self._nodes:
            if node.GetScene() is not None:
                node.SetAndObserveTransformNodeID(transform.GetID())

    @drawn_once
    def restore(self) -> None:
        """Put them back, unless the user has moved them meanwhile."""
        for node in self._nodes:
            if (
                self._transform is not None
                and node.GetScene() is not None
                and node.GetParentTransformNode() is self._transform
            ):
                node.SetAndObserveTransformNodeID(None)
        self._transform = None
