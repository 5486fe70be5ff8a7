import dataclasses
import re

import numpy as np
import pytest
from report_case import seen_result

from PolyPoseLib.io.report.levels import level_curves
from PolyPoseLib.io.report.words import bone_lines, cautions, headline, notes, number


@pytest.mark.parametrize("value", [-0.0, 0.0, -0.04, 0.04, -1e-300, -0.0499999])
def test_numbers_that_round_to_zero_have_no_sign(value):
    assert number(value) == number(value, signed=True) == "0.0"


def test_other_numbers_have_their_decimals_and_their_sign_where_it_is_asked_for():
    assert [number(-0.06), number(2.25, 2), number(3, signed=True), number(-3, 0)] == [
        "-0.1",
        "2.25",
        "+3.0",
        "-3",
    ]
    assert number(float("nan")) == number(float("inf"), signed=True) == "-"


def doubtful(result):
    result.structures["femur"] = dataclasses.replace(result.structures["femur"], doubts=("metal hides it",))
    return result


def test_only_a_result_without_doubts_from_two_directions_has_a_green_headline():
    assert headline(seen_result()).tone == "good"
    assert "1 warning" in headline(seen_result()).text
    for caution, word in (
        (seen_result(views=1), "One X-ray"),
        (seen_result(views=2, degrees=5.0), "one direction"),
        (doubtful(seen_result()), "1 of 2 bones is uncertain"),
    ):
        assert headline(caution).tone == "caution" and word in headline(caution).text
    opposite = seen_result(views=2, degrees=180.0)  # depth is no better seen from the other side
    assert headline(opposite).tone == "caution"
    bad = seen_result(views=1)
    bad.distrust = ("the similarity did not rise",)
    assert headline(bad).tone == "bad" and "1 reason," in headline(bad).text


@pytest.mark.parametrize(("views", "degrees"), [(1, 0.0), (2, 5.0), (2, 90.0)])
@pytest.mark.parametrize("doubts", [True, False])
def test_cautions_are_all_that_keeps_the_headline_from_green(views, degrees, doubts):
    result = seen_result(views=views, degrees=degrees)
    result.warnings = []
    if doubts:
        doubtful(result)
    assert bool(cautions(result)) == (headline(result).tone != "good")
    assert any("femur: metal hides it." in text for text in cautions(result)) == doubts
    result.warnings = ['"femur" is off: metal hides it.', "the CT is old"]
    assert cautions(result)[-2:] == result.warnings
    assert sum("metal hides it" in text for text in cautions(result)) == 1


def test_bones_are_told_in_words_with_units_and_without_minus_zero():
    result = seen_result()
    shift = np.array([-0.01, -2.04, 0.0])
    stated = {
        "along_mm": 1.26,
        "across_mm": [0.2, 0.44],
        "rotation_about_view_deg": 0.9,
        "rotation_across_deg": [2, 3],
    }
    result.structures["femur"] = dataclasses.replace(
        result.structures["femur"],
        translation_mm=shift,
        rotation_deg=0.04,
        uncertainty=stated,
        doubts=("why",),
    )
    pelvis, femur = bone_lines(result)
    assert pelvis.still and set(pelvis.cells) == {"-"} and "anchor" in pelvis.motion
    assert femur.cells == ("0.0", "0.0", "-2.0", "0.0", "2.0") and femur.intervals == (
        "1.3",
        "0.4",
        "0.9",
        "3.0",
    )
    assert femur.motion == "Rotated by 0.0° and moved by 2.0 mm (2.0 mm to the front)."
    assert "± 1.3 mm along the viewing direction and ± 0.4 mm across it" in femur.interval
    assert "± 0.9° about that direction" in femur.interval
    assert not re.search(r"-0\.0\b", " ".join((*femur.cells, femur.motion, femur.interval)))
    result.structures["femur"] = dataclasses.replace(result.structures["femur"], uncertainty=None)
    assert bone_lines(result)[1].interval == "No interval was computed."


def test_a_reason_is_told_once():
    result = doubtful(seen_result())
    assert ("femur: metal hides it.", "caution") in notes(result)
    result.warnings = ['The X-rays contradict "femur" (metal hides it).']
    assert notes(result) == [(result.warnings[0], "caution")]


def test_the_history_falls_apart_into_its_levels():
    def steps(stage, numbers, level=None):
        fields = {} if level is None else {"level_mm": level}
        return [{"stage": stage, "iteration": n, "similarity": 0.9 + 0.001 * n, **fields} for n in numbers]

    history = [
        *steps("camera AP", range(1, 4), 4.0),
        *steps("camera AP", range(4, 7), 2.0),
        *steps("bones", range(1, 3), 4.0),
        {"stage": "bones", "iteration": 3, "similarity": float("nan"), "level_mm": 2.0},
        *steps("bones", [4], 1.25),
        *steps("done", [1]),
    ]
    curves = level_curves(history)
    assert [each.title for each in curves] == [
        "camera AP, 4 mm",
        "camera AP, 2 mm",
        "bones, 4 mm",
        "bones, 1.2 mm",
    ]
    assert [len(each.values) for each in curves] == [3, 3, 2, 1]
    assert (
        curves[0].summary == "0.9010 to 0.9030, 3 iterations" and curves[3].summary == "0.9040, 1 iteration"
    )
    for each in curves:
        low, high = each.limits
        assert low < each.values.min() <= each.values.max() < high
    earlier = level_curves(
        [*steps("bones", range(1, 5)), *steps("bones", range(21, 23)), *steps("camera", [1, 2])]
    )
    assert [len(each.values) for each in earlier] == [4, 2, 2]
