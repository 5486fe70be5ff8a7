"""The panel's first half: the table of segments, the table of X-rays, and the form below it."""

from __future__ import annotations

import json
import re
import unittest
from dataclasses import replace
from unittest import mock
from xml.etree import ElementTree

import numpy as np
import scenes
import slicer
from panel_case import INSIDE_SLICER, PanelCase, choose_node, type_into
from PolyPoseSlicer.study import parameters
from PolyPoseSlicer.study.field_words import choices, field_labels, in_words

# isort: split
import qt
from slicer_case import REPOSITORY, SlicerTestCase

_CONTROLS = {
    "QPushButton", "QCheckBox", "QRadioButton", "QComboBox", "QSpinBox", "QLineEdit", "QTableWidget",
    "ctkSliderWidget", "ctkPathLineEdit", "qMRMLNodeComboBox",
}  # fmt: skip


class StructuresTest(PanelCase):
    def cells(self) -> list[tuple[str, str, bool]]:
        table = self.ui.structuresTable
        return [
            (
                table.item(row, 0).text(),
                table.item(row, 1).text(),
                table.item(row, 2).checkState() == qt.Qt.Checked,
            )
            for row in range(table.rowCount)
        ]

    def setUp(self) -> None:
        super().setUp()
        self.fill()

    def test_propose_fills_the_table_and_chooses_the_anchor(self) -> None:
        self.assertEqual(
            self.cells(), [("pelvis", "pelvis", True), ("femur", "femur", False), ("plate", "", False)]
        )
        self.assertIn("femur", self.ui.structuresSentence.text)
        self.assertEqual(self.ui.registerButton.text, "Register")

    def test_bones_come_first_and_rows_stay_while_they_are_edited(self) -> None:
        content = self.segmentation.GetSegmentation()
        for name in ("spleen", "Left hip"):
            content.AddEmptySegment(name, name)
        moved = [content.GetNthSegmentID(3)]
        content.SetSegmentIndex(moved[0], 0)
        self.ui.proposeButton.click()
        rows = [name for name, *_ in self.cells()]
        self.assertEqual([bool(structure) for _, structure, _ in self.cells()], [True] * 3 + [False] * 2)
        self.ui.structuresTable.item(0, 0).setCheckState(qt.Qt.Unchecked)
        self.ui.structuresTable.item(4, 1).setText("spleen")
        self.assertEqual([name for name, *_ in self.cells()], rows)
        content.AddEmptySegment("liver", "liver")
        self.assertEqual([bool(structure) for _, structure, _ in self.cells()], [True] * 3 + [False] * 3)

    def test_propose_says_when_no_name_is_a_bone(self) -> None:
        content = self.segmentation.GetSegmentation()
        for number in range(3):
            content.GetNthSegment(number).SetName(f"Segment_{number}")
        self.ui.proposeButton.click()
        self.assertIn("rename", self.ui.structuresSentence.text)

    def test_a_structure_is_typed_renamed_and_emptied(self) -> None:
        table = self.ui.structuresTable
        table.item(2, 1).setText("metal")
        self.assertEqual(self.cells()[2], ("plate", "metal", False))
        table.item(0, 1).setText("hip")
        self.assertEqual(self.panel.parameters.anchor, "hip")
        table.item(2, 1).setText("  ")
        self.assertEqual(set(parameters.structures_of(self.panel.parameters)), {"hip", "femur"})

    def test_a_segment_is_left_out_and_taken_in_again_with_its_structure(self) -> None:
        table = self.ui.structuresTable
        table.item(1, 1).setText("leg")
        table.item(1, 0).setCheckState(qt.Qt.Unchecked)
        self.assertEqual(self.cells()[1], ("femur", "", False))
        table.item(1, 0).setCheckState(qt.Qt.Checked)
        self.assertEqual(self.cells()[1], ("femur", "leg", False))

    def test_another_anchor_and_none(self) -> None:
        table = self.ui.structuresTable
        table.item(1, 2).setCheckState(qt.Qt.Checked)
        self.assertEqual(self.panel.parameters.anchor, "femur")
        self.assertFalse(self.cells()[0][2])
        table.item(1, 0).setCheckState(qt.Qt.Unchecked)
        self.assertIn("anchor", self.ui.stageLabel.text)
        self.assertFalse(self.ui.registerButton.enabled)

    def test_the_table_is_filtered(self) -> None:
        table = self.ui.structuresTable
        self.ui.segmentFilter.text = "PLATE"
        self.assertEqual([table.isRowHidden(row) for row in range(3)], [True, True, False])
        self.ui.segmentFilter.text = ""
        self.ui.includedOnly.checked = True
        self.assertEqual([table.isRowHidden(row) for row in range(3)], [False, False, True])

    def test_changes_of_the_segmentation_are_seen(self) -> None:
        content = self.segmentation.GetSegmentation()
        content.GetNthSegment(2).SetName("rod")
        self.assertEqual(self.cells()[2][0], "rod")
        content.RemoveSegment(content.GetNthSegmentID(1))
        self.assertEqual([name for name, *_ in self.cells()], ["pelvis", "rod"])
        slicer.mrmlScene.RemoveNode(self.segmentation)
        self.assertEqual(self.cells(), [])
        self.assertIn("segmentation", self.ui.stageLabel.text)

    def test_a_deleted_input_is_not_replaced_by_another_that_the_selector_moves_on_to(self) -> None:
        scenes.add_ct(None, "another CT")
        scenes.add_segmentation(self.ct)
        for selector, node in (
            (self.ui.segmentationSelector, self.segmentation),
            (self.ui.ctSelector, self.ct),
        ):
            slicer.mrmlScene.RemoveNode(node)
            self.wait(lambda: selector.currentNode() is None, 5)  # noqa: B023
        self.assertIsNone(self.panel.parameters.ct)
        self.assertIsNone(self.panel.parameters.segmentation)
        self.assertIn("CT", self.ui.stageLabel.text)

    def test_what_is_missing_is_the_buttons_text(self) -> None:
        self.ui.ctSelector.setCurrentNode(None)
        self.assertIn("CT", self.ui.stageLabel.text)
        self.assertFalse(self.ui.registerButton.enabled)


class XraysTest(PanelCase):
    def line(self, row: int) -> list[str]:
        return [self.ui.xraysTable.item(row, column).text() for column in range(4)]

    def sources(self) -> list:
        return parameters.xray_sources(self.panel.parameters)

    def add(self, name: str = "AP") -> None:
        self.ui.xraySelector.setCurrentNode(scenes.add_xray(name))
        self.ui.addXrayButton.click()

    def test_a_volume_is_added_typed_and_removed(self) -> None:
        self.assertFalse(self.ui.addXrayButton.enabled)
        self.add()
        self.assertEqual(self.line(0)[3], "not ready")
        self.assertIn("source", self.ui.xrayState.text)
        type_into(self.ui.xrayDistance, "1000")
        self.assertEqual(self.line(0)[:2], ["AP", "entered"])
        self.assertIn("ready", self.line(0)[3])
        self.assertEqual(self.sources()[0].fields, {"source_to_detector_mm": 1000.0})
        self.assertEqual(self.ui.xraySpacingRows.placeholderText, "2")
        self.ui.removeXrayButton.click()
        self.assertEqual(self.ui.xraysTable.rowCount, 0)
        self.assertFalse(self.ui.xrayDetails.enabled)

    def test_every_field_is_stored_and_cleared(self) -> None:
        self.add()
        ui = self.ui
        for name, text in (
            ("xrayName", "frontal"),
            ("xrayDistance", "1020,5"),
            ("xrayIsocenterDistance", "700"),
            ("xraySpacingRows", "0.4"),
            ("xrayPointColumn", "20"),
            ("xrayPrimary", "-30"),
            ("xraySecondary", "10"),
        ):
            type_into(getattr(ui, name), text)
        ui.xrayPosition.currentIndex = ui.xrayPosition.findText("HFP")
        ui.xrayMirrored.currentIndex = 2
        ui.xrayDistortion.currentIndex = 1
        self.assertEqual(
            dict(self.sources()[0].fields),
            {
                "name": "frontal",
                "source_to_detector_mm": 1020.5,
                "source_to_isocenter_mm": 700.0,
                "pixel_spacing_mm": [0.4, 0.4],
                "principal_point_px": [20.0, 19.5],
                "primary_angle_deg": -30.0,
                "secondary_angle_deg": 10.0,
                "patient_position": "HFP",
                "mirrored": False,
                "distortion_corrected": True,
            },
        )
        self.assertIn("initial", self.line(0)[2])
        ui.xrayCamera.currentIndex = 2
        self.assertIn("searched", self.line(0)[2])
        ui.clearGeometryButton.click()
        self.assertEqual(dict(self.sources()[0].fields), {"name": "frontal"})
        self.assertEqual(ui.xrayPrimary.text, "")

    def test_a_text_that_is_no_number_is_said_and_not_stored(self) -> None:
        self.add()
        type_into(self.ui.xrayDistance, "1 m")
        self.assertIn("'1 m' is not a number", self.ui.xrayState.text)
        self.assertEqual(dict(self.sources()[0].fields), {})
        type_into(self.ui.xrayDistance, "-5")
        self.assertEqual(self.line(0)[3], "not ready")
        self.assertIn("Source to detector [mm]", self.ui.xrayState.text)
        self.assertNotIn("_mm", self.ui.xrayState.text)

    def test_files_and_their_state(self) -> None:
        self.panel.xrays.add_files([str(self.folder / "nowhere.dcm")])
        self.assertEqual(self.line(0)[3], "not ready")
        self.panel.xrays.add_files([])
        self.assertEqual(self.ui.xraysTable.rowCount, 1)

    def test_a_frame_of_a_sequence(self) -> None:
        sequence = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLSequenceNode", "run")
        for number in range(3):
            image = scenes.add_xray(f"frame {number}")
            sequence.SetDataNodeAtValue(image, str(number))
            slicer.mrmlScene.RemoveNode(image)
        self.ui.xraySelector.setCurrentNode(sequence)
        self.ui.addXrayButton.click()
        self.assertEqual(self.line(0)[0], "run [0]")
        self.assertTrue(self.ui.xrayFrame.enabled)
        self.ui.xrayFrame.value = 3
        self.assertEqual(self.sources()[0].frame, 2)
        self.ui.xrayFrame.value = 9
        self.assertEqual(self.line(0)[3], "not ready")

    def test_geometry_from_a_study_file(self) -> None:
        self.add("AP")
        self.add("lateral")
        _intrinsics, extrinsic = scenes.camera_matrix()
        entries = [
            {"image": "other.nrrd", "source_to_detector_mm": 900},
            {
                "image": "AP.dcm",
                "source_to_detector_mm": 1100,
                "extrinsic": extrinsic.tolist(),
                "camera": "known",
            },
        ]
        path = self.folder / "STUDY.json"
        path.write_text(json.dumps({"xrays": entries}))
        self.ui.xraysTable.selectRow(0)
        self.panel.xrays.read_geometry(str(path))
        self.assertEqual(self.line(0)[1:3], ["known, from a file", "known exactly"])
        self.assertEqual(self.ui.xrayCamera.currentIndex, 1)
        path.write_text("nothing")
        self.panel.xrays.read_geometry(str(path))
        self.assertIn("cannot be read as JSON", self.ui.xrayState.text)
        path.write_text("{}")
        self.panel.xrays.read_geometry(str(path))
        self.assertIn("does not describe", self.ui.xrayState.text)

    def test_a_deleted_image_leaves_the_table(self) -> None:
        self.add()
        slicer.mrmlScene.RemoveNode(self.sources()[0].image)
        self.assertEqual(self.ui.xraysTable.rowCount, 0)

    def test_a_deleted_camera_is_not_replaced_by_another_transform(self) -> None:
        self.add()
        others = [scenes.add_transform(np.eye(4), name) for name in ("first", "second", "third")]
        choose_node(self.ui.xrayTransform, others[1])
        self.assertIs(self.sources()[0].camera_transform, others[1])
        slicer.mrmlScene.RemoveNode(others[1])
        self.wait(lambda: self.ui.xrayTransform.currentNode() is None, 5)
        self.assertIsNone(self.sources()[0].camera_transform)

    def test_a_camera_transform_is_chosen(self) -> None:
        self.add()
        type_into(self.ui.xrayDistance, "1000")
        camera = scenes.add_transform(scenes.rotation((1, 0, 0), 90), "camera")
        choose_node(self.ui.xrayTransform, camera)
        self.assertIs(self.sources()[0].camera_transform, camera)
        self.assertEqual(self.line(0)[1:3], ["transform", "initial"])

    def test_an_edit_leaves_the_digits_of_other_fields(self) -> None:
        self.fill()
        self.ui.xraysTable.selectRow(0)
        sources = self.sources()
        exact = {
            **sources[0].fields,
            "source_to_detector_mm": 1020.1234567,
            "pixel_spacing_mm": [0.30000001, 0.3],
        }
        parameters.store_xray_sources(
            self.panel.parameters, [replace(sources[0], fields=exact), *sources[1:]]
        )
        type_into(self.ui.xrayName, "another")
        for field in ("source_to_detector_mm", "pixel_spacing_mm"):
            self.assertEqual(self.sources()[0].fields[field], exact[field])
        self.assertIn("extrinsic", self.sources()[0].fields)

    def test_typed_angles_take_the_place_of_a_given_camera(self) -> None:
        self.fill()
        self.ui.xraysTable.selectRow(0)
        type_into(self.ui.xrayPrimary, "20")
        source = self.sources()[0]
        self.assertNotIn("extrinsic", source.fields)
        self.assertEqual(source.fields["primary_angle_deg"], 20)
        self.assertEqual(self.line(0)[1], "entered")
        self.assertIn("LAO 20", self.ui.xrayState.text)


class FormTest(PanelCase):
    def test_every_control_explains_itself_and_is_used(self) -> None:
        module = REPOSITORY / "PolyPose"
        code = "".join(path.read_text(encoding="utf-8") for path in (module / "PolyPoseSlicer").rglob("*.py"))
        root = ElementTree.parse(module / "Resources" / "UI" / "PolyPose.ui").getroot()
        seen = 0
        for widget in root.iter("widget"):
            given = {each.get("name") for each in widget.findall("property")}
            if widget.get("class") in _CONTROLS:
                seen += 1
                name = widget.get("name")
                self.assertTrue("toolTip" in given or name == "registerButton", f"{name} has no tool tip")
                self.assertTrue("SlicerParameterName" in given or name in code, f"nothing uses {name}")
        self.assertGreater(seen, 50)

    @unittest.skipIf(INSIDE_SLICER, "dialogs cannot be answered for the user there")
    def test_dialogs_hand_on_what_was_chosen(self) -> None:
        self.fill()
        missing = str(self.folder / "missing.dcm")
        answers = {
            "getOpenFileNames": [missing],
            "getOpenFileName": missing,
            "getExistingDirectory": str(self.folder / "missing"),
            "getSaveFileName": str(self.folder / "missing" / "file"),
        }
        for name, answer in answers.items():
            patch = mock.patch.object(qt.QFileDialog, name, staticmethod(lambda *_, answer=answer: answer))
            patch.start()
            self.addCleanup(patch.stop)
        self.ui.addFilesButton.click()
        self.assertEqual(self.ui.xraysTable.rowCount, 3)
        self.ui.geometryFileButton.click()
        self.assertIn("cannot be read as JSON", self.ui.xrayState.text)
        self.ui.loadResultButton.click()
        self.assertIn("no such folder", self.ui.reviewState.text)
        for ask in (self.panel.saving._ask_report, self.panel.review.motions._ask_file):
            ask()
            self.assertIn("cannot be written", self.ui.reviewState.text)


class FieldWordsTest(SlicerTestCase):
    def test_fields_have_the_names_of_the_form(self) -> None:
        form = (REPOSITORY / "PolyPose" / "Resources" / "UI" / "PolyPose.ui").read_text()
        for field, label in field_labels().items():
            if field not in ("extrinsic", "isocenter_mm"):  # these are not in the form
                self.assertIn(f"<string>{label}", form)

    def test_what_is_chosen_instead_is_in_the_form(self) -> None:
        form = (REPOSITORY / "PolyPose" / "Resources" / "UI" / "PolyPose.ui").read_text()
        for choice in choices().values():
            field, value = re.findall('"([^"]+)"', choice)
            self.assertIn(f"<string>{field}:", form)
            self.assertIn(f"<string>{value}</string>", form)

    def test_origins_and_complaints_name_no_field(self) -> None:
        for sentence, words in (
            ("source_to_detector_mm 1020 from DICOM (1)", "Source to detector: 1020 mm, from DICOM (1)"),
            ("principal_point_px 1.50, 2.00: the centre", "Principal point: 1.50, 2.00 px, the centre"),
            ("extrinsic from the table", "Camera pose from the table"),
            ('give an "extrinsic".', 'give a "Camera pose".'),
            ("pixel_spacing_mm is [0, 1]; give two.", '"Pixel spacing [mm]" is [0, 1]; give two.'),
            ("Remove the extrinsic calibration.", "Remove the extrinsic calibration."),
            ('not so, add "mirrored": false.', 'not so, set "Image seen from" to "the source".'),
            ('add "distortion_corrected": true.', 'set "Distortion" to "corrected".'),
        ):
            self.assertEqual(in_words(sentence), words)


if __name__ == "__main__":
    unittest.main()
