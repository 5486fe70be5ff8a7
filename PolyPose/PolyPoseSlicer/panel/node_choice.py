"""Tells a person's choice in a node selector from what the selector does by itself when its node is deleted."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import qt
import slicer
import vtk


class NodeChoice:
    """Follows deletions in the scene.

    When the selected node is deleted, a qMRMLNodeComboBox moves on to another node and emits `nodeActivated`, as if
    somebody had chosen it.
    """

    def __init__(self, host: Any, after_deletion: Callable[[], None]) -> None:
        """host: keeps observers. after_deletion: called once nodes were deleted, to show again what is stored."""
        self._deleted: set[str] = set()
        self._after_deletion = after_deletion
        self._timer = qt.QTimer()
        self._timer.setSingleShot(True)
        self._timer.interval = 0
        self._timer.connect("timeout()", self._settled)
        host.addObserver(slicer.mrmlScene, slicer.mrmlScene.NodeAboutToBeRemovedEvent, self._deletes)

    def by_person(self, shown: Iterable[str]) -> bool:
        """Whether a signal of selectors is a person's choice; shown: IDs of the nodes that they showed before."""
        return self._deleted.isdisjoint(shown)

    def close(self) -> None:
        """Stop the timer."""
        self._timer.stop()
        self._deleted.clear()

    @vtk.calldata_type(vtk.VTK_OBJECT)
    def _deletes(self, _scene: Any, _event: Any, node: Any) -> None:
        self._deleted.add(node.GetID())
        self._timer.start()

    def _settled(self) -> None:
        self._deleted.clear()
        self._after_deletion()


def identifiers(*nodes: Any) -> tuple[str, ...]:
    """IDs of the nodes that are not None."""
    return tuple(node.GetID() for node in nodes if node is not None)
