"""The Review section's Undo: the result that was there before the last registration, and back again."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from slicer.i18n import tr as _

from ..scene.drawing import drawn_once
from ..study.parameters import PolyPoseParameterNode
from ..study.snapshot import Snapshot


class UndoPart:
    """Keeps one earlier result, until the scene is closed.

    before: called before the scene's result is replaced; after: called once another is in its place.
    """

    def __init__(self, ui: Any, before: Callable[[], None], after: Callable[[], None]) -> None:
        """Connect the button of the loaded form."""
        self._button = ui.undoButton
        self._before, self._after = before, after
        self._parameters: PolyPoseParameterNode | None = None
        self._other: Snapshot | None = None
        self._undone = False
        self._locked = False
        self._button.connect("clicked()", self.swap)
        self._show()

    def show(self, parameters: PolyPoseParameterNode | None, locked: bool) -> None:
        """Another parameter node, or the same that changed; locked: whether a registration is running."""
        self._parameters = parameters
        self._locked = locked or parameters is None
        self._show()

    def remember(self, snapshot: Snapshot) -> None:
        """A new result is in the place of this one."""
        self._other, self._undone = snapshot, False
        self._show()

    def forget(self) -> None:
        """The scene was closed: there is nothing to go back to."""
        self._other, self._undone = None, False
        self._show()

    @drawn_once
    def swap(self) -> None:
        """Bring the other result back; pressed again, this one."""
        parameters, other = self._parameters, self._other
        if parameters is None or other is None:
            return
        self._before()
        now = Snapshot.of(parameters)
        self._other, self._undone = now, not self._undone
        other.restore(parameters)
        self._show()
        self._after()

    def _show(self) -> None:
        button, other = self._button, self._other
        button.text = _("Redo") if self._undone else _("Undo")
        button.enabled = other is not None and not self._locked
        if other is None:
            text = _("Brings back what was there before the last registration.")
        elif self._undone:
            text = _("Bring back the result of the last registration.")
        elif other.empty:
            text = _("Take the result of the last registration out of the scene; Redo brings it back.")
        else:
            text = _("Bring back the result that was there before the last registration.")
        button.setToolTip(text)
