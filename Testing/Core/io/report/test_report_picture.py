import dataclasses
import re

import numpy as np
import pytest
import SimpleITK as sitk
from report_case import seen_result
from result_case import make_result

from PolyPoseLib.io.report import draw_figure, overlay, summary_of, write_picture
from PolyPoseLib.io.report.figure import drawn_texts
from PolyPoseLib.io.report.figure_parts import AFTER_COLOUR, BEFORE_COLOUR


def words(result):
    return [text.get_text() for text in drawn_texts(draw_figure(summary_of(result)))]


@pytest.mark.parametrize("parts", ["all", "loaded", "none"])
def test_the_report_is_drawn_from_whatever_is_there(tmp_path, parts):
    result = make_result(views=3)
    result.cameras = [dataclasses.replace(camera, name="a" * 80) for camera in result.cameras]
    result.distrust = ("the similarity did not rise",) if parts == "all" else ()
    if parts != "all":
        result.renderings_before, result.xray_images = [], []
    if parts == "none":
        result.history, result.structures, result.warnings = [], {}, []
        result.renderings_after = [np.zeros((40, 60), np.float32)] * 3
    write_picture(summary_of(result), tmp_path / "report.png")
    image = sitk.ReadImage(str(tmp_path / "report.png"))
    assert image.GetSize()[0] > 1000
    assert np.ptp(sitk.GetArrayFromImage(image)) > 100


def test_outlines_before_and_after_and_a_close_up_of_every_bone_are_drawn():
    figure = draw_figure(summary_of(seen_result(views=2)))
    from matplotlib.collections import LineCollection
    from matplotlib.colors import to_hex

    colours = [[to_hex(each.get_color()[0]) for each in axes.findobj(LineCollection)] for axes in figure.axes]
    with_before = [n for n, found in enumerate(colours) if BEFORE_COLOUR in found]
    with_after = [n for n, found in enumerate(colours) if AFTER_COLOUR in found]
    assert len(with_before) == len(with_after) == 4 and len(set(with_before) & set(with_after)) == 2
    texts = words(seen_result(views=2))
    assert sum("femur, view" in each for each in texts) == 2
    assert any("through the cameras that were found" in each for each in texts)


def test_texts_lie_inside_the_figure_and_no_number_is_minus_zero():
    result = seen_result(views=2)
    result.structures["femur"] = dataclasses.replace(
        result.structures["femur"], translation_mm=[-0.01, -0.02, 5]
    )
    result.warnings = ["long " * 80] * 20
    result.distrust = ("why not " * 40,)
    figure = draw_figure(summary_of(result))
    figure.canvas.draw()
    whole = figure.bbox
    for text in drawn_texts(figure):
        if text.get_text() and text.get_visible():
            box = text.get_window_extent()
            assert whole.x0 <= box.x0 and box.x1 <= whole.x1 and whole.y0 <= box.y0 and box.y1 <= whole.y1, (
                text
            )
    assert not any(re.search(r"-0\.0\b", text.get_text()) for text in drawn_texts(figure))


def test_hundreds_of_bones_are_cut_and_the_picture_says_so():
    result = seen_result(views=1)
    femur = result.structures["femur"]
    result.structures = {"pelvis": result.structures["pelvis"], **{f"rib {n}": femur for n in range(300)}}
    texts = words(result)
    assert any("others are in report.html" in each for each in texts) and not any(
        each == "rib 250" for each in texts
    )


def test_overlay_is_grey_where_both_agree_whatever_the_exposure():
    rng = np.random.default_rng(8)
    image = np.cumsum(rng.normal(size=(60, 70)), axis=0).astype(np.float32)
    colours = overlay(image, 3 * image + 7)
    assert np.abs(colours - colours.mean(axis=-1, keepdims=True)).max() < 1e-3
    shifted = overlay(image, np.roll(image, 6, axis=1))
    assert np.abs(shifted - shifted.mean(axis=-1, keepdims=True)).mean() > 0.02


def test_names_are_drawn_as_they_are_written():
    result = make_result()
    result.cameras[0] = dataclasses.replace(result.cameras[0], name="$x$ \ud800")
    result.structures["$y$"] = result.structures.pop("femur")
    figure = draw_figure(summary_of(result))
    texts = list(drawn_texts(figure))
    assert {"$y$"} < {text.get_text() for text in texts}
    assert any("$x$ ?\n" in text.get_text() for text in texts)
    assert not any(text.get_parse_math() for text in texts)
