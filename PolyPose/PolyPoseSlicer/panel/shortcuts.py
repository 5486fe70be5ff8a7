"""Keys of the Review section; they work while the module is open."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import qt
import slicer


class Shortcuts:
    """Keys of the main window, and what they do."""

    def __init__(self, form: Any, actions: Mapping[str, Callable[[], None]]) -> None:
        """actions: by key, such as "Ctrl+Shift+B". form: takes the keys where there is no main window."""
        self._form, self._actions = form, dict(actions)
        self._keys: list[Any] = []

    def start(self) -> None:
        """Listen; harmless when called again."""
        if self._keys:
            return
        window = slicer.util.mainWindow() or self._form
        for key, action in self._actions.items():
            shortcut = qt.QShortcut(qt.QKeySequence(key), window)
            shortcut.connect("activated()", action)
            self._keys.append(shortcut)

    def stop(self) -> None:
        """Give the keys back to the application."""
        for shortcut in self._keys:
            shortcut.setParent(None)
            shortcut.deleteLater()
        self._keys.clear()
