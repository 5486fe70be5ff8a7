"""Puts on slicer-core's real MRML what only the application sets up: scene, logics, `slicer.app`."""

from __future__ import annotations

import ctypes
import os
import sys
import tempfile
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any

import slicer
import vtk

from .file_io import IOManager

_MODULE_LOGICS = {
    "Colors": "vtkMRMLColorLogic",
    "Volumes": "vtkSlicerVolumesLogic",
    "Segmentations": "vtkSlicerSegmentationsModuleLogic",
    "Transforms": "vtkSlicerTransformLogic",
    "Models": "vtkSlicerModelsLogic",
    "Markups": "vtkSlicerMarkupsLogic",
    "Tables": "vtkSlicerTablesLogic",
    "Plots": "vtkSlicerPlotsLogic",
    "SubjectHierarchy": "vtkSlicerSubjectHierarchyModuleLogic",
    "VolumeRendering": "vtkSlicerVolumeRenderingLogic",
    "Sequences": "vtkSlicerSequencesLogic",
    "Units": "vtkSlicerUnitsLogic",
}
_SPARE_REFERENCES = 1_000_000
_APPLICATION_SIGNALS = ("startupCompleted()", "aboutToQuit()", "lastWindowClosed()")


class Signals:
    """Connects callables to a fixed list of signals by their C++ signature; any other signature raises."""

    def __init__(self, *signatures: str) -> None:
        self._slots: dict[str, list[Callable]] = {signature: [] for signature in signatures}

    def connect(self, signature: str, slot: Callable) -> bool:
        """Call `slot` whenever the signal is emitted."""
        self._slots_of(signature).append(slot)
        return True

    def disconnect(self, signature: str, slot: Callable) -> bool:
        """Undo `connect`; False when the slot was not connected."""
        slots = self._slots_of(signature)
        found = slot in slots
        if found:
            slots.remove(slot)
        return found

    def emit(self, signature: str, *arguments: Any) -> None:
        """Call the slots of a signal."""
        for slot in list(self._slots_of(signature)):
            slot(*arguments)

    def count(self, signature: str) -> int:
        """How many slots a signal has."""
        return len(self._slots_of(signature))

    def _slots_of(self, signature: str) -> list[Callable]:
        if signature not in self._slots:
            raise RuntimeError(f"There is no signal '{signature}'")
        return self._slots[signature]


class Settings:
    """The user's settings, in memory."""

    def __init__(self) -> None:
        self._values: dict[str, Any] = {}

    def value(self, key: str, default: Any = None) -> Any:
        """The value of a key."""
        return self._values.get(key, default)

    def setValue(self, key: str, value: Any) -> None:
        """Set a key."""
        self._values[key] = value

    def contains(self, key: str) -> bool:
        """Whether a key was set."""
        return key in self._values

    def remove(self, key: str) -> None:
        """Forget a key."""
        self._values.pop(key, None)


class ModuleManager(Signals):
    """Knows the modules; emits a signal when one is unloaded."""

    def __init__(self) -> None:
        super().__init__("moduleAboutToBeUnloaded(QString)", "modulesLoaded(QStringList)")

    def module(self, name: str) -> Any:
        """A module by its name, or None."""
        return getattr(slicer.modules, name.lower(), None)


class StartupEnvironment:
    """The environment from before Slicer's launcher changed it, with QProcessEnvironment's methods."""

    def __init__(self, values: dict[str, str]) -> None:
        self._values = values

    def keys(self) -> list[str]:
        """Names of the variables."""
        return list(self._values)

    def value(self, name: str) -> str:
        """Value of one variable."""
        return self._values.get(name, "")


class Application(Signals):
    """Stands for `slicer.app`; what the module does not use is not there."""

    applicationName = "Slicer"
    majorVersion, minorVersion, revision = 5, 13, "31053"

    def __init__(self, logic: slicer.vtkSlicerApplicationLogic) -> None:
        super().__init__(*_APPLICATION_SIGNALS)
        self._logic, self._io, self._settings, self._modules = logic, IOManager(), Settings(), ModuleManager()
        self._layouts: Any = None
        self.temporaryPath = logic.GetTemporaryPath()
        self.startup_variables = {"PATH": os.defpath, "STARTED_BEFORE_SLICER": "1"}

    def applicationLogic(self) -> slicer.vtkSlicerApplicationLogic:
        """The application's logic."""
        return self._logic

    def mrmlScene(self) -> slicer.vtkMRMLScene:
        """The scene."""
        return slicer.mrmlScene

    def coreIOManager(self) -> IOManager:
        """Reads and writes nodes."""
        return self._io

    ioManager = coreIOManager

    def moduleManager(self) -> ModuleManager:
        """Knows the modules."""
        return self._modules

    def layoutManager(self) -> Any:
        """The views; None while none were made (as in `--no-main-window`)."""
        return self._layouts

    def setLayoutManager(self, manager: Any) -> None:
        """Give the application its views."""
        self._layouts = manager

    def userSettings(self) -> Settings:
        """The user's settings."""
        return self._settings

    settings = userSettings

    def startupEnvironment(self) -> StartupEnvironment:
        """The environment that Slicer itself was started in."""
        return StartupEnvironment(self.startup_variables)

    def processEvents(self, *_flags: Any) -> None:
        """Run the event loop once."""
        import qt

        qt.QApplication.processEvents()

    def topLevelWidgets(self) -> list:
        """The windows."""
        import qt

        return qt.QApplication.topLevelWidgets()

    def clipboard(self) -> Any:
        """The clipboard."""
        import qt

        return qt.QApplication.clipboard()

    def testingEnabled(self) -> bool:
        """True: dialogs answer themselves."""
        return True

    def translate(self, context: str, text: str) -> str:
        """What the installed translators say, or the text itself."""
        import qt

        return qt.QApplication.translate(context, text)

    def moduleDocumentationUrl(self, name: str) -> str:
        """Where a module's documentation would be."""
        return f"https://example.invalid/{name}"

    def setOverrideCursor(self, cursor: Any) -> None:
        """Change the mouse cursor."""
        import qt

        qt.QApplication.setOverrideCursor(cursor)

    def restoreOverrideCursor(self) -> None:
        """Undo `setOverrideCursor`."""
        import qt

        qt.QApplication.restoreOverrideCursor()

    def pauseRender(self) -> None:
        """Views are drawn on demand here."""

    def resumeRender(self) -> None:
        """Views are drawn on demand here."""


class CoreModule:
    """Stands for a C++ module: its name and its real logic."""

    def __init__(self, name: str, logic: Any) -> None:
        self.name, self.title, self.path, self._logic = name, name, "", logic

    def logic(self) -> Any:
        """The module's logic."""
        return self._logic


class SequencesModule(CoreModule):
    """The Sequences module; its toolbar shows one browser."""

    active: Any = None

    def setToolBarActiveBrowserNode(self, browser: slicer.vtkMRMLSequenceBrowserNode) -> None:
        """Let the toolbar show a browser."""
        self.active = browser

    def showSequenceBrowser(self, browser: slicer.vtkMRMLSequenceBrowserNode) -> bool:
        """The same, and bring the toolbar up."""
        self.active = browser
        return True


def install() -> Application:
    """Make `slicer.mrmlScene`, `slicer.app` and `slicer.modules`; call once a process."""
    _keep_none_alive()
    scene = slicer.vtkMRMLScene()
    slicer.mrmlScene = scene
    logic = slicer.vtkSlicerApplicationLogic()
    logic.SetTemporaryPath(tempfile.mkdtemp(prefix="harness-"))
    logic.SetMRMLScene(scene)
    logic.GetColorLogic().SetMRMLScene(scene)
    logic.GetColorLogic().AddDefaultColorNodes()
    slicer.modules = types.SimpleNamespace()
    slicer.app = Application(logic)
    _add_singletons(scene)
    _allow_reading_of_bundles(scene, logic)
    for name, class_name in _MODULE_LOGICS.items():
        module_logic = getattr(slicer, class_name)()
        module_logic.SetMRMLApplicationLogic(logic)
        module_logic.SetMRMLScene(scene)
        logic.SetModuleLogic(name, module_logic)
        kind = SequencesModule if name == "Sequences" else CoreModule
        setattr(slicer.modules, name.lower(), kind(name, module_logic))
    return slicer.app


def _keep_none_alive() -> None:
    """Give None references to spare: before Python 3.12 made it immortal, an extension that drops one reference
    too many ends the whole process after some thousand calls ("deallocating None").
    """
    if sys.version_info < (3, 12):
        for _ in range(_SPARE_REFERENCES):
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(None))


def _add_singletons(scene: slicer.vtkMRMLScene) -> None:
    crosshair = slicer.vtkMRMLCrosshairNode()
    crosshair.SetCrosshairName("default")
    scene.AddNode(crosshair)
    slicer.vtkMRMLSliceNode.AddDefaultSliceOrientationPresets(scene)


def _allow_reading_of_bundles(scene: slicer.vtkMRMLScene, logic: slicer.vtkSlicerApplicationLogic) -> None:
    """Reading an .mrb asks the scene's data manager for its cache folder."""
    remote = slicer.vtkMRMLRemoteIOLogic()
    remote.SetMRMLApplicationLogic(logic)
    remote.SetMRMLScene(scene)
    cache = Path(logic.GetTemporaryPath()) / "cache"
    cache.mkdir()
    remote.GetCacheManager().SetRemoteCacheDirectory(str(cache))
    manager = slicer.vtkDataIOManagerLogic()
    manager.SetMRMLApplicationLogic(logic)
    manager.SetAndObserveDataIOManager(remote.GetDataIOManager())
    remote.AddDataIOToScene()
    slicer.app.data_managers = (remote, manager)  # kept alive


def clear_scene() -> None:
    """Close the scene as the user does, singletons of the application kept."""
    slicer.mrmlScene.Clear(0)
    vtk.vtkObject.GlobalWarningDisplayOn()
