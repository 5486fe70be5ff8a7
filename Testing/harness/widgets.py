"""Small real Qt widgets in place of the panel's qMRML widgets, on the real scene; they make `import ctk` work, too."""

from __future__ import annotations

import sys
import types
from typing import Any, ClassVar

import shiboken6
import slicer
from PySide6 import QtCore, QtWidgets

from .ctk_widgets import ctkCollapsibleButton, ctkDoubleSpinBox, ctkPathLineEdit, ctkSliderWidget
from .pythonqt import set_private
from .stand_in import Signal, StandIn, stored


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
        # Read the properties once, and let the scene choose: every box comes here whenever any node is added.
        kinds, hidden, children = tuple(self.nodeTypes), self.showHidden, self.showChildNodeTypes

        def fits(node: Any) -> bool:
            if not any(node.GetClassName() == kind or (children and node.IsA(kind)) for kind in kinds):
                return False
            return hidden or not node.GetHideFromEditors()

        return [node for node in self._candidates(kinds) if fits(node)]

    def _candidates(self, kinds: tuple[str, ...]) -> list[Any]:
        """Nodes of the scene in their order, at least those of these kinds."""
        scene = self._scene
        if len(kinds) == 1:
            count = scene.GetNumberOfNodesByClass(kinds[0])
            return [scene.GetNthNodeByClass(number, kinds[0]) for number in range(count)]
        return [scene.GetNthNode(number) for number in range(scene.GetNumberOfNodes())]

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
        """Read the scene again; where the selected node has gone, the entry before it is selected and activated."""
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
        gone = bool(self._id) and self._id not in identifiers
        self._select(fallback if gone or self._id not in identifiers else self._id)
        if gone and self._id:
            self.nodeActivated.emit(self.currentNode())

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
