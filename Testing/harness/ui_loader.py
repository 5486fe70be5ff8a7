"""Loads .ui files as Slicer does; refuses what Qt ignores: unknown classes, properties, connections."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

from PySide6 import QtCore, QtUiTools, QtWidgets

from . import pythonqt
from .ctk_widgets import ctkCollapsibleButton

_substitutes: dict[str, type[QtWidgets.QWidget]] = {}
_checked: dict[bytes, tuple[bytes, list[list[str]]]] = {}
"""Files without a fault, without their connections, and these: every panel of every test loads the same one."""


def register(classes: list[type[QtWidgets.QWidget]]) -> None:
    """Make widget classes known to every loader."""
    _substitutes.update({cls.__name__: cls for cls in classes})


class QUiLoader(QtUiTools.QUiLoader):
    """Checks the file against the widget classes, then makes its connections itself (they use C++ types)."""

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        for cls in _substitutes.values():
            self.registerCustomWidget(cls)

    def load(
        self, source: QtCore.QIODevice | str, parent: QtWidgets.QWidget | None = None
    ) -> QtWidgets.QWidget:
        """The widget that a .ui file describes; raises RuntimeError on anything Qt would silently drop."""
        if isinstance(source, QtCore.QIODevice):
            text = bytes(source.readAll())
        else:
            with open(source, "rb") as file:
                text = file.read()
        if text not in _checked:
            root = ElementTree.fromstring(text)
            connections = self._take_connections(root)
            self._check_classes(root)
            _checked[text] = ElementTree.tostring(root), connections
        form, connections = _checked[text]
        buffer = QtCore.QBuffer()
        buffer.setData(form)
        buffer.open(QtCore.QIODevice.OpenModeFlag.ReadOnly)
        with pythonqt.lenient():
            widget = super().load(buffer, parent)
        if widget is None:
            raise RuntimeError(f"Qt could not build the .ui file: {self.errorString()}")
        for section in widget.findChildren(ctkCollapsibleButton):
            section.hide_or_show()
        for sender, signal, receiver, slot in connections:
            target = _named(widget, receiver)
            method = slot.split("(")[0]
            if not hasattr(target, method):
                raise RuntimeError(f".ui connects to {receiver}.{slot}, which does not exist")
            pythonqt.connect(_named(widget, sender), signal, getattr(target, method))
        return widget

    @staticmethod
    def _take_connections(root: ElementTree.Element) -> list[list[str]]:
        element = root.find("connections")
        if element is None:
            return []
        root.remove(element)
        return [[each.findtext(key) for key in ("sender", "signal", "receiver", "slot")] for each in element]

    def _check_classes(self, root: ElementTree.Element) -> None:
        known = set(self.availableWidgets()) | set(_substitutes)
        for widget in root.iter("widget"):
            name, cls = widget.get("class"), _substitutes.get(widget.get("class"))
            if name not in known:
                raise RuntimeError(f".ui uses {name}, which is no Qt widget and has no stand-in")
            meta = (cls or getattr(QtWidgets, name)).staticMetaObject
            for prop in widget.findall("property"):
                # stdset="0" marks a dynamic property.
                if prop.get("stdset") != "0" and meta.indexOfProperty(prop.get("name")) < 0:
                    raise RuntimeError(f"{name} '{widget.get('name')}' has no property '{prop.get('name')}'")


def _named(widget: QtWidgets.QWidget, name: str) -> QtCore.QObject:
    found = widget if widget.objectName == name else widget.findChild(QtCore.QObject, name)
    if found is None:
        raise RuntimeError(f".ui connects '{name}', which is not in the file")
    return found
