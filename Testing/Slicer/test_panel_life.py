"""The panel's life: opened, left, reloaded, its scene closed and loaded, and the application's end."""

from __future__ import annotations

import unittest

import children
import scenes
import slicer
from panel_case import INSIDE_SLICER, PanelCase, child_processes
from PolyPoseSlicer.process import registration
from PolyPoseSlicer.scene import xray_views
from PolyPoseSlicer.study import parameters
from PolyPoseSlicer.study.result_origin import remember_segments


class LifeTest(PanelCase):
    def processes(self) -> list[str]:
        return [each for each in child_processes() if each not in self.before]

    def run_live(self) -> None:
        self.fill()
        self.ui.xraysTable.selectRow(0)
        self.ui.carmLive.checked = True
        self.wait(lambda: self.panel.carm.seconds)
        self.assertTrue(self.processes() or INSIDE_SLICER)

    def start(self) -> None:
        self.fill()
        self.child(children.SLEEP_FOREVER)
        self.ui.registerButton.click()
        self.wait(lambda: "1 of 10" in self.ui.stageLabel.text)

    def gone(self) -> None:
        self.assertEqual(self.processes(), [])
        self.assertEqual(registration.leftover_folders(), [])

    def test_leaving_the_module_stops_the_renderer_and_all_observers_of_nodes(self) -> None:
        self.run_live()
        self.panel.exit()
        self.gone()
        self.assertIsNone(self.panel.parameters)
        observed = {each[0] for each in self.host.Observations}
        self.assertEqual(observed, {slicer.mrmlScene})
        self.panel.enter()
        self.assertIs(self.ui.ctSelector.currentNode(), self.ct)
        self.assertEqual(self.ui.xraysTable.rowCount, 2)

    def test_a_registration_goes_on_while_another_module_is_open(self) -> None:
        self.give_result("time.sleep(0.5)\n")
        self.fill()
        self.ui.registerButton.click()
        self.panel.exit()
        self.wait(lambda: not self.panel.register.running)
        self.gone()
        self.panel.enter()
        self.assertIsNotNone(self.panel.parameters.outputVolume)
        self.assertEqual(self.ui.motionsTable.rowCount, 2)

    def test_closing_the_scene_ends_everything(self) -> None:
        self.run_live()
        self.ui.carmLive.checked = False
        self.child(children.SLEEP_FOREVER)
        self.ui.registerButton.click()
        self.wait(lambda: "1 of 10" in self.ui.stageLabel.text)
        slicer.mrmlScene.Clear()
        self.gone()
        self.assertFalse(self.panel.register.running)
        self.assertIsNone(xray_views.part(0, "image"))
        self.assertEqual(self.ui.structuresTable.rowCount, 0)
        self.assertIn("CT", self.ui.stageLabel.text)
        self.fill()
        self.assertEqual(self.ui.registerButton.text, "Register")

    def test_a_scene_that_is_added_leaves_what_was_chosen(self) -> None:
        self.fill()
        scene, before = slicer.mrmlScene, parameters.xray_sources(self.panel.parameters)
        scene.StartState(scene.ImportState)
        scene.AddNewNodeByClass("vtkMRMLScalarVolumeNode", "another")
        scene.EndState(scene.ImportState)
        self.assertIs(self.ui.ctSelector.currentNode(), self.ct)
        self.assertIs(self.panel.parameters.ct, self.ct)
        self.assertIs(self.panel.parameters.segmentation, self.segmentation)
        self.assertEqual(parameters.xray_sources(self.panel.parameters), before)
        self.assertEqual(self.ui.registerButton.text, "Register")

    def test_unloading_ends_everything(self) -> None:
        self.start()
        self.close()
        self.gone()
        self.open()

    @unittest.skipIf(INSIDE_SLICER, "the application would end")
    def test_quitting_ends_everything(self) -> None:
        self.run_live()
        slicer.app.emit("aboutToQuit()")
        self.gone()
        self.close()
        self.assertEqual(slicer.app.count("aboutToQuit()"), 0)
        self.open()

    def test_reloading_leaves_one_panel(self) -> None:
        self.start()
        self.renew()
        self.gone()
        self.assertEqual(self.left, [])
        self.assertIs(self.ui.ctSelector.currentNode(), self.ct)
        self.assertEqual(self.ui.registerButton.text, "Register")

    def test_a_saved_scene_comes_back_into_the_panel(self) -> None:
        self.fill()
        folder = scenes.save_result(self.folder / "given")
        remember_segments(folder, self.segmentation)
        self.panel.review.load_result(str(folder))
        path = str(self.folder / "scene.mrb")
        self.assertTrue(slicer.util.saveScene(path))
        slicer.mrmlScene.Clear()
        self.assertEqual(self.ui.motionsTable.rowCount, 0)
        slicer.util.loadScene(path)
        self.wait(lambda: self.ui.motionsTable.rowCount == 2, 5)
        self.assertEqual(self.ui.xraysTable.rowCount, 2)
        self.assertEqual(self.panel.parameters.anchor, "pelvis")
        self.ui.layoutButton.click()
        self.assertEqual(len(self.panel.review.pictures.items), 2)
        self.assertEqual(len([n for n in slicer.util.getNodesByClass("vtkMRMLVectorVolumeNode")]), 2)


if __name__ == "__main__":
    unittest.main()
