"""The panel's search for initial cameras: by a child process; an uncertain camera is shown and not used silently."""

from __future__ import annotations

import json
import unittest

import children
import landmark_case
import numpy as np
import scenes
import slicer
from cameras_case import CamerasCase, found
from panel_case import INSIDE_SLICER, type_into
from PolyPoseSlicer import calls
from PolyPoseSlicer.process import registration
from PolyPoseSlicer.process.camera_run import found_in
from PolyPoseSlicer.process.dependencies import has_torch
from PolyPoseSlicer.scene.cameras import camera_of
from PolyPoseSlicer.study import parameters
from PolyPoseSlicer.study.camera_source import CameraSource
from PolyPoseSlicer.study.xray_source import XraySource

from PolyPoseLib.data.found_camera import FoundCamera
from PolyPoseLib.errors import InputError


class FindTest(CamerasCase):
    def test_a_sure_camera_is_taken_and_told(self) -> None:
        self.choose(CameraSource.SEARCH)
        self.ui.standardView.currentIndex = self.ui.standardView.findText("PA")
        self.answer(found())
        self.find()
        arguments, study = self.asked()
        self.assertEqual(arguments[0], "cameras")
        self.assertEqual(arguments[arguments.index("--method") + 1], "search")
        (entry,) = study["xrays"]
        self.assertEqual((entry["standard_view"], entry["camera"]), ("PA", "absent"))
        _intrinsics, extrinsic = scenes.camera_matrix()
        source = self.source()
        np.testing.assert_allclose(camera_of(source.camera_transform).extrinsic, extrinsic, atol=1e-9)
        self.assertTrue(source.found.taken)
        entry = source.entry("x", None)
        np.testing.assert_allclose(entry["extrinsic"], extrinsic, atol=1e-9)
        self.assertEqual(entry["camera"], "initial")
        text = self.ui.foundCameraText.text
        for part in ("searched around PA", "2 deg and 10 mm", "0.71", "the next best 0.42"):
            self.assertIn(part, text)
        self.assertNotIn("9888", text)
        self.assertIn("found, within 2 deg", self.ui.xraysTable.item(0, 2).text())
        self.assertIn("1 found", self.ui.cameraStage.text)
        self.assertIn("none yet", self.ui.xraysTable.item(1, 2).text())

    def test_an_uncertain_camera_waits_for_a_person(self) -> None:
        self.choose(CameraSource.SEARCH)
        self.answer(found(sure=False))
        self.find()
        self.assertIsNone(self.source().camera_transform)
        self.assertNotIn("extrinsic", self.source().entry("x", None))
        text = self.ui.foundCameraText.text
        for part in ("9888", "color", "0.69", "not in use", "another view &lt;explains&gt;"):
            self.assertIn(part, text)
        self.assertIn("1 uncertain and not in use", self.ui.cameraStage.text)
        self.assertIn("uncertain", self.ui.xraysTable.item(0, 2).text())
        self.ui.showFoundCamera.click()
        self.wait(lambda: self.panel.carm.seconds)
        _intrinsics, extrinsic = scenes.camera_matrix()
        placed = self.panel.carm.placement().extrinsic(self.panel.carm.reference())
        np.testing.assert_allclose(placed[:3, 3], extrinsic[:3, 3], atol=2.0)
        self.assertIsNone(self.source().camera_transform)
        self.ui.acceptFoundCamera.click()
        np.testing.assert_allclose(self.source().entry("x", None)["extrinsic"], extrinsic, atol=1e-9)
        self.assertIn("accepted by you", self.ui.xraysTable.item(0, 2).text())
        self.assertIn("9888", self.ui.foundCameraText.text)
        self.assertFalse(self.ui.acceptFoundCamera.enabled)
        self.ui.discardFoundCamera.click()
        self.assertIsNone(self.source().found)
        self.assertNotIn("extrinsic", self.source().entry("x", None))

    def test_all_xrays_without_a_camera(self) -> None:
        self.choose(CameraSource.SEARCH, 0)
        self.choose(CameraSource.DICOM, 1)
        self.answer(found(), found(sure=False))
        self.ui.findCameras.click()
        self.wait(lambda: not self.panel.cameras.running)
        arguments, study = self.asked()
        self.assertEqual(arguments[arguments.index("--method") + 1], "auto")
        self.assertEqual([entry["name"] for entry in study["xrays"]], ["X-ray 1", "X-ray 2"])
        self.assertEqual([self.source(row).found.taken for row in (0, 1)], [True, False])
        self.answer(found())
        self.ui.findCameras.click()
        self.wait(lambda: not self.panel.cameras.running)
        self.assertEqual([entry["name"] for entry in self.asked()[1]["xrays"]], ["X-ray 2"])
        self.ui.findCameras.click()
        self.assertIn("Every X-ray already has an initial camera", self.ui.cameraStage.text)

    def test_another_source_forgets_what_was_found(self) -> None:
        self.choose(CameraSource.SEARCH)
        self.answer(found())
        self.find()
        self.choose(CameraSource.DICOM)
        self.assertIsNone(self.source().found)
        self.assertIsNone(self.source().camera_transform)
        self.assertIn("no angles", self.ui.foundCameraText.text)

    def test_an_xray_that_changed_meanwhile_is_left(self) -> None:
        self.choose(CameraSource.SEARCH)
        self.answer(found())
        self.ui.findCamera.click()
        self.ui.xrayDistance.text = "900"
        self.panel.xrays._details._edited()
        self.wait(lambda: not self.panel.cameras.running)
        self.assertIsNone(self.source().found)
        self.assertIn("changed meanwhile", self.ui.cameraStage.text)

    def test_sources_that_need_no_search(self) -> None:
        for source in (CameraSource.CARM, CameraSource.CALIBRATION):
            self.choose(source)
            self.assertFalse(self.ui.findCamera.enabled)
            self.assertIn("needs no search", self.ui.findCamera.toolTip)
        self.assertIn("Choose the calibration file", self.ui.foundCameraText.text)

    def test_a_calibrated_camera_is_shown_at_once(self) -> None:
        rng = np.random.default_rng(2)
        camera = landmark_case.random_camera(rng)
        path = self.folder / "camera.csv"
        np.savetxt(path, camera.intrinsics @ camera.extrinsic[:3], delimiter=",")
        self.choose(CameraSource.CALIBRATION)
        self.ui.calibrationFile.currentPath = str(path)
        xray = self.panel.xrays.report().xray
        np.testing.assert_allclose(xray.extrinsic, camera.extrinsic, atol=1e-6)
        self.assertEqual(self.source().entry("x", None)["calibration_frame"], "ct")
        self.assertIn("calibrated camera", self.ui.xraysTable.item(0, 1).text())
        path.write_text("1 2 3")
        self.ui.calibrationFile.currentPath = ""
        self.ui.calibrationFile.currentPath = str(path)
        self.assertEqual(self.ui.xraysTable.item(0, 3).text(), "not ready")
        self.assertIn("3 rows of 4 numbers", self.ui.xrayState.text)

    def test_a_path_may_be_cleared_and_may_have_any_ending(self) -> None:
        self.choose(CameraSource.CALIBRATION)
        for path in ("/given/camera.CSV", "/given/rig.dat", ""):
            self.ui.calibrationFile.currentPath = path
            self.assertEqual(self.source().fields.get("calibration", ""), path)
            self.ui.threads.value = 3 - self.ui.threads.value  # everything is shown anew
            self.assertEqual(self.ui.calibrationFile.currentPath, path)

    def test_a_trained_model_is_handed_on_and_only_where_it_is_used(self) -> None:
        self.choose(CameraSource.LEARNED)
        self.assertFalse(self.ui.findCamera.enabled)
        self.assertIn("Choose the model file", self.ui.foundCameraText.text)
        self.ui.cameraModel.currentPath = "/models/pelvis.pt"
        self.assertTrue(self.ui.findCamera.enabled)
        self.answer(found(sure=False))
        self.find()
        arguments, study = self.asked()
        self.assertEqual(arguments[arguments.index("--method") + 1], "learned")
        self.assertEqual(study["options"]["camera_model"], "/models/pelvis.pt")
        self.assertEqual(study["xrays"][0]["camera"], "absent")
        self.ui.threads.value = 2
        self.assertEqual(parameters.camera_model_of(self.panel.parameters), "/models/pelvis.pt")
        self.choose(CameraSource.SEARCH, 1)
        self.choose(CameraSource.SEARCH, 0)
        self.assertNotIn("camera_model", parameters.options_of(self.panel.parameters))
        self.choose(CameraSource.LEARNED)
        self.ui.cameraModel.currentPath = ""
        self.assertNotIn("camera_model", parameters.options_of(self.panel.parameters))

    def rig(self, name: str, row: int) -> None:
        """Type a rig's name for an X-ray, whose camera was calibrated."""
        self.choose(CameraSource.SEARCH, row)
        camera = landmark_case.random_camera(np.random.default_rng(row))
        path = self.folder / f"camera{row}.csv"
        np.savetxt(path, camera.intrinsics @ camera.extrinsic[:3], delimiter=",")
        self.ui.calibrationFile.currentPath = str(path)
        type_into(self.ui.rigName, name)

    def test_a_rig_needs_two_xrays_and_is_searched_together(self) -> None:
        self.rig("biplane", 0)
        self.assertEqual(self.source(0).fields["rig"], "biplane")
        self.assertFalse(self.ui.findCamera.enabled)
        self.assertIn('The rig "biplane" has only one X-ray', self.ui.findCamera.toolTip)
        self.assertFalse(self.ui.registerButton.enabled)
        self.rig("biplane", 1)
        self.assertTrue(self.ui.findCamera.enabled)
        self.answer(found(), found(name="lateral"))
        self.find()
        study = self.asked()[1]
        self.assertEqual([entry["rig"] for entry in study["xrays"]], ["biplane", "biplane"])
        self.assertTrue(all(self.source(row).found.taken for row in (0, 1)))
        self.assertNotIn("calibration_frame", study["xrays"][0])
        self.rig("", 1)
        self.assertNotIn("rig", self.source(1).fields)
        self.rig("", 0)
        self.assertEqual(self.ui.rigName.text, "")

    def test_calibration_and_rig_show_where_they_serve(self) -> None:
        self.panel.steps.open("cameraSection")  # a closed section hides what is in it
        for source, shown in (
            (CameraSource.AUTO, True),
            (CameraSource.LANDMARKS, False),
            (CameraSource.CALIBRATION, True),
            (CameraSource.SEARCH, False),
        ):
            self.choose(source)
            for widget in (self.ui.calibrationFile, self.ui.rigName, self.ui.rigNameLabel):
                self.assertEqual(not widget.isHidden(), shown, source)
        self.ui.calibrationFile.currentPath = str(self.folder / "intrinsics.csv")
        self.assertFalse(self.ui.calibrationFile.isHidden())  # it serves this source, too

    def test_a_rig_without_a_calibration_says_what_it_lacks(self) -> None:
        self.choose(CameraSource.SEARCH)
        type_into(self.ui.rigName, "biplane")
        self.assertEqual(self.ui.xraysTable.item(0, 3).text(), "not ready")
        self.assertIn("nothing gives its place in it", self.ui.xrayState.text)

    def test_what_is_missing_is_the_tool_tip(self) -> None:
        self.ui.segmentationSelector.setCurrentNode(None)
        self.assertFalse(self.ui.findCamera.enabled)
        self.assertIn("segmentation", self.ui.findCamera.toolTip)
        with self.assertRaisesRegex(InputError, "segmentation"):
            calls.start_cameras(self.panel.parameters, [0])


class EndsTest(CamerasCase):
    def test_cancel(self) -> None:
        self.child(children.SLEEP_FOREVER)
        self.ui.findCamera.click()
        self.wait(lambda: "1 of 10" in self.ui.cameraStage.text)
        self.ui.findCamera.click()
        self.wait(lambda: not self.panel.cameras.running, 5)
        self.assertIn("Cancelled", self.ui.cameraStage.text)
        self.assertEqual(self.ui.findCamera.text, "Find camera")
        self.assertEqual(registration.leftover_folders(), [])

    def test_the_childs_sentence_is_shown(self) -> None:
        self.child("print('polypose: the anchor shows in no view', file=sys.stderr)\nsys.exit(3)")
        self.find()
        self.assertIn("the anchor shows in no view", self.ui.cameraStage.text)
        self.assertIn("9888", self.ui.cameraStage.text)
        self.assertIsNone(self.source().found)

    def test_a_damaged_report_is_a_sentence(self) -> None:
        self.child(
            "Path(arguments[arguments.index('--report') + 1]).write_text('{\"cameras\": [{\"number\": 0}]}')"
        )
        self.find()
        self.assertIn("cannot be read", self.ui.cameraStage.text)

    def test_closing_the_scene_ends_it(self) -> None:
        self.child(children.SLEEP_FOREVER)
        self.ui.findCamera.click()
        self.wait(lambda: "1 of 10" in self.ui.cameraStage.text)
        slicer.mrmlScene.Clear()
        self.assertFalse(self.panel.cameras.running)
        self.assertEqual(registration.leftover_folders(), [])

    def test_it_goes_on_while_another_module_is_open(self) -> None:
        self.choose(CameraSource.SEARCH)
        self.answer(found())
        self.ui.findCamera.click()
        self.panel.exit()
        self.wait(lambda: not self.panel.cameras.running)
        self.panel.enter()
        self.assertTrue(self.source().found.taken)

    def test_what_was_found_is_saved_with_the_scene(self) -> None:
        self.choose(CameraSource.SEARCH)
        self.answer(found(sure=False))
        self.find()
        before = self.source().found
        path = str(self.folder / "scene.mrb")
        self.assertTrue(slicer.util.saveScene(path))
        slicer.mrmlScene.Clear()
        slicer.util.loadScene(path)
        self.wait(lambda: self.ui.xraysTable.rowCount == 2, 5)
        self.assertEqual(self.source().found, before)
        self.assertIs(self.source().camera_source, CameraSource.SEARCH)
        self.ui.xraysTable.selectRow(0)
        self.assertTrue(self.ui.acceptFoundCamera.enabled)


class FoundCameraTest(CamerasCase):
    def test_a_finding_comes_back_from_what_is_stored(self) -> None:
        finding = FoundCamera.from_dict(found(sure=False))
        self.assertEqual(FoundCamera.from_dict(json.loads(json.dumps(finding.to_dict()))), finding)

    def test_a_scene_of_an_earlier_version_gives_its_source_and_its_finding(self) -> None:
        stored = (
            '{"source_to_detector_mm": 1000.0, "path": "/data/ap.png", "frame": null, "way": "search", '
            '"found": {"how": "search", "sure": false, "extrinsic": [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], '
            '[0.0, 0.0, 1.0, 800.0], [0.0, 0.0, 0.0, 1.0]], "mirrored": true, "within": [2.0, 10.0], '
            '"warnings": ["look at it"], "similarity": 0.8, "runner_up": 0.7, "taken": false}}'
        )
        node = self.panel.parameters
        was = node.StartModify()
        node.xrayImages, node.xrayCameras, node.xrayTexts = [None], [None], [stored]
        node.EndModify(was)
        (source,) = parameters.xray_sources(node)
        self.assertEqual(
            (source.path, source.frame, source.camera_source), ("/data/ap.png", None, CameraSource.SEARCH)
        )
        self.assertEqual(source.fields, {"source_to_detector_mm": 1000.0})
        camera = source.found
        self.assertEqual(
            (camera.how, camera.sure, camera.mirrored, camera.taken), ("search", False, True, False)
        )
        self.assertEqual((camera.within, camera.warnings), ((2.0, 10.0), ("look at it",)))
        self.assertEqual((camera.similarity, camera.runner_up, camera.extrinsic[2, 3]), (0.8, 0.7, 800.0))

    def test_damaged_findings_are_refused(self) -> None:
        for damage in (
            {"extrinsic": [[1]]},
            {"within": None},
            {"similarity": "high"},
            {"extrinsic": [[float("nan")] * 4] * 4},
        ):
            with self.assertRaises(InputError):
                FoundCamera.from_dict(found() | damage)
        report = self.folder / "report.json"
        report.write_text("[]")
        with self.assertRaisesRegex(registration.RunError, "search again"):
            found_in(report)


class CoreTest(CamerasCase):
    """The real child: PolyPoseLib itself, on landmarks, which take no rendering."""

    @unittest.skipIf(INSIDE_SLICER and not has_torch(), "needs PyTorch in PythonSlicer")
    def test_landmarks_of_the_scene_give_the_true_camera(self) -> None:
        rng = np.random.default_rng(8)
        camera = landmark_case.random_camera(rng)
        points = landmark_case.points_in_ct(rng, 24)  # so many leave nothing to search
        source = XraySource(
            self.xrays[0],
            fields=landmark_case.fields_of(camera),
            camera_source=CameraSource.LANDMARKS,
            ct_landmarks=landmark_case.add_ct_list(points),
            xray_landmarks=landmark_case.add_xray_list(camera.project(points)),
        )
        parameters.store_xray_sources(self.panel.parameters, [source, self.source(1)])
        self.ui.xraysTable.selectRow(0)
        self.ui.findCamera.click()
        self.wait(lambda: not self.panel.cameras.running, 90)
        finding = self.source().found
        self.assertIsNotNone(finding, self.ui.cameraStage.text)
        self.assertIn("24 of 24 landmarks", finding.how)
        self.assertTrue(finding.taken)
        np.testing.assert_allclose(finding.extrinsic, camera.extrinsic, atol=1e-3)
        np.testing.assert_allclose(self.source().entry("x", None)["extrinsic"], camera.extrinsic, atol=1e-3)


if __name__ == "__main__":
    unittest.main()
