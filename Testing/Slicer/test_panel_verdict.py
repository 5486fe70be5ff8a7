"""The verdict on a result is one banner that nobody can miss or mistake, and keys swap what is compared."""

from __future__ import annotations

import itertools
import unittest

import numpy as np
import scenes
import slicer
from panel_case import PanelCase, emit
from PolyPoseSlicer.panel.verdict import verdict_of
from PolyPoseSlicer.scene.compare import Mode
from PolyPoseSlicer.study.results import OutputNodes
from slicer_case import SlicerTestCase

# isort: split
import qt


def luminance(color: str) -> float:
    """Relative luminance of #rrggbb (WCAG 2)."""
    channels = np.array([int(color[n : n + 2], 16) for n in (1, 3, 5)]) / 255
    linear = np.where(channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


def contrast(first: str, second: str) -> float:
    """Contrast of two colours, 1 to 21 (WCAG 2)."""
    dark, light = sorted((luminance(first), luminance(second)))
    return (light + 0.05) / (dark + 0.05)


class VerdictTest(SlicerTestCase):
    def setUp(self) -> None:
        super().setUp()
        self.good = verdict_of(OutputNodes())
        self.odd = verdict_of(OutputNodes(warnings=("the knee is faint", "X-ray 2 is dark")))
        self.bad = verdict_of(
            OutputNodes(warnings=("the knee is faint",), distrust=("no overlap", "it left"))
        )

    def test_every_reason_and_warning_is_told(self) -> None:
        for verdict, texts in (
            (self.odd, ("the knee is faint", "X-ray 2 is dark")),
            (self.bad, ("no overlap", "it left", "the knee is faint", "register again")),
        ):
            for text in texts:
                self.assertEqual(sum(text in line for line in verdict.lines), 1, text)

    def test_the_three_are_told_apart_without_colours_and_by_the_colour_blind(self) -> None:
        verdicts = (self.good, self.odd, self.bad)
        self.assertEqual(len({each.headline[0] for each in verdicts}), 3)
        self.assertIn("DO NOT TRUST", self.bad.headline)
        for verdict in verdicts:
            self.assertGreater(contrast(verdict.background, verdict.foreground), 4.5, verdict.headline)
        for first, second in itertools.combinations(verdicts, 2):
            differ = abs(luminance(first.background) - luminance(second.background))
            blue = [int(each.background[5:], 16) for each in (first, second)]
            self.assertTrue(differ > 0.1 or abs(blue[0] - blue[1]) > 100)


class BannerTest(PanelCase):
    def load(self, **changes) -> None:
        folder = scenes.save_result(self.folder / f"given{len(list(self.folder.iterdir()))}", **changes)
        self.panel.review.load_result(str(folder))

    def setUp(self) -> None:
        super().setUp()
        self.fill()

    def test_the_banner_follows_the_result(self) -> None:
        self.panel.steps.open("reviewSection")  # a closed section hides what is in it
        banner = self.ui.verdictLabel
        self.assertTrue(banner.isHidden())
        self.assertIn("No result yet", self.ui.reviewState.text)
        self.load()
        self.assertFalse(banner.isHidden())
        self.assertIn("Check what is named", banner.text)
        self.assertIn("something was odd", self.ui.reviewState.text)
        self.load(distrust=["the X-rays do not overlap"])
        self.assertIn("DO NOT TRUST", banner.text)
        self.assertIn("the X-rays do not overlap", self.ui.reviewState.text)
        slicer.mrmlScene.Clear()
        self.assertTrue(banner.isHidden())

    def test_the_banner_is_no_good_one_where_a_bone_is_doubtful(self) -> None:
        self.load(warnings=(), doubts=("no X-ray shows it clearly",))
        self.assertIn("Check what is named", self.ui.verdictLabel.text)
        self.assertIn("femur: no X-ray shows it clearly", self.ui.reviewState.text)

    def keys(self) -> dict[str, qt.QShortcut]:
        window = slicer.util.mainWindow() or self.panel._shortcuts._form
        return {each.key.toString(): each for each in window.findChildren(qt.QShortcut)}

    def test_keys_swap_posture_and_flicker_while_the_module_is_open(self) -> None:
        posture, flicker = (self.keys()[key] for key in ("Ctrl+Shift+B", "Ctrl+Shift+F"))
        emit(posture.activated)
        self.assertFalse(self.ui.showAfter.checked)  # there is no result
        self.load()
        for after in (False, True, False):
            emit(posture.activated)
            self.assertEqual((self.ui.showAfter.checked, self.ui.showBefore.checked), (after, not after))
        for mode in (Mode.FLICKER, Mode.BLEND):
            emit(flicker.activated)
            self.assertEqual(self.panel.review.pictures.mode, [mode] * 2)
        slicer.mrmlScene.Clear()
        self.assertIn("Ctrl+Shift+B", self.keys())
        self.panel.exit()
        slicer.app.processEvents()
        self.assertNotIn("Ctrl+Shift+B", self.keys())
        self.panel.enter()
        self.panel.enter()
        self.assertEqual(len([key for key in self.keys() if key == "Ctrl+Shift+B"]), 1)


if __name__ == "__main__":
    unittest.main()
