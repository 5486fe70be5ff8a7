"""Small real Qt widgets in place of the panel's ctk widgets."""

from __future__ import annotations

import re
from typing import Any, ClassVar

import slicer
from PySide6 import QtCore, QtWidgets

from .pythonqt import set_private
from .stand_in import Signal, StandIn, stored

_HEADER_HEIGHT = 26
_ANY_HEIGHT = 16777215
_EXPLICIT = QtCore.Qt.WA_WState_ExplicitShowHide
_WANTED = "visibilityToParent"
"""Property in which ctkCollapsibleButton keeps whether a child is to be seen when it is not collapsed."""


class ctkCollapsibleButton(StandIn):
    """A section with a title."""

    contentsCollapsed = Signal(bool)
    signatures: ClassVar = {"contentsCollapsed(bool)": "contentsCollapsed"}
    text = stored(str, "text", "")
    collapsed = stored(bool, "collapsed", False, "contentsCollapsed")
    checkable = stored(bool, "checkable", False)
    collapsedHeight = stored(int, "collapsedHeight", 10)

    def __init__(self, parent: QtWidgets.QWidget | None = None) -> None:
        super().__init__(parent)
        set_private(self, _forcing=False)
        self.setContentsMargins(0, _HEADER_HEIGHT, 0, 0)
        # As CTK has it: without a policy of its own a section wants its preferred width.
        self.setSizePolicy(QtWidgets.QSizePolicy.Policy.Minimum, QtWidgets.QSizePolicy.Policy.Preferred)

    def property_changed(self, name: str) -> None:
        """A collapsed section is only its title."""
        self.setMaximumHeight(_HEADER_HEIGHT + self.collapsedHeight if self.collapsed else _ANY_HEIGHT)
        self.update()
        if name == "collapsed":
            self.hide_or_show()

    def hide_or_show(self) -> None:
        """Hide what is in the section while it is collapsed, and show afterwards what was not hidden by itself."""
        for child in self.findChildren(QtWidgets.QWidget, options=QtCore.Qt.FindDirectChildrenOnly):
            if child.property(_WANTED) is None:
                hidden = child.testAttribute(_EXPLICIT) and child.isHidden()
                child.setProperty(_WANTED, not hidden)
                child.installEventFilter(self)
            self._set_visible(child, not self.collapsed)

    def eventFilter(self, child: Any, event: Any) -> bool:
        """What is shown while the section is collapsed stays hidden until it is opened."""
        kind = event.type()
        if kind in (QtCore.QEvent.ShowToParent, QtCore.QEvent.HideToParent) and not self._forcing:
            child.setProperty(_WANTED, kind == QtCore.QEvent.ShowToParent)
            if self.collapsed and kind == QtCore.QEvent.ShowToParent:
                self._set_visible(child, False)
        return False

    def showEvent(self, event: Any) -> None:
        """Showing the section shows what is in it."""
        super().showEvent(event)
        self.hide_or_show()

    def _set_visible(self, child: Any, visible: bool) -> None:
        set_private(self, _forcing=True)
        child.setVisible(visible and child.property(_WANTED))
        if child.property(_WANTED):
            child.setAttribute(_EXPLICIT, False)  # else Qt would not tell when somebody hides it
        set_private(self, _forcing=False)

    def paintEvent(self, _event: Any) -> None:
        """Draw the title."""
        painter = QtWidgets.QStylePainter(self)
        option = QtWidgets.QStyleOptionButton()
        option.initFrom(self)
        option.rect = QtCore.QRect(0, 0, self.width, _HEADER_HEIGHT)
        arrow = "\u25b8" if self.collapsed else "\u25be"
        option.text = f"{arrow} {self.text}"
        painter.drawControl(QtWidgets.QStyle.ControlElement.CE_PushButton, option)
        painter.end()


class ctkSliderWidget(StandIn):
    """A slider with a spin box."""

    valueChanged = Signal(float)
    signatures: ClassVar = {"valueChanged(double)": "valueChanged"}
    minimum = stored(float, "minimum", 0.0)
    maximum = stored(float, "maximum", 99.0)
    singleStep = stored(float, "singleStep", 1.0)
    pageStep = stored(float, "pageStep", 10.0)
    decimals = stored(int, "decimals", 2)
    suffix = stored(str, "suffix", "")
    prefix = stored(str, "prefix", "")
    tracking = stored(bool, "tracking", True)
    spinBoxVisible = stored(bool, "spinBoxVisible", True)

    def __init__(self, parent: QtWidgets.QWidget | None = None) -> None:
        super().__init__(parent)
        slider, box = QtWidgets.QSlider(QtCore.Qt.Orientation.Horizontal), QtWidgets.QDoubleSpinBox()
        slider.setRange(0, 1000)
        layout = QtWidgets.QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(slider, 1)
        layout.addWidget(box)
        set_private(self, _slider=slider, _box=box)
        self._draw()
        slider.sliderMoved.connect(
            lambda step: self.setValue(self.minimum + (self.maximum - self.minimum) * step / 1000)
        )
        box.valueChanged.connect(lambda value: self.setValue(value))

    def property_changed(self, name: str) -> None:
        """A new range moves the value into it."""
        if name in ("minimum", "maximum"):
            self.setValue(self._read())
        self._draw()

    def _read(self) -> float:
        return self.__dict__.get("_value", 0.0)

    def setValue(self, value: float) -> None:
        """Set the value; it is clipped and rounded."""
        value = round(min(max(float(value), self.minimum), self.maximum), self.decimals)
        if value != self._read():
            set_private(self, _value=value)
            self._draw()
            self.valueChanged.emit(value)

    def _draw(self) -> None:
        """Let the slider and the box inside show the value."""
        for part in (self._slider, self._box):
            part.blockSignals(True)
        self._box.setDecimals(self.decimals)
        self._box.setRange(self.minimum, self.maximum)
        self._box.setSuffix(self.suffix)
        self._box.setValue(self._read())
        span = self.maximum - self.minimum
        self._slider.setValue(round(1000 * (self._read() - self.minimum) / span) if span else 0)
        for part in (self._slider, self._box):
            part.blockSignals(False)

    value = QtCore.Property(float, _read, setValue)


class ctkDoubleSpinBox(ctkSliderWidget):
    """A number with a unit."""


class ctkPathLineEdit(StandIn):
    """A path with a button to browse.

    As in CTK its signal keeps silent about an empty path, and about one whose ending no name filter has.
    """

    Dirs, Files, Readable = 1, 2, 16
    currentPathChanged = Signal(str)
    signatures: ClassVar = {"currentPathChanged(QString)": "currentPathChanged"}
    filters = stored(int, "filters", 0)
    nameFilters = stored("QStringList", "nameFilters", [])
    settingKey = stored(str, "settingKey", "")

    def __init__(self, parent: QtWidgets.QWidget | None = None) -> None:
        super().__init__(parent)
        box, browse = QtWidgets.QComboBox(), QtWidgets.QToolButton()
        box.setEditable(True)
        box.setInsertPolicy(QtWidgets.QComboBox.InsertPolicy.NoInsert)
        browse.setText("...")
        layout = QtWidgets.QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(box, 1)
        layout.addWidget(browse)
        set_private(self, _box=box)
        box.editTextChanged.connect(lambda path: self._typed(path))

    def comboBox(self) -> QtWidgets.QComboBox:
        """The editable box inside."""
        return self._box

    def _typed(self, path: str) -> None:
        endings = [re.escape(each) for each in re.findall(r"\*\.(\w+)", " ".join(self.nameFilters))]
        if re.fullmatch(rf".*\.({'|'.join(endings)})" if endings else ".+", path):
            self.currentPathChanged.emit(path)

    def _path(self) -> str:
        return self._box.currentText

    def setCurrentPath(self, path: str) -> None:
        """Set the path."""
        self._box.lineEdit().setText(path)

    currentPath = QtCore.Property(str, _path, setCurrentPath)

    def addCurrentPathToHistory(self) -> None:
        """Remember the path in the settings."""
        if self.settingKey:
            slicer.app.userSettings().setValue(self.settingKey, [self.currentPath])
