"""The Register section with real child processes: the button, progress, the curve, the preview, and the end."""

from __future__ import annotations

import json
import time
import unittest

import children
import scenes
import slicer
from panel_case import PanelCase
from PolyPoseSlicer.study import parameters

GO_ON = """
for n in range(1, 6):
    tell(n, of=5, similarity=0.1 * n)
while not Path({flag!r}).exists():
    time.sleep(0.02)
"""
PREVIEW = """
import SimpleITK as sitk
field = sitk.Image([4, 4, 4], sitk.sitkVectorFloat64, 3)
field.SetSpacing([40.0] * 3); field.SetOrigin([-60.0] * 3)
field = field + 7.0
sitk.WriteTransform(sitk.DisplacementFieldTransform(field), preview)
tell(1, similarity=0.3, preview=preview)
while True:
    time.sleep(0.02)
"""
DISTRUST = ("the similarity did not rise",)


class RegisterTest(PanelCase):
    def setUp(self) -> None:
        super().setUp()
        self.fill()
        self.nodes = slicer.mrmlScene.GetNumberOfNodes()

    @property
    def button(self) -> str:
        return self.ui.registerButton.text

    def end(self) -> None:
        self.wait(lambda: not self.panel.register.running and not self.panel.review.bones.busy)

    def test_progress_curve_and_result(self) -> None:
        flag = self.folder / "go"
        self.give_result(GO_ON.format(flag=str(flag)))
        self.ui.registerButton.click()
        self.assertEqual(self.button, "Cancel")
        self.wait(lambda: "5 of 5" in self.ui.stageLabel.text)
        self.assertIn("similarity 0.5000", self.ui.stageLabel.text)
        self.assertEqual((self.ui.progressBar.value, self.ui.progressBar.maximum), (5, 5))
        node = self.panel.parameters
        self.assertEqual(node.outputSimilarity.GetTable().GetNumberOfRows(), 5)
        self.assertIs(node.outputPlot.GetNthPlotSeriesNode(0), node.outputSeries)
        flag.touch()
        self.end()
        self.assertEqual(self.button, "Register")
        self.assertIn("Done in 2 s", self.ui.messageLabel.text)
        facts = dict(self.panel.saving.report_page(node).facts)
        self.assertEqual(facts["Computing time [s]"], "2")
        self.assertIsNotNone(node.outputTransform)
        self.assertEqual(self.ui.motionsTable.rowCount, 2)
        self.assertTrue(self.ui.showAfter.checked)
        self.assertIn("something was odd", self.ui.reviewState.text)
        self.assertFalse(self.ui.progressBar.visible)

    def test_a_second_run_fills_the_same_nodes(self) -> None:
        self.give_result()
        self.ui.registerButton.click()
        self.end()
        node = self.panel.parameters
        first, count = node.outputVolume, slicer.mrmlScene.GetNumberOfNodes()
        self.ui.registerButton.click()
        self.end()
        self.assertIs(node.outputVolume, first)
        self.assertEqual(slicer.mrmlScene.GetNumberOfNodes(), count)

    def test_cancel_says_cancelling_and_leaves_nothing(self) -> None:
        self.child(children.SLEEP_FOREVER)
        self.ui.registerButton.click()
        self.wait(lambda: "1 of 10" in self.ui.stageLabel.text)
        began = time.monotonic()
        self.ui.registerButton.click()
        self.assertEqual(self.button, "Cancelling...")
        self.assertFalse(self.ui.registerButton.enabled)
        self.end()
        self.assertLess(time.monotonic() - began, 20.0)
        self.assertIn("Cancelled", self.ui.messageLabel.text)
        self.assertEqual(slicer.mrmlScene.GetNumberOfNodes(), self.nodes)
        self.assertEqual(self.button, "Register")

    def test_the_slices_move_while_it_runs_and_are_put_back(self) -> None:
        self.child(PREVIEW)
        self.ui.registerButton.click()
        self.wait(lambda: self.ct.GetParentTransformNode() is not None)
        self.assertIs(self.segmentation.GetParentTransformNode(), self.ct.GetParentTransformNode())
        self.ui.registerButton.click()
        self.end()
        self.assertIsNone(self.ct.GetParentTransformNode())
        self.assertIsNone(self.segmentation.GetParentTransformNode())
        self.assertEqual(slicer.mrmlScene.GetNumberOfNodes(), self.nodes)

    def test_after_a_cancelled_run_the_names_are_free_again(self) -> None:
        names = []
        for _run in range(2):
            self.child(PREVIEW)
            self.ui.registerButton.click()
            self.wait(lambda: self.ct.GetParentTransformNode() is not None)
            names.append(self.ct.GetParentTransformNode().GetName())
            self.ui.registerButton.click()
            self.end()
        self.give_result()
        self.ui.registerButton.click()
        self.end()
        outputs = self.panel.parameters
        self.assertEqual(names, [outputs.outputTransform.GetName()] * 2)
        for node in (outputs.outputVolume, outputs.outputSimilarity, outputs.outputPlot):
            self.assertNotRegex(node.GetName(), r"_\d+$")

    def test_stages_are_told_in_words_and_the_last_one_is_saving(self) -> None:
        self.child(
            "tell(3, stage='camera AP')\ntime.sleep(0.5)\ntell(1, 1, stage='done')\n"
            "while True:\n    time.sleep(0.05)\n"
        )
        self.ui.registerButton.click()
        self.wait(lambda: self.ui.stageLabel.text == "Camera of AP: 3 of 10, similarity 0.5000")
        self.wait(lambda: self.ui.stageLabel.text == "Saving the result...")
        self.assertEqual(self.ui.progressBar.maximum, 0)

    def test_without_preview_nothing_moves(self) -> None:
        self.ui.livePreview.checked = False
        self.child("tell(1)\nassert preview is None\n" + children.SLEEP_FOREVER)
        self.ui.registerButton.click()
        self.wait(lambda: "1 of 10" in self.ui.stageLabel.text)
        self.assertIsNone(self.ct.GetParentTransformNode())

    def test_the_childs_sentence_is_shown(self) -> None:
        self.child("print('polypose: the X-ray is upside down', file=sys.stderr)\nsys.exit(2)")
        self.ui.registerButton.click()
        self.end()
        self.assertEqual(self.ui.messageLabel.text, "the X-ray is upside down")
        self.assertEqual(slicer.mrmlScene.GetNumberOfNodes(), self.nodes)

    def test_a_result_that_must_not_be_trusted_is_shown_and_said(self) -> None:
        folder = scenes.save_result(self.folder / "given", distrust=DISTRUST)
        self.child(f"import shutil\nshutil.copytree('{folder}', output)\nsys.exit(3)")
        self.ui.registerButton.click()
        self.end()
        self.assertIn("must not be trusted", self.ui.messageLabel.text)
        self.assertIn("DO NOT TRUST", self.ui.verdictLabel.text)
        self.assertIsNotNone(self.panel.parameters.outputVolume)

    def test_options_reach_the_study(self) -> None:
        ui = self.ui
        ui.presetSelector.currentIndex = 1
        ui.deviceSelector.currentIndex = 1
        ui.refineCameras.checked = False
        ui.uncertainty.checked = False
        ui.threads.value = 2
        ui.seed.value = 7
        expected = {"refine_cameras": False, "uncertainty": False, "threads": 2, "seed": 7}
        self.assertEqual(
            parameters.options_of(self.panel.parameters), {**expected, "preset": "fast", "device": "cpu"}
        )
        ui.threads.value = 0
        self.assertNotIn("threads", json.loads(self.panel.parameters.options))

    def test_the_result_folder_is_kept_and_loaded_again_with_its_names(self) -> None:
        self.give_result()
        kept = self.folder / "kept"
        self.ui.outputFolder.currentPath = str(kept)
        self.ui.registerButton.click()
        self.end()
        self.assertTrue((kept / "result.json").is_file())
        self.panel.review.load_result(str(kept))
        content = self.panel.parameters.outputSegmentation.GetSegmentation()
        self.assertEqual(content.GetNthSegment(0).GetName(), "pelvis")

    def test_a_poll_does_not_hold_up_the_application(self) -> None:
        flag = self.folder / "go"
        self.give_result(GO_ON.format(flag=str(flag)))
        self.ui.registerButton.click()
        longest, register = 0.0, self.panel.register
        deadline = time.monotonic() + 20
        while "5 of 5" not in self.ui.stageLabel.text and time.monotonic() < deadline:
            began = time.thread_time()  # its own work: machines are busy
            register._poll()
            longest = max(longest, time.thread_time() - began)
            time.sleep(0.02)
        self.assertLess(longest, 0.05)
        flag.touch()
        self.end()


if __name__ == "__main__":
    unittest.main()
