"""Small real Qt widgets in place of the panel's ctk and qMRML widgets; they work on the real scene."""

from __future__ import annotations

import re
import sys
import types
from typing import Any, ClassVar

import shiboken6
import slicer
from PySide6 import QtCore, QtWidgets

from .pythonqt import set_private

Signal = QtCore.Signal

_HEADER_HEIGHT = 26
_ANY_HEIGHT = 16777215


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


class qMRMLWidget(StandIn):
    """A widget that hands its scene to its children through the .ui file's connections."""

    mrmlSceneChanged = Signal(object)
    signatures: ClassVar = {"mrmlSceneChanged(vtkMRMLScene*)": "mrmlSceneChanged"}
    isEntered = stored(bool, "isEntered", True)

    def setMRMLScene(self, scene: Any) -> None:
        """Set the scene."""
        set_private(self, _scene=scene)
        self.mrmlSceneChanged.emit(scene)

    def mrmlScene(self) -> Any:
        """The scene."""
        return self.__dict__.get("_scene")


class qSlicerScriptedLoadableModuleWidget(qMRMLWidget):
    """The frame that the application puts around a scripted module's panel."""

    def setModuleName(self, name: str) -> None:
        """Tell which module this is the frame of."""
        set_private(self, _module_name=name)

    def reload(self) -> None:
        """Make and set up a new panel from the module's present code."""
        name = self.__dict__["_module_name"]
        panel = getattr(sys.modules[name], f"{name}Widget")(self)
        setattr(slicer.modules, f"{name}Widget", panel)
        panel.setup()


class qMRMLNodeComboBox(StandIn):
    """Selects one node of given classes from the scene."""

    currentNodeChanged = Signal(object)
    currentNodeChangedBool = Signal(bool)
    currentNodeIDChanged = Signal(str)
    nodeAddedByUser = Signal(object)
    nodeActivated = Signal(object)
    signatures: ClassVar = {
        "currentNodeChanged(vtkMRMLNode*)": "currentNodeChanged",
        "currentNodeChanged(bool)": "currentNodeChangedBool",
        "currentNodeIDChanged(QString)": "currentNodeIDChanged",
        "nodeAddedByUser(vtkMRMLNode*)": "nodeAddedByUser",
        "nodeActivated(vtkMRMLNode*)": "nodeActivated",
    }
    nodeTypes = stored("QStringList", "nodeTypes", [])
    noneEnabled = stored(bool, "noneEnabled", False)
    addEnabled = stored(bool, "addEnabled", True)
    removeEnabled = stored(bool, "removeEnabled", True)
    renameEnabled = stored(bool, "renameEnabled", False)
    editEnabled = stored(bool, "editEnabled", False)
    showHidden = stored(bool, "showHidden", False)
    showChildNodeTypes = stored(bool, "showChildNodeTypes", True)
    selectNodeUponCreation = stored(bool, "selectNodeUponCreation", True)
    baseName = stored(str, "baseName", "")
    noneDisplay = stored(str, "noneDisplay", "None")

    def __init__(self, parent: QtWidgets.QWidget | None = None) -> None:
        super().__init__(parent)
        box = QtWidgets.QComboBox(self)
        layout = QtWidgets.QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(box)
        set_private(self, _box=box, _scene=None, _id="", _tags=[])
        box.activated.connect(lambda index: self._activated(index))

    def property_changed(self, name: str) -> None:
        """Other nodes may fit now."""
        self.refresh()

    def mrmlScene(self) -> Any:
        """The scene."""
        return self._scene

    def setMRMLScene(self, scene: Any) -> None:
        """Offer the nodes of this scene."""
        if scene is self._scene:
            return
        self._stop_observing()
        set_private(self, _scene=scene)
        if scene:
            for event in (
                slicer.vtkMRMLScene.NodeAddedEvent,
                slicer.vtkMRMLScene.NodeRemovedEvent,
                slicer.vtkMRMLScene.EndCloseEvent,
                slicer.vtkMRMLScene.EndBatchProcessEvent,
            ):
                self._tags.append(scene.AddObserver(event, lambda *_: self.refresh()))
            self._tags.append(
                scene.AddObserver(slicer.vtkMRMLScene.EndImportEvent, lambda *_: self._imported())
            )
        self.refresh()

    def _stop_observing(self) -> None:
        for tag in self._tags:
            self._scene.RemoveObserver(tag)
        self._tags.clear()

    def _nodes(self) -> list[Any]:
        if self._scene is None:
            return []
        nodes = [self._scene.GetNthNode(index) for index in range(self._scene.GetNumberOfNodes())]
        return [node for node in nodes if self._fits(node)]

    def _fits(self, node: Any) -> bool:
        if node.GetHideFromEditors() and not self.showHidden:
            return False
        return any(
            node.GetClassName() == kind or (self.showChildNodeTypes and node.IsA(kind))
            for kind in self.nodeTypes
        )

    def _imported(self) -> None:
        """An import empties the model, and with it the selection, before it is filled anew."""
        if "_box" in self.__dict__ and shiboken6.isValid(self) and shiboken6.isValid(self._box):
            self._select("")
        self.refresh()

    def _activated(self, index: int) -> None:
        """The user chose an item."""
        self.setCurrentNodeID(self._box.itemData(index) or "")
        self.nodeActivated.emit(self.currentNode())

    def refresh(self) -> None:
        """Read the scene again; where the selected node has gone, the entry before it is selected."""
        if "_box" not in self.__dict__:
            return
        if not shiboken6.isValid(self) or not shiboken6.isValid(self._box):
            self._stop_observing()
            return
        nodes = self._nodes()
        identifiers = [node.GetID() for node in nodes]
        before = (
            [self._box.itemData(n) for n in range(max(0, self._box.findData(self._id)))] if self._id else []
        )
        self._box.clear()
        if self.noneEnabled:
            self._box.addItem(self.noneDisplay, "")
        for node in nodes:
            self._box.addItem(node.GetName(), node.GetID())
        # Without a None entry the first node is selected.
        left = [each for each in before if each in identifiers]
        fallback = left[-1] if left else "" if self.noneEnabled or not identifiers else identifiers[0]
        self._select(self._id if self._id in identifiers else fallback)

    def _select(self, identifier: str) -> None:
        self._box.setCurrentIndex(self._box.findData(identifier))
        if identifier != self._id:
            set_private(self, _id=identifier)
            node = self.currentNode()
            self.currentNodeChanged.emit(node)
            self.currentNodeChangedBool.emit(node is not None)
            self.currentNodeIDChanged.emit(identifier)

    def currentNode(self) -> Any:
        """The selected node or None."""
        return self._scene.GetNodeByID(self._id) if self._scene and self._id else None

    def setCurrentNode(self, node: Any) -> None:
        """Select a node; one that does not fit selects none."""
        self.setCurrentNodeID(node.GetID() if node else "")

    def setCurrentNodeID(self, identifier: str) -> None:
        """Select a node by its ID."""
        known = [node.GetID() for node in self._nodes()]
        self._select(identifier if identifier in known else "")

    currentNodeID = QtCore.Property(str, lambda self: self._id, setCurrentNodeID)

    def nodeCount(self) -> int:
        """How many nodes fit."""
        return len(self._nodes())

    def addNode(self, kind: str | None = None) -> Any:
        """Make a node, as the menu's `Create new` does."""
        node = self._scene.AddNewNodeByClass(kind or self.nodeTypes[0], self.baseName)
        self.nodeAddedByUser.emit(node)
        if self.selectNodeUponCreation:
            self.setCurrentNode(node)
        return node


class ctkCollapsibleButton(StandIn):
    """A section with a title."""

    contentsCollapsed = Signal(bool)
    signatures: ClassVar = {"contentsCollapsed(bool)": "contentsCollapsed"}
    text = stored(str, "text", "")
    collapsed = stored(bool, "collapsed", False, "contentsCollapsed")
    checkable = stored(bool, "checkable", False)

    def __init__(self, parent: QtWidgets.QWidget | None = None) -> None:
        super().__init__(parent)
        self.setContentsMargins(0, _HEADER_HEIGHT, 0, 0)

    def property_changed(self, name: str) -> None:
        """A collapsed section is only its title."""
        self.setMaximumHeight(_HEADER_HEIGHT if self.collapsed else _ANY_HEIGHT)
        self.update()

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


_SLICER_WIDGETS = (qMRMLWidget, qSlicerScriptedLoadableModuleWidget, qMRMLNodeComboBox)
_CTK_WIDGETS = (ctkCollapsibleButton, ctkSliderWidget, ctkDoubleSpinBox, ctkPathLineEdit)
# Named by Slicer's own parameterNodeWrapper when it looks for a connector; the panel has none of them.
_ONLY_NAMED_BY_SLICER = {
    "ctk": (
        "ctkCheckBox",
        "ctkComboBox",
        "ctkCheckablePushButton",
        "ctkDoubleSlider",
        "ctkRangeWidget",
        "ctkDoubleRangeSlider",
        "ctkDirectoryButton",
        "ctkColorPickerButton",
    ),
    "slicer": ("qMRMLSliderWidget", "qMRMLSpinBox", "qMRMLRangeWidget"),
}


def install() -> list[type[QtWidgets.QWidget]]:
    """Make `import ctk` work, add the qMRML widgets to `slicer`; returns the classes for .ui files."""
    ctk = types.ModuleType("ctk", __doc__)
    for cls in _CTK_WIDGETS:
        setattr(ctk, cls.__name__, cls)
    for cls in _SLICER_WIDGETS:
        setattr(slicer, cls.__name__, cls)
    for owner, names in ((ctk, _ONLY_NAMED_BY_SLICER["ctk"]), (slicer, _ONLY_NAMED_BY_SLICER["slicer"])):
        for name in names:
            setattr(owner, name, type(name, (), {}))
    ctk.ctkMessageBox = QtWidgets.QMessageBox
    sys.modules["ctk"] = ctk
    return [*_SLICER_WIDGETS, *_CTK_WIDGETS]
