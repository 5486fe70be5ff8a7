"""What the panel's tests share: the module's panel on a scene, a way to wait, and what must be gone afterwards."""

from __future__ import annotations

import gc
import stat
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest import mock

import children
import scenes
import slicer
from slicer_case import INSIDE_SLICER, REPOSITORY, SlicerTestCase

# isort: split
from PolyPoseSlicer.process import camera_run, registration
from PolyPoseSlicer.study import parameters
from PolyPoseSlicer.study.xray_source import XraySource

GIVE_RESULT = "import shutil\ntell(1)\ntell(2, similarity=0.8)\nshutil.copytree('{folder}', output)\n"


def views() -> Any:
    """The layout manager, with views when there is none."""
    if slicer.app.layoutManager() is None:
        from harness import layout

        layout.install()
    return slicer.app.layoutManager()


def lay_out() -> None:
    """Let views that are new find their size, which takes the application several steps."""
    for _ in range(5):
        slicer.app.processEvents()
        if INSIDE_SLICER:
            slicer.util.forceRenderAllViews()


def module() -> Any:
    """The module as the application has loaded it."""
    if not hasattr(slicer.modules, "polypose"):
        from harness import modules

        modules.load(REPOSITORY / "PolyPose" / "PolyPose.py")
    return slicer.modules.polypose


def emit(signal: Any, *arguments: Any) -> None:
    """Emit a signal, as PythonQt or as PySide does."""
    (signal.emit if hasattr(signal, "emit") else signal)(*arguments)


def application_signal(name: str) -> None:
    """Emit a signal of the application that has no arguments."""
    if INSIDE_SLICER:
        emit(getattr(slicer.app, name))
    else:
        slicer.app.emit(f"{name}()")


def choose_node(selector: Any, node: Any) -> None:
    """Choose a node, or none, as a user does."""
    selector.setCurrentNode(node)
    emit(selector.nodeActivated, selector.currentNode())


def type_into(edit: Any, text: str) -> None:
    """Type a text into a line and leave it."""
    edit.text = text
    emit(edit.editingFinished)


def child_processes() -> list[str]:
    """Processes that this one has started and that still run; known only on Linux."""
    found = []
    for task in Path("/proc/self/task").glob("*/children"):
        for pid in task.read_text().split():
            state = Path(f"/proc/{pid}/stat")
            if state.exists() and state.read_text().rsplit(")", 1)[1].split()[0] != "Z":
                found.append(pid)
    return found


class PanelCase(SlicerTestCase):
    """The panel is open; after the test it is unloaded and nothing of it may be left."""

    def setUp(self) -> None:
        # A layout that another test has left would bring pictures and a renderer up with the panel.
        views().setLayout(slicer.vtkMRMLLayoutNode.SlicerLayoutFourUpView)
        super().setUp()
        self.before = child_processes()
        self.module = module()
        self.open()

    def tearDown(self) -> None:
        self.close()
        gc.collect()
        self.assertEqual(self.left, [], "observers were left")
        self.assertEqual(registration.leftover_folders(), [], "temporary folders were left")
        self.assertEqual([each for each in child_processes() if each not in self.before], [])
        super().tearDown()

    def open(self) -> None:
        """Open the module."""
        if INSIDE_SLICER:
            self.module.widgetRepresentation()
            if slicer.modules.PolyPoseWidget.panel is None:
                self._reload(slicer.modules.PolyPoseWidget)
            slicer.util.selectModule("PolyPose")
        else:
            self.module.enter()
        self._found()

    def leave(self) -> None:
        """Open another module."""
        if INSIDE_SLICER:
            slicer.util.selectModule("Data")
        else:
            self.module.exit()

    def close(self) -> None:
        """Unload the panel; the application itself does so at its end only."""
        host = self.host
        if INSIDE_SLICER:
            self.leave()
            host.cleanup()
        else:
            self.module.close()
        self.left = list(host.Observations)

    def renew(self) -> None:
        """Put a new panel in the place of the present one, as Slicer's reload does."""
        self.host.cleanup()
        self.left = list(self.host.Observations)
        self._reload(self.host)
        self._found()

    def _found(self) -> None:
        self.host = slicer.modules.PolyPoseWidget
        self.panel = self.host.panel
        self.ui = self.panel.ui

    def _reload(self, host: Any) -> None:
        """Make a new panel; Slicer itself only hides the old form, and a test need not keep them all."""
        if INSIDE_SLICER:
            slicer.app.moduleManager().disconnect(
                "moduleAboutToBeUnloaded(QString)", host._onModuleAboutToBeUnloaded
            )
            while host.layout.count():
                widget = host.layout.takeAt(0).widget()
                if widget is not None:
                    widget.delete()
        self.module.widgetRepresentation().reload()

    def wait(self, condition: Callable[[], Any], seconds: float = 50.0) -> None:
        """Let the event loop run until a condition holds."""
        deadline = time.monotonic() + seconds
        while not condition():
            self.assertLess(time.monotonic(), deadline, "waited for too long")
            slicer.app.processEvents()
            time.sleep(0.005)

    def fill(self, xrays: int = 2) -> None:
        """A scene that can be registered."""
        self.ct = scenes.add_ct()
        self.segmentation = scenes.add_segmentation(self.ct)
        self.ui.ctSelector.setCurrentNode(self.ct)
        self.ui.segmentationSelector.setCurrentNode(self.segmentation)
        self.panel.structures.propose()
        self.xrays = [scenes.add_xray(name) for name in ("AP", "lateral", "oblique")[:xrays]]
        fields = {"source_to_detector_mm": 1000.0}
        _intrinsics, extrinsic = scenes.camera_matrix()
        sources = [
            XraySource(each, fields={**fields, "extrinsic": extrinsic.tolist()}) for each in self.xrays
        ]
        parameters.store_xray_sources(self.panel.parameters, sources)

    def child(self, body: str) -> None:
        """Let registrations and searches of this test run a program of our own."""
        program = children.command(self.folder, body)
        script = self.folder / "python"
        script.write_text(f'#!/bin/sh\nexec "{program[0]}" "{program[1]}" "$@"\n')
        script.chmod(script.stat().st_mode | stat.S_IXUSR)
        for module in (registration, camera_run):
            patch = mock.patch.object(module, "python_executable", lambda: str(script))
            patch.start()
            self.addCleanup(patch.stop)

    def give_result(self, before: str = "", **changes: Any) -> None:
        """Let registrations of this test end with a ready result."""
        given = len(list(self.folder.glob("given*")))
        folder = scenes.save_result(self.folder / f"given{given}", **changes)
        self.child(before + GIVE_RESULT.format(folder=folder))


__all__ = ["INSIDE_SLICER", "PanelCase", "child_processes", "emit", "module", "type_into", "views"]
