"""Loads a scripted module the way the application does, and plays its life: open, leave, reload, unload."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from typing import Any

import slicer

_PARENT_ATTRIBUTES = (
    "title",
    "categories",
    "dependencies",
    "contributors",
    "helpText",
    "acknowledgementText",
    "icon",
    "hidden",
)


class _ModuleParent:
    """Stands for the C++ object behind a scripted module; an attribute that it does not have raises."""

    def __init__(self, path: str) -> None:
        self.__dict__.update(path=path, hidden=False)

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in _PARENT_ATTRIBUTES:
            raise AttributeError(f"A scripted module has no attribute '{name}'")
        self.__dict__[name] = value


class ScriptedModule:
    """What `slicer.modules.<name>` is."""

    def __init__(self, name: str, path: Path) -> None:
        self.name, self.path = name, str(path)
        self.parent = _ModuleParent(str(path))
        self.instance: Any = None
        self._frame: Any = None
        self._closed: list[Any] = []

    def widgetRepresentation(self) -> Any:
        """The frame around the panel; the panel is made at the first call."""
        if self._frame is None:
            import qt

            self._frame = slicer.qSlicerScriptedLoadableModuleWidget()
            self._frame.setLayout(qt.QVBoxLayout())
            self._frame.setMRMLScene(slicer.mrmlScene)
            self._frame.setModuleName(self.name)
            self._frame.reload()
        return self._frame

    def panel(self) -> Any:
        """The module's widget object (`slicer.modules.<Name>Widget`)."""
        self.widgetRepresentation()
        return getattr(slicer.modules, f"{self.name}Widget")

    def enter(self) -> None:
        """Open the module."""
        self.panel()
        self._frame.isEntered = True
        self.panel().enter()

    def exit(self) -> None:
        """Open another module."""
        self._frame.isEntered = False
        self.panel().exit()

    def close(self) -> None:
        """Unload the module, as at the application's end."""
        if self._frame is None:
            return
        slicer.app.moduleManager().emit("moduleAboutToBeUnloaded(QString)", self.name)
        delattr(slicer.modules, f"{self.name}Widget")
        frame, self._frame = self._frame, None
        for selector in frame.findChildren(slicer.qMRMLNodeComboBox):
            selector.setMRMLScene(None)  # as its destructor does; PySide does not survive a real deletion
        frame.hide()
        self._closed.append(frame)
        slicer.app.processEvents()


def load(path: str | Path) -> ScriptedModule:
    """Import a module's file and make its module object."""
    path = Path(path)
    name = path.stem
    if str(path.parent) not in sys.path:
        sys.path.insert(0, str(path.parent))
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    record = ScriptedModule(name, path)
    setattr(slicer.modules, name.lower(), record)
    record.instance = getattr(module, name)(record.parent)
    return record
