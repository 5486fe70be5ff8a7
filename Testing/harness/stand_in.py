"""What the stand-ins of ctk and qMRML widgets share."""

from __future__ import annotations

from typing import Any, ClassVar

from PySide6 import QtCore, QtWidgets

Signal = QtCore.Signal


def stored(kind: Any, name: str, default: Any, signal: str | None = None) -> QtCore.Property:
    """A Qt property kept in the instance, with an optional notification."""
    key = f"_{name}"

    def read(self: Any) -> Any:
        return self.__dict__.get(key, list(default) if isinstance(default, list) else default)

    def write(self: Any, value: Any) -> None:
        changed = read(self) != value
        self.__dict__[key] = value
        if changed:
            self.property_changed(name)
            if signal:
                getattr(self, signal).emit(value)

    return QtCore.Property(kind, read, write)


class StandIn(QtWidgets.QWidget):
    """What the stand-ins share; `signatures` names the Python signal of each C++ signature."""

    standsForQtClass = True
    signatures: ClassVar[dict[str, str]] = {}

    def property_changed(self, name: str) -> None:
        """Called after a stored property changed."""
