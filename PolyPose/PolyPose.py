"""PolyPose in 3D Slicer: one CT aligned to two or more X-rays, bone by bone. The four classes Slicer looks for."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import slicer
from slicer.i18n import tr as _
from slicer.i18n import translate
from slicer.ScriptedLoadableModule import (
    ScriptedLoadableModule,
    ScriptedLoadableModuleTest,
    ScriptedLoadableModuleWidget,
)
from slicer.util import VTKObservationMixin

if str(Path(__file__).parent) not in sys.path:
    sys.path.insert(0, str(Path(__file__).parent))

from PolyPoseSlicer.logic import RegistrationLogic
from PolyPoseSlicer.process import environment
from PolyPoseSlicer.track_logic import TrackLogic

environment.make_core_importable()


class PolyPose(ScriptedLoadableModule):
    """What the application shows of the module before it is opened."""

    def __init__(self, parent: Any) -> None:
        """Fill in the module's description."""
        super().__init__(parent)
        parent.title = "PolyPose"
        parent.categories = [translate("qSlicerAbstractCoreModule", "Registration")]
        parent.dependencies = []
        parent.contributors = ["PolyPose contributors"]
        parent.helpText = _(
            "Aligns one CT to two or more X-rays of the same patient in another posture: every bone keeps its "
            "shape and gets its own rigid motion, soft tissue follows smoothly. Research software, not for "
            "clinical decisions."
        )
        parent.acknowledgementText = _(
            "The method is the polyrigid 2D/3D registration of Gopalakrishnan et al. (PolyPose, 2025)."
        )
        slicer.app.connect("startupCompleted()", registerWithApplication)


def registerWithApplication() -> None:
    """Make the layouts known, and offer the sample data in the module Sample Data; nothing in a Slicer too old."""
    if environment.version_problem():
        return
    from PolyPoseSlicer import samples
    from PolyPoseSlicer.scene import layouts

    layouts.register()
    samples.register(lambda: PolyPoseLogic().getParameterNode())


class PolyPoseWidget(ScriptedLoadableModuleWidget, VTKObservationMixin):
    """The module's panel; PolyPoseSlicer.panel builds and runs it."""

    def __init__(self, parent: Any = None) -> None:
        """Called when the module is opened for the first time."""
        ScriptedLoadableModuleWidget.__init__(self, parent)
        VTKObservationMixin.__init__(self)
        self.panel: Any = None

    def setup(self) -> None:
        """Build the panel, or say in its place that this Slicer is too old."""
        super().setup()
        problem = environment.version_problem()
        if problem:
            import qt

            label = qt.QLabel(problem)
            label.wordWrap = True
            self.layout.addWidget(label)
            return
        from PolyPoseSlicer.panel.panel import Panel

        self.panel = Panel(self, PolyPoseLogic())

    def enter(self) -> None:
        """Called each time the module is opened."""
        if self.panel is not None:
            self.panel.enter()

    def exit(self) -> None:
        """Called each time another module is opened."""
        if self.panel is not None:
            self.panel.exit()

    def cleanup(self) -> None:
        """Called when the module is reloaded and when the application ends."""
        if self.panel is not None:
            self.panel.cleanup()
            self.panel = None
        self.removeObservers()


class PolyPoseLogic(TrackLogic, RegistrationLogic):
    """Registers nodes of the scene, and tracks them through sequences; needs no panel.

    Every failure is a PolyPoseLib.errors.PolyPoseError whose text is one sentence.
    """


class PolyPoseTest(ScriptedLoadableModuleTest):
    """The self test that `Reload and Test` and Slicer's test runner call."""

    def setUp(self) -> None:
        """Start from an empty scene."""
        slicer.mrmlScene.Clear()

    def runTest(self) -> None:
        """All tests."""
        from PolyPoseSlicer import self_test

        self.setUp()
        tests = (
            (self_test.test_frames, ()),
            (self_test.test_study, ()),
            (self_test.test_registration, (PolyPoseLogic(),)),
        )
        for test, needs in tests:
            self.delayDisplay((test.__doc__ or test.__name__).splitlines()[0])
            test(self, *needs)
            slicer.mrmlScene.Clear()
