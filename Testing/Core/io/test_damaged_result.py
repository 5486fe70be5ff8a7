"""A result.json that was changed by hand or by accident is refused in one sentence that names it."""

import json

import pytest
from result_case import make_result

from PolyPoseLib.errors import InputError
from PolyPoseLib.io import results
from PolyPoseLib.io.json_records import json_text
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
    ((*FEMUR, "uncertainty", "covariance"), [[1, 2]] * 6, '"covariance" is .*; give 6 x 6 numbers'),
    ((*FEMUR, "uncertainty", "covariance", 0, 1), ["1", "2", "3"], '"covariance" is'),
    (
        (*FEMUR, "uncertainty", "directions"),
        {"along": [1, 2, 3]},
        '"directions"."across"|"across" is missing',
    ),
    ((*FEMUR, "centroid"), [1, 2], '"femur"."centroid" is'),
    ((*FEMUR, "motion", "centroid_mm"), "x", '"centroid_mm" is "x"; give 3 finite numbers'),
    ((*FEMUR, "motion", "axis"), [1, "2", 3], '"motion"."axis" is'),
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
    (("similarity", 0, "iteration"), -1, r'"similarity"\[0\]."iteration" is -1; give a whole number'),
    (("similarity", 0, "similarity"), "x", r'"similarity"\[0\]."similarity" is "x"; give a finite number'),
    (("similarity", 0, "stage"), 5, r'"similarity"\[0\]."stage" is 5; give a text'),
    (("trusted",), "yes", '"trusted" is "yes"; give true or false'),
    (("trusted",), False, '"trusted" and "distrust" contradict'),
    (("anchor",), "skull", '"anchor": The structure "skull" is not known'),
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


def places(value, place=()):
    """Every place in a JSON value, from the outside in."""
    yield place
    inner = (
        value.items() if isinstance(value, dict) else enumerate(value[:2]) if isinstance(value, list) else ()
    )
    for name, each in inner:
        yield from places(each, (*place, name))


def replaced(value, place, new):
    """A JSON value with another one at a place."""
    if not place:
        return new
    value = dict(value) if isinstance(value, dict) else list(value)
    value[place[0]] = replaced(value[place[0]], place[1:], new)
    return value


def test_whatever_stands_anywhere_is_refused_in_a_sentence_or_can_be_used(folder, monkeypatch):
    folder, text = folder
    (folder / "result.json").write_text(text)
    whole = load_result(folder)
    labels = whole.structure_labels
    monkeypatch.setattr(
        results, "read_volume", lambda path: labels if path.name == results.STRUCTURES else whole.warped_ct
    )
    monkeypatch.setattr(results, "read_transform", lambda path: whole.transform)
    fields, refused = json.loads(text), 0
    for place in list(places(fields)):
        for new in ("x", "", [], {}, None, True, -1, 1e308, [[1.0]], {"a": [None]}):
            changed = replaced(fields, place, new)
            (folder / "result.json").write_text(json.dumps(changed))
            try:
                result = load_result(folder)
            except InputError as error:
                assert "\n" not in str(error) and len(str(error)) < 500
                refused += 1
            else:
                again = results.result_fields(result)
                assert json.loads(json_text(again))["structures"].keys() == changed["structures"].keys()
    assert refused > 500
    (folder / "result.json").write_text(text)


def test_a_centroid_in_the_place_of_earlier_files_is_read(folder):
    folder, text = folder
    fields = json.loads(text)
    femur = fields["structures"]["femur"]
    femur["motion"]["centroid_mm"] = femur.pop("centroid")
    (folder / "result.json").write_text(json.dumps(fields))
    assert load_result(folder).structures["femur"].centroid.tolist() == femur["motion"]["centroid_mm"]


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
