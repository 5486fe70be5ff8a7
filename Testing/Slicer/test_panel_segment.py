"""Segment bones: the panel runs the extensions' own logics; here fakes of them, see segmenter_fakes."""

from __future__ import annotations

import sys
import time
import types
import unittest
from pathlib import Path
from typing import Any
from unittest import mock

import scenes
import segmenter_fakes as fakes
import slicer
from panel_case import INSIDE_SLICER, PanelCase, application_signal
from PolyPoseSlicer.process import extensions
from PolyPoseSlicer.study.parameters import structures_of

# isort: split
import qt


def _outlives(pid: int, seconds: float = 10) -> bool:
    """Whether a process still runs after so long: one that was killed ends only when it is next scheduled."""
    deadline = time.monotonic() + seconds
    while _runs(pid):
        if time.monotonic() > deadline:
            return True
        time.sleep(0.01)
    return False


def _runs(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return False
    return state.rsplit(")", 1)[1].split()[0] not in "ZX"


class SegmentCase(PanelCase):
    """A CT is chosen; the extension of `name` is installed."""

    name = ""

    def setUp(self) -> None:
        super().setUp()
        total = {"seconds": 0, "code": 0, "names": dict(fakes.NAMES), "refusal": "", "made": []}
        monai = {"code": 0, "fails_to_import": False, "seconds": 0.02, "made": []}
        for logic, values in ((fakes.TotalSegmentatorLogic, total), (fakes.MONAIAuto3DSegLogic, monai)):
            for key, value in values.items():
                self._patch(mock.patch.object(logic, key, value))
        fakes.MONAIAuto3DSegLogic.DEPENDENCY_HANDLER.dependenciesInstalled = False
        if self.name:
            self._patch(mock.patch.dict(sys.modules, fakes.modules()))
            self.install(self.name)
        self.ct = scenes.add_ct()
        self.ui.ctSelector.setCurrentNode(self.ct)

    def install(self, name: str) -> None:
        self._patch(mock.patch.object(slicer.modules, name.lower(), types.SimpleNamespace(), create=True))

    def _patch(self, patch: Any) -> None:
        patch.start()
        self.addCleanup(patch.stop)

    def later(self, condition: Any, action: Any) -> None:
        """Do something once, from the event loop, while the panel waits."""
        timer = qt.QTimer()
        timer.interval = 10
        deadline = time.monotonic() + 20

        def poll() -> None:
            if condition() or time.monotonic() > deadline:
                timer.stop()
                action()

        timer.connect("timeout()", poll)
        timer.start()
        self.addCleanup(timer.stop)

    @property
    def said(self) -> str:
        return self.ui.segmentState.text

    def segmentations(self) -> int:
        return slicer.mrmlScene.GetNumberOfNodesByClass("vtkMRMLSegmentationNode")

    def assert_nothing_made(self) -> None:
        self.assertFalse(self.panel.segment.running)
        self.assertEqual(self.segmentations(), 0)
        self.assertIsNone(self.panel.parameters.segmentation)
        self.assertEqual(self.ui.segmentButton.text, "Segment bones")
        self.assertNotIn("Traceback", self.said)
        self.assertIsNone(qt.QApplication.overrideCursor())


class TotalSegmentatorTest(SegmentCase):
    name = "TotalSegmentator"

    def test_the_ct_is_segmented_and_structures_are_proposed(self) -> None:
        placed = scenes.add_transform(scenes.rotation((0, 0, 1), 5.0))
        self.ct.SetAndObserveTransformNodeID(placed.GetID())
        self.ui.segmentButton.click()
        parameters = self.panel.parameters
        self.assertEqual(parameters.segmentation.GetName(), "CT bones")
        self.assertIs(parameters.segmentation.GetParentTransformNode(), placed)
        self.assertIs(self.ui.segmentationSelector.currentNode(), parameters.segmentation)
        self.assertEqual(parameters.anchor, "pelvis")
        self.assertEqual(
            set(structures_of(parameters)), {"pelvis", "femur_left", "lumbar_spine", "ribs_left"}
        )
        self.assertIn("check the bones", self.said)
        logic = fakes.TotalSegmentatorLogic.made[-1]
        self.assertTrue(logic.prepared)
        self.assertEqual(
            logic.called, {"quality": "normal", "task": "total", "interactive": True, "subset": None}
        )
        self.assertEqual(self.ui.segmentButton.text, "Segment bones")

    def test_what_it_does_is_said_and_the_application_goes_on(self) -> None:
        fakes.TotalSegmentatorLogic.seconds = 1
        seen: list[tuple[str, str, bool]] = []

        def look() -> None:
            seen.append((self.said, self.ui.segmentButton.text, self.panel.segment.running))
            self.panel.segment.start()  # a second one does not start

        self.later(lambda: "child" in self.said, look)
        self.ui.segmentButton.click()
        self.assertRegex(seen[0][0], r"^TotalSegmentator: child \d+$")
        self.assertEqual(seen[0][1:], ("Cancel", True))
        self.assertEqual(len(fakes.TotalSegmentatorLogic.made), 1)
        self.assertEqual(self.segmentations(), 1)

    def cancelled_by(self, action: Any) -> int:
        """Segment for long, act meanwhile, and return the child's child."""
        fakes.TotalSegmentatorLogic.seconds = 60
        pids: list[int] = []

        def act() -> None:
            pids.append(int(self.said.split()[-1]))
            action()

        self.later(lambda: "child" in self.said, act)
        start = time.monotonic()
        self.ui.segmentButton.click()
        self.assertLess(time.monotonic() - start, 20)
        self.assertFalse(_outlives(pids[0]), "a descendant of the process still runs")
        self.assertFalse(Path(fakes.TotalSegmentatorLogic.made[-1].folder).exists(), "the CT was left")
        return pids[0]

    def test_cancel_ends_it_and_leaves_nothing(self) -> None:
        self.cancelled_by(self.ui.segmentButton.click)
        self.assertIn("cancelled", self.said)
        self.assert_nothing_made()

    def test_a_deleted_ct_ends_it(self) -> None:
        self.cancelled_by(lambda: slicer.mrmlScene.RemoveNode(self.ct))
        self.assertIn("'CT' was deleted", self.said)
        self.wait(lambda: self.panel.parameters.ct is None, 5)
        self.assert_nothing_made()
        self.assertFalse(self.ui.segmentButton.enabled)

    def test_a_closed_scene_ends_it(self) -> None:
        self.cancelled_by(slicer.mrmlScene.Clear)
        self.assert_nothing_made()

    def test_a_closed_window_ends_it(self) -> None:
        self.cancelled_by(lambda: application_signal("lastWindowClosed"))
        self.assert_nothing_made()
        self.assertFalse(
            slicer.app.disconnect("lastWindowClosed()", self.panel.segment.close), "still connected"
        )

    def test_failures_are_one_sentence(self) -> None:
        fakes.TotalSegmentatorLogic.refusal = "User cancelled."
        self.ui.segmentButton.click()
        self.assertIn("(User cancelled)", self.said)
        self.assert_nothing_made()
        fakes.TotalSegmentatorLogic.refusal = ""
        fakes.TotalSegmentatorLogic.code = 3
        self.ui.segmentButton.click()
        self.assertIn("ended with the code 3", self.said)
        self.assertFalse(Path(fakes.TotalSegmentatorLogic.made[-1].folder).exists(), "the CT was left")
        self.assert_nothing_made()
        fakes.TotalSegmentatorLogic.code, fakes.TotalSegmentatorLogic.names = 0, {}
        self.ui.segmentButton.click()
        self.assertIn("found nothing in 'CT'", self.said)
        self.assert_nothing_made()

    def test_another_ct_that_is_chosen_meanwhile_keeps_its_own_segmentation(self) -> None:
        fakes.TotalSegmentatorLogic.seconds = 1
        other = scenes.add_ct(None, "other")
        self.later(lambda: "child" in self.said, lambda: self.ui.ctSelector.setCurrentNode(other))
        self.ui.segmentButton.click()
        self.assertIsNone(self.panel.parameters.segmentation)
        self.assertEqual(self.segmentations(), 1)
        self.assertIn("'CT bones' is ready", self.said)

    def test_it_goes_on_while_another_module_is_open(self) -> None:
        fakes.TotalSegmentatorLogic.seconds = 1
        self.later(lambda: "child" in self.said, self.leave)
        parameters = self.panel.parameters
        self.ui.segmentButton.click()
        self.assertIsNotNone(parameters.segmentation)
        self.assertEqual(structures_of(parameters), {})
        self.open()
        self.assertEqual(self.panel.parameters.anchor, "pelvis")

    def test_without_a_ct_there_is_nothing_to_press(self) -> None:
        self.assertTrue(self.ui.segmentButton.enabled)
        self.ui.ctSelector.setCurrentNode(None)
        self.assertFalse(self.ui.segmentButton.enabled)
        self.assertIn("Choose the CT", self.ui.segmentButton.toolTip)

    def test_an_extension_that_cannot_be_loaded_is_one_sentence(self) -> None:
        with mock.patch.dict(sys.modules, {"TotalSegmentator": None}):
            self.ui.segmentButton.click()
        self.assertIn("cannot be loaded", self.said)
        self.assert_nothing_made()


class MonaiTest(SegmentCase):
    name = "MONAIAuto3DSeg"

    def logic(self) -> Any:
        return fakes.MONAIAuto3DSegLogic.made[-1]

    def test_the_ct_is_segmented_in_the_background(self) -> None:
        self.ui.segmentButton.click()
        self.assertTrue(self.panel.segment.running)
        self.assertEqual(self.ui.segmentButton.text, "Cancel")
        self.assertIn("MONAIAuto3DSeg: computing", self.said)
        self.wait(lambda: not self.panel.segment.running, 10)
        self.assertEqual(self.panel.parameters.anchor, "pelvis")
        self.assertIn("femur_left", structures_of(self.panel.parameters))
        self.assertEqual(self.logic().downloaded, ["whole-body-v2.0.0"])
        self.assertEqual(self.logic().setups, 1)
        self.ui.segmentButton.click()
        self.wait(lambda: not self.panel.segment.running, 10)
        self.assertEqual(self.logic().setups, 0, "packages that are installed are not installed again")
        self.assertEqual(self.panel.parameters.segmentation.GetName(), "CT bones_1")

    def test_cancel_and_close_and_deletion_leave_nothing(self) -> None:
        fakes.MONAIAuto3DSegLogic.seconds = 0.3
        for action in (
            self.ui.segmentButton.click,
            lambda: slicer.mrmlScene.RemoveNode(self.panel.segment._active.task.segmentation),
            lambda: slicer.mrmlScene.RemoveNode(self.ct),
        ):
            self.ui.segmentButton.click()
            action()
            self.wait(lambda: not self.panel.segment.running, 10)
            self.assert_nothing_made()
        self.assertIn("'CT' was deleted", self.said)
        self.ct = scenes.add_ct()
        self.ui.ctSelector.setCurrentNode(self.ct)
        self.ui.segmentButton.click()
        slicer.mrmlScene.Clear()
        self.assert_nothing_made()
        end = time.monotonic() + 0.5
        self.wait(lambda: time.monotonic() > end)  # the extension tells of its own end
        self.assertFalse(any(logic.imported for logic in fakes.MONAIAuto3DSegLogic.made))

    def test_failures_are_one_sentence(self) -> None:
        fakes.MONAIAuto3DSegLogic.code = 1
        self.ui.segmentButton.click()
        self.wait(lambda: not self.panel.segment.running, 10)
        self.assertIn("ended with the code 1", self.said)
        self.assert_nothing_made()
        fakes.MONAIAuto3DSegLogic.code, fakes.MONAIAuto3DSegLogic.fails_to_import = 0, True
        self.ui.segmentButton.click()
        self.wait(lambda: not self.panel.segment.running, 10)
        self.assertIn("could not be read", self.said)
        self.assert_nothing_made()
        with mock.patch.object(fakes, "MODELS", [fakes.MODELS[0]]):
            self.ui.segmentButton.click()
        self.assertIn("no model of bones", self.said)
        self.assert_nothing_made()


class NoExtensionTest(SegmentCase):
    def manager(self, **changes: Any) -> Any:
        """The extensions manager's model: the methods and the property that qSlicerExtensionsManagerModel.h has."""
        installed: list[str] = []

        def install(name: str, restart: bool = True, update: bool = False) -> bool:
            installed.append(name)
            self.assertFalse(model.interactive, "it would ask a second time")
            self.assertFalse(restart)
            return True

        model = types.SimpleNamespace(
            interactive=True,
            isExtensionInstalled=lambda name: name in installed,
            installExtensionFromServer=install,
        )
        model.__dict__.update(changes)
        self.restart = mock.Mock()
        application = types.SimpleNamespace(extensionsManagerModel=lambda: model, confirmRestart=self.restart)
        if INSIDE_SLICER and hasattr(slicer.app, "extensionsManagerModel"):  # a build may have none
            real = slicer.app.extensionsManagerModel()
            for owner, fake in ((slicer.app, application), (real, model)):
                self.assertEqual([name for name in vars(fake) if not hasattr(owner, name)], [])
        # Methods of Qt objects cannot be replaced in the application.
        shown = types.SimpleNamespace(app=application, util=slicer.util, modules=slicer.modules)
        self._patch(mock.patch.object(extensions, "slicer", shown))
        self._patch(mock.patch.object(extensions, "is_testing", return_value=False))
        self.confirm = mock.Mock(return_value=True)
        self._patch(mock.patch.object(slicer.util, "confirmOkCancelDisplay", self.confirm))
        return model

    def test_nothing_is_installed_while_testing(self) -> None:
        self.ui.segmentButton.click()
        self.assertIn("install one in the Extensions Manager", self.said)
        self.assert_nothing_made()

    def test_one_is_offered_installed_and_the_restart_is_asked_for(self) -> None:
        model = self.manager()
        self.ui.segmentButton.click()
        self.confirm.assert_called_once()
        self.restart.assert_called_once()
        self.assertTrue(model.interactive)
        self.assertIn("restart Slicer", self.said)
        self.ui.segmentButton.click()
        self.assertIn("is not loaded", self.said)
        self.confirm.assert_called_once()

    def test_a_refusal_and_a_failure_are_said(self) -> None:
        self.manager(installExtensionFromServer=lambda *_: False)
        self.ui.segmentButton.click()
        self.assertIn("could not be installed", self.said)
        self.confirm.return_value = False
        self.ui.segmentButton.click()
        self.assertIn("install one in the Extensions Manager", self.said)
        self.restart.assert_not_called()


if __name__ == "__main__":
    unittest.main()
