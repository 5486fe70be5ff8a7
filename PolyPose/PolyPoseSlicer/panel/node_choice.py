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

    def __init__(
        self, host: Any, after_deletion: Callable[[], None], after_addition: Callable[[], None] | None = None
    ) -> None:
        """host: keeps observers. after_deletion: called once nodes were deleted, to show again what is stored.

        after_addition: called once nodes were added.
        """
        self._deleted: set[str] = set()
        self._after_deletion = after_deletion
        self._timer = qt.QTimer()
        self._timer.setSingleShot(True)
        self._timer.interval = 0
        self._timer.connect("timeout()", self._settled)
        self._after_addition = after_addition
        self._added = qt.QTimer()
        self._added.setSingleShot(True)
        self._added.interval = 0
        self._added.connect("timeout()", self._after_addition or self._after_deletion)
        host.addObserver(slicer.mrmlScene, slicer.mrmlScene.NodeAboutToBeRemovedEvent, self._deletes)
        if after_addition is not None:
            host.addObserver(slicer.mrmlScene, slicer.mrmlScene.NodeAddedEvent, self._adds)

    def by_person(self, shown: Iterable[str]) -> bool:
        """Whether a signal of selectors is a person's choice; shown: IDs of the nodes that they showed before."""
        return self._deleted.isdisjoint(shown)

    def close(self) -> None:
        """Stop the timer."""
        self._timer.stop()
        self._added.stop()
        self._deleted.clear()

    def _adds(self, *_ignored: Any) -> None:
        self._added.start()

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
