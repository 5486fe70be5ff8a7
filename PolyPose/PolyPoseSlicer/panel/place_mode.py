"""Slicer's place mode for one of our lists: started and ended here, or by the user elsewhere."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import slicer


class PlaceMode:
    """Follows the application's place mode while `follow` is on.

    changed: called with the list that points are placed into, or None.
    """

    def __init__(self, host: Any, changed: Callable[[Any], None]) -> None:
        """host: keeps observers."""
        self._host, self._changed = host, changed
        self._observed: list[tuple[Any, int]] = []
        self._node: Any = None

    def follow(self) -> None:
        """Notice when the user starts or ends placing points anywhere; a list that was deleted ends it."""
        if self._observed:
            if self._node is not None and self._node.GetScene() is None:
                self._switch_off()
                self._node = None
                self._look()
            return
        selection, interaction = self._nodes()
        self._observed = [
            (interaction, slicer.vtkMRMLInteractionNode.InteractionModeChangedEvent),
            (selection, slicer.vtkMRMLSelectionNode.ActivePlaceNodeIDChangedEvent),
        ]
        for node, event in self._observed:
            self._host.addObserver(node, event, self._look)

    def close(self) -> None:
        """End placing, and leave no observer."""
        self.end()
        for node, event in self._observed:
            self._host.removeObserver(node, event, self._look)
        self._observed = []

    def start(self, node: Any) -> None:
        """Place points into a list, one click after another."""
        logic = slicer.modules.markups.logic()
        self._node = node
        logic.SetActiveList(node)
        logic.StartPlaceMode(True)
        self._look()

    def end(self) -> None:
        """End placing points into the list that `start` was given; other tools of the user go on."""
        if self._node is not None and self.placing() is self._node:
            self._switch_off()
        self._node = None
        self._look()

    def placing(self) -> Any:
        """The list that a click would place a point into, or None."""
        selection, interaction = self._nodes()
        if interaction is None or interaction.GetCurrentInteractionMode() != interaction.Place:
            return None
        identifier = selection.GetActivePlaceNodeID()
        return slicer.mrmlScene.GetNodeByID(identifier) if identifier else None

    def _switch_off(self) -> None:
        _selection, interaction = self._nodes()
        interaction.SetCurrentInteractionMode(slicer.vtkMRMLInteractionNode.ViewTransform)

    def _look(self, *_ignored: Any) -> None:
        self._changed(self.placing())

    @staticmethod
    def _nodes() -> tuple[Any, Any]:
        logic = slicer.app.applicationLogic()
        return logic.GetSelectionNode(), logic.GetInteractionNode()
