"""Own stand-ins for `slicer.i18n`, `ScriptedLoadableModule`, `slicer.packaging` and `SampleData`."""

from __future__ import annotations

import functools
import inspect
import os
import sys
import types
import unittest
from pathlib import Path
from typing import Any

import slicer


class ScriptedLoadableModule:
    """What the application makes once for each module."""

    def __init__(self, parent: Any) -> None:
        self.parent = parent
        self.moduleName = type(self).__name__
        if not hasattr(slicer, "selfTests"):
            slicer.selfTests = {}
        slicer.selfTests[self.moduleName] = self.runTest

    def resourcePath(self, name: str) -> str:
        """Path of a file in the module's Resources folder."""
        return os.path.join(os.path.dirname(self.parent.path), "Resources", name)

    def getDefaultModuleDocumentationLink(self, _page: str | None = None) -> str:
        """A link to the module's documentation."""
        return f'<a href="{slicer.app.moduleDocumentationUrl(self.moduleName)}">documentation</a>'

    def runTest(self, msec: int = 100, **keywords: Any) -> None:
        """Run the module's test class, as `Reload and Test` does."""
        test = getattr(sys.modules[type(self).__module__], f"{self.moduleName}Test")()
        test.messageDelay = msec
        test.runTest(**keywords)


class ScriptedLoadableModuleWidget:
    """The module's panel."""

    def __init__(self, parent: Any = None) -> None:
        import qt

        self.moduleName = type(self).__name__.removesuffix("Widget")
        self.developerMode = False
        self.parent = parent
        if parent is None:
            self.parent = slicer.qMRMLWidget()
            self.parent.setLayout(qt.QVBoxLayout())
            self.parent.setMRMLScene(slicer.mrmlScene)
        self.layout = self.parent.layout()
        if parent is None:
            self.setup()
            self.parent.show()
        slicer.app.moduleManager().connect(
            "moduleAboutToBeUnloaded(QString)", self._onModuleAboutToBeUnloaded
        )

    def resourcePath(self, name: str) -> str:
        """Path of a file in the module's Resources folder."""
        return os.path.join(os.path.dirname(slicer.util.modulePath(self.moduleName)), "Resources", name)

    def setup(self) -> None:
        """Build the panel."""

    def cleanup(self) -> None:
        """Release what the panel holds."""

    def _onModuleAboutToBeUnloaded(self, name: str) -> None:
        if name == self.moduleName:
            self.cleanup()
            slicer.app.moduleManager().disconnect(
                "moduleAboutToBeUnloaded(QString)", self._onModuleAboutToBeUnloaded
            )


class ScriptedLoadableModuleLogic:
    """The module's logic."""

    def __init__(self, parent: Any = None) -> None:
        self.moduleName = type(self).__name__.removesuffix("Logic")
        self.isSingletonParameterNode = True

    def getParameterNode(self) -> Any:
        """The module's only parameter node; made when there is none."""
        scene = slicer.mrmlScene
        node = scene.GetSingletonNode(self.moduleName, "vtkMRMLScriptedModuleNode")
        if node is None:
            node = scene.CreateNodeByClass("vtkMRMLScriptedModuleNode")
            node.UnRegister(None)
            node.SetSingletonTag(self.moduleName)
            node.SetName(scene.GenerateUniqueName(self.moduleName))
            node = scene.AddNode(node)
        node.SetAttribute("ModuleName", self.moduleName)
        return node


class ScriptedLoadableModuleTest(unittest.TestCase):
    """The module's self test."""

    def __init__(self, *arguments: Any, **keywords: Any) -> None:
        super().__init__(*(arguments or ("runTest",)), **keywords)

    def delayDisplay(self, _message: str, _requested: int | None = None, _msec: int | None = None) -> None:
        """Nobody watches here."""

    def runTest(self) -> None:
        """The tests; overridden by the module."""


class _SampleDataLogic:
    """Keeps what modules register, and refuses what the real one does not take."""

    categories: dict[str, str] = {}  # noqa: RUF012
    sources: list[dict] = []  # noqa: RUF012

    @classmethod
    def registerCustomSampleDataCategory(cls, category: str, title: str | None = None) -> None:
        cls.categories[category] = title or category

    @classmethod
    def registerCustomSampleDataSource(
        cls,
        category: str = "Custom",
        sampleName: str | None = None,
        uris: Any = None,
        fileNames: Any = None,
        nodeNames: Any = None,
        customDownloader: Any = None,
        thumbnailFileName: str | None = None,
        loadFileType: Any = None,
        loadFiles: Any = None,
        loadFileProperties: dict | None = None,
        checksums: Any = None,
    ) -> None:
        """The arguments of Slicer 5.12's own; any other raises TypeError there too."""
        cls.sources.append({name: value for name, value in locals().items() if name != "cls"})

    def downloadFileIntoCache(self, uri: str, name: str, checksum: str | None = None) -> str:
        """Nothing is downloaded in tests; those that need a file replace this."""
        raise RuntimeError(f"{uri} would be downloaded as {name}")


def _module(name: str, **contents: Any) -> types.ModuleType:
    module = types.ModuleType(name)
    vars(module).update(contents)
    sys.modules[name] = module
    if name.startswith("slicer."):
        setattr(slicer, name.split(".")[1], module)
    return module


def _translate(context: str, text: str) -> str:
    return slicer.app.translate(context, text)


def _tr(text: str) -> str:
    """Translate in the context that Slicer derives from the caller's file: its package, if any, and its name."""
    frame = inspect.currentframe()
    return _translate(_context(frame.f_back.f_code.co_filename), text)  # type: ignore[union-attr]


@functools.cache
def _context(file: str) -> str:
    path = Path(file)
    package = f"{path.parent.name}." if (path.parent / "__init__.py").is_file() else ""
    return package + path.stem


def _load_requirements(path: str) -> list[str]:
    with open(path, encoding="utf-8") as file:
        lines = [line.strip() for line in file]
    return [line for line in lines if line and not line.startswith(("#", "-"))]


def _pip_ensure(requirements: list[str], requester: str | None = None, **_options: Any) -> None:
    """In tests nothing is ever installed; who asked for what is kept."""
    sys.modules["slicer.packaging"].asked.append((requester, [str(each) for each in requirements]))


def install_sample_data() -> None:
    """Make `import SampleData` work; Slicer's own is a module of the application, not of `Base/Python`."""
    _module("SampleData", SampleDataLogic=_SampleDataLogic)


def install() -> None:
    """Make the stand-ins importable under their names in Slicer."""
    _module("slicer.i18n", tr=_tr, translate=_translate)
    classes = [value for name, value in globals().items() if name.startswith("ScriptedLoadable")]
    names = {cls.__name__: cls for cls in classes}
    _module("slicer.ScriptedLoadableModule", __all__=list(names), **names)
    _module("slicer.packaging", load_requirements=_load_requirements, pip_ensure=_pip_ensure, asked=[])
