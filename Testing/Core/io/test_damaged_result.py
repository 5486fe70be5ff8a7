"""A result.json that was changed by hand or by accident is refused in one sentence that names it."""

import json

import pytest
from result_case import make_result

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.results import load_result

REFLECTION = [[-1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
FEMUR = ("structures", "femur")
CHANGES = [
    ((*FEMUR, "fixed_to_moving"), [[0] * 4] * 4, '"femur"."fixed_to_moving" has the last row'),
    ((*FEMUR, "fixed_to_moving"), REFLECTION, "reflection"),
    ((*FEMUR, "fixed_to_moving"), [[2, 0, 0, 0], *REFLECTION[1:]], "not rigid"),
    ((*FEMUR, "fixed_to_moving"), [[10**400, 0, 0, 0], *REFLECTION[1:]], "401 digits"),
    ((*FEMUR, "fixed_to_moving"), [[1, 2]], "shape"),
    ((*FEMUR, "uncertainty"), "x", '"femur"."uncertainty" is "x"; give an object'),
    ((*FEMUR, "uncertainty"), [1, 2], r'"femur"."uncertainty" is \[1, 2\]; give an object'),
    ((*FEMUR, "uncertainty", "along_mm"), "x", '"along_mm" is "x"; give one number'),
    ((*FEMUR, "uncertainty", "across_mm"), 1, '"across_mm" is 1; give 2 numbers'),
    (("structures",), [], '"structures" is'),
    (("cameras",), {}, '"cameras" is'),
    (("cameras", 0, "K"), [[0] * 3] * 3, r'"cameras"\[0\]."K"'),
    (("cameras", 0, "extrinsic"), [[0] * 4] * 4, r'"cameras"\[0\]."extrinsic"'),
    (("cameras", 0, "height"), -5, "height"),
    (("cameras", 0, "height"), "12", "height"),
    (("seconds",), None, '"seconds" is null'),
    (("seconds",), {"bones": "b"}, '"seconds"."bones" is "b"; give a finite number'),
    (("seconds",), {"bones": None}, '"seconds"."bones" is null; give a finite number'),
    (("versions",), 5, '"versions" is 5'),
    (("device",), [], '"device" is'),
    (("warnings",), 5, '"warnings" is 5'),
    (("warnings",), [5], r'"warnings"\[0\] is 5; give a text'),
    (("distrust",), None, '"distrust" is null'),
    (("similarity",), 5, '"similarity" is 5'),
    (("similarity",), [5], r'"similarity"\[0\] is 5; give an object'),
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A result, and the fields of its result.json."""
    folder = make_result().save(tmp_path_factory.mktemp("saved") / "out")
    return folder, (folder / "result.json").read_text()


@pytest.mark.parametrize(("place", "value", "words"), CHANGES)
def test_a_changed_field_is_refused(folder, place, value, words):
    folder, text = folder
    fields = inner = json.loads(text)
    for name in place[:-1]:
        inner = inner[name]
    inner[place[-1]] = value
    (folder / "result.json").write_text(json.dumps(fields))
    with pytest.raises(InputError, match=words) as caught:
        load_result(folder)
    assert "result.json: " in str(caught.value) and "\n" not in str(caught.value)


def test_numbers_too_large_for_a_float_are_refused(folder):
    folder, text = folder
    (folder / "result.json").write_text(text.replace("1.0", "1e999", 1))
    with pytest.raises(InputError, match="1e999"):
        load_result(folder)


def test_intervals_that_are_not_finite_and_absent_distrust_are_read(folder):
    folder, text = folder
    fields = json.loads(text)
    fields["structures"]["femur"]["uncertainty"] |= {"along_mm": None, "across_mm": [None, 1.0]}
    del fields["distrust"]
    (folder / "result.json").write_text(json.dumps(fields))
    result = load_result(folder)
    assert result.structures["femur"].uncertainty["across_mm"] == [None, 1.0] and result.trusted
