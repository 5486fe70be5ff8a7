"""The form's sections are steps: one is open, done ones are marked, and the foot is always in sight."""

from __future__ import annotations

import unittest
from typing import Any

import scenes
import slicer
from panel_case import PanelCase, emit
from PolyPoseSlicer.panel.steps import SECTIONS
from PolyPoseSlicer.study import parameters
from PolyPoseSlicer.study.xray_source import XraySource

# isort: split
import qt

WIDEST = 450
"""Pixels that the panel may take of a screen."""

LOWEST = 25
"""Lines of text that the application leaves to a form on a screen of 1280 x 800 with the Data Probe open."""


class StepsTest(PanelCase):
    def open_sections(self) -> list[str]:
        return [name for name in SECTIONS if not getattr(self.ui, name).collapsed]

    def marked(self) -> list[str]:
        return [name for name in SECTIONS if getattr(self.ui, name).text.startswith("\u2713")]

    def test_one_section_is_open_at_a_time(self) -> None:
        self.assertEqual(self.open_sections(), ["inputsSection"])
        for name in (*SECTIONS, "xraysSection"):
            getattr(self.ui, name).collapsed = False
            self.assertEqual(self.open_sections(), [name])
        self.ui.xraysSection.collapsed = True
        self.assertEqual(self.open_sections(), [])

    def test_steps_are_marked_and_the_next_one_opens(self) -> None:
        ct = scenes.add_ct()
        self.ui.ctSelector.setCurrentNode(ct)
        self.ui.segmentationSelector.setCurrentNode(scenes.add_segmentation(ct))
        self.assertEqual((self.open_sections(), self.marked()), (["inputsSection"], []))
        self.ui.proposeButton.click()
        self.assertEqual((self.open_sections(), self.marked()), (["xraysSection"], ["inputsSection"]))
        image = scenes.add_xray()
        parameters.store_xray_sources(self.panel.parameters, [XraySource(image)])
        self.assertEqual((self.open_sections(), self.marked()), (["xraysSection"], ["inputsSection"]))
        fields = {"source_to_detector_mm": 1000.0, "extrinsic": scenes.camera_matrix()[1].tolist()}
        parameters.store_xray_sources(self.panel.parameters, [XraySource(image, fields=fields)])
        self.assertEqual(self.open_sections(), ["registerSection"])
        self.assertEqual(self.marked(), ["inputsSection", "xraysSection", "cameraSection"])
        self.panel.review.load_result(str(scenes.save_result(self.folder / "given")))
        self.assertIn("reviewSection", self.marked())
        self.ui.ctSelector.setCurrentNode(None)
        self.assertNotIn("inputsSection", self.marked())

    def test_a_step_that_is_visited_again_stays_open(self) -> None:
        self.fill()
        self.ui.inputsSection.collapsed = False
        self.ui.segmentFilter.text = "femur"
        self.panel.parameters.anchor = "femur"
        self.ui.structuresTable.item(0, 1).setText("hip")
        self.assertEqual(self.open_sections(), ["inputsSection"])

    def test_the_foot_says_what_is_missing_and_then_that_all_is_ready(self) -> None:
        self.assertIn("Choose the CT", self.ui.stageLabel.text)
        self.assertFalse(self.ui.registerButton.enabled)
        self.fill()
        self.assertEqual(self.ui.stageLabel.text, "Ready: 2 structures, 2 X-rays.")
        self.assertTrue(self.ui.registerButton.enabled)
        parameters.store_xray_sources(self.panel.parameters, [XraySource(self.xrays[0])])
        self.assertIn("'AP' is not ready", self.ui.stageLabel.text)
        self.assertFalse(self.ui.registerButton.enabled)
        self.assertFalse(self.ui.xrayDetails.collapsed)

    def test_the_panel_is_narrow_and_its_foot_is_in_sight_on_a_small_screen(self) -> None:
        self.fill()
        self.panel.review.load_result(str(scenes.save_result(self.folder / "given")))
        form = self.ui.stepsArea.parentWidget()
        # As the application shows it: a scroll area asks for the height that lines broken to its width would like.
        area = qt.QScrollArea()
        area.setWidgetResizable(True)
        area.setWidget(form)
        self.lowest = LOWEST * form.fontMetrics().height()
        area.resize(WIDEST, self.lowest)
        area.show()
        try:
            self.check_sections(form, area)
        finally:
            self.host.layout.addWidget(area.takeWidget())

    def check_sections(self, form: Any, area: Any) -> None:
        for name in SECTIONS:
            getattr(self.ui, name).collapsed = False
            self.ui.xrayDetails.collapsed = False
            emit(self.ui.stepsArea.verticalScrollBar().valueChanged, 0)
            slicer.app.processEvents()
            needed = self.ui.stepsArea.minimumWidth
            self.assertGreaterEqual(needed, self.ui.steps.minimumSizeHint.width(), name)
            self.assertLessEqual(form.minimumSizeHint.width(), WIDEST, name)
            self.assertLessEqual(form.minimumSizeHint.height(), self.lowest, name)
            button = self.ui.registerButton
            bottom = button.mapTo(area.viewport(), button.rect.bottomRight())
            self.assertTrue(area.viewport().rect.contains(bottom), name)


if __name__ == "__main__":
    unittest.main()
