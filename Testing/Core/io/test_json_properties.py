"""What is written is read back the same; whatever else stands in a field ends in a value or in one sentence."""

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from json_values import VALUES, assert_one_sentence, changed
from result_case import make_result
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.found_camera import FoundCamera, camera_report, cameras_in_report
from PolyPoseLib.data.progress import Progress
from PolyPoseLib.errors import InputError
from PolyPoseLib.io import study_schema
from PolyPoseLib.io.json_records import (
    Record,
    array,
    boolean,
    json_text,
    list_of,
    number_in,
    numbers,
    object_of,
    one_of,
    parse_json,
    parse_object,
    plain,
    real_or_nan,
    whole_number,
)
from PolyPoseLib.io.results import load_result, result_fields

RIGID = [[1, 0, 0, 0], [0, 0, -1, 5], [0, 1, 0, 800], [0, 0, 0, 1]]
STUDY = {
    "version": 1, "ct": "ct.nii.gz", "segmentation": "labels.nii.gz", "label_table": "totalsegmentator_v2",
    "structures": {"pelvis": [25, "hip_left"], "femur_left": [75]}, "anchor": "pelvis", "ct_series": 3,
    "xrays": [
        {"image": "ap.dcm", "name": "AP", "camera": "known", "extrinsic": RIGID, "mask": "mask.png", "frame": 2},
        {"image": "side.nii.gz", "source_to_detector_mm": 1020, "pixel_spacing_mm": [0.4, 0.4],
         "principal_point_px": [511.5, 511.5], "intensity": "line_integral", "mirrored": True,
         "landmarks": [{"point": [1, 2, 3], "pixel": [4, 5]}], "standard_view": "AP"},
    ],
    "options": {"preset": "fast", "seed": 3, "rotation_reach_mm": 20.0, "composed": True}, "comment": ["free"],
}  # fmt: skip
FINITE = st.floats(-1e6, 1e6)
WORDS = st.text(max_size=20)


@st.composite
def found_cameras(draw: st.DrawFn) -> FoundCamera:
    """Any pose within a kilometre."""
    extrinsic = np.eye(4)
    extrinsic[:3, :3] = Rotation.random(random_state=draw(st.integers(0, 2**32 - 1))).as_matrix()
    extrinsic[:3, 3] = draw(st.tuples(FINITE, FINITE, FINITE))
    return FoundCamera(
        extrinsic,
        sure=draw(st.booleans()),
        within=draw(st.tuples(FINITE, FINITE)),
        how=draw(WORDS),
        warnings=tuple(draw(st.lists(WORDS, max_size=3))),
        similarity=draw(st.none() | st.floats(-1, 1)),
        runner_up=draw(st.none() | st.floats(-1, 1)),
        mirrored=draw(st.booleans()),
        taken=draw(st.booleans()),
    )


STEPS = st.builds(
    Progress,
    stage=WORDS,
    iteration=st.integers(0, 10**6),
    of=st.integers(0, 10**6),
    similarity=st.none() | st.floats(-1, 1).map(lambda value: round(value, 6)),
    seconds=st.floats(0, 1e6).map(lambda value: round(value, 3)),
    preview=st.none() | WORDS,
)


@given(VALUES)
def test_json_comes_back_as_it_was_written(value):
    assert parse_json(json_text(value), "x") == value


@given(st.lists(st.floats(), max_size=6))
def test_arrays_are_written_as_lists_with_null_where_they_are_not_finite(values):
    written = plain({"values": np.array(values), "first": np.float64(values[0]) if values else None})
    assert written["values"] == [value if math.isfinite(value) else None for value in values]
    read = Record(parse_object(json_text(written), "x")).required("values", array(-1, finite=False))
    np.testing.assert_array_equal(read, [value if math.isfinite(value) else math.nan for value in values])


@given(
    VALUES,
    st.sampled_from(
        [
            boolean,
            real_or_nan,
            number_in((0, 10), "mm"),
            whole_number(0),
            one_of(("known", "initial")),
            numbers(2, "[column, row]"),
            array(2, 2),
            list_of(boolean),
            object_of(whole_number(1)),
        ]
    ),
)
def test_parsers_give_a_value_of_their_kind_or_one_sentence_that_says_where(value, parser):
    try:
        read = parser(value, '"cameras"[0]."field"')
    except InputError as error:
        assert_one_sentence(error)
        assert str(error).startswith('"cameras"[0]."field') and "; give " in str(error)
    else:
        assert isinstance(read, bool | int | float | str | tuple | list | dict | np.ndarray)


@given(STEPS)
def test_progress_comes_back_from_its_line(step):
    line = step.to_json()
    assert "\n" not in line and Progress.from_json(line) == step
    assert 0 <= step.fraction <= 1


@given(
    st.one_of(
        VALUES.map(json.dumps),
        changed(json.loads(Progress("a", 1, 2, 0.5, 3.0, "p").to_json())).map(json.dumps),
        st.text(),
    )
)
def test_any_other_line_is_no_progress_or_some(line):
    try:
        step = Progress.from_json(line)
    except InputError as error:
        assert_one_sentence(error)
    else:
        assert Progress.from_json(step.to_json()).stage == step.stage


@given(found_cameras(), st.integers(0, 5))
def test_a_found_camera_comes_back_from_scenes_and_reports(found, number):
    assert FoundCamera.from_dict(json.loads(json.dumps(found.to_dict()))) == found
    report = parse_object(json_text(camera_report(["AP"] * 6, {number: found})), "report.json")
    assert cameras_in_report(report) == {number: found}


@given(st.data())
def test_a_damaged_found_camera_is_a_camera_or_refused(data):
    found = FoundCamera(np.eye(4), True, (2.0, 10.0), "searched", ("careful",), 0.8, 0.3)
    report = data.draw(changed(camera_report(["AP"], {0: found})))
    try:
        read = cameras_in_report(report)
    except InputError as error:
        assert_one_sentence(error)
    else:
        assert all(np.isfinite(each.extrinsic).all() for each in read.values())


@given(changed(STUDY))
def test_a_changed_study_is_right_or_refused_in_one_sentence(fields):
    study_schema.check(STUDY, "study.json")
    try:
        study_schema.check(parse_object(json_text(fields), "study.json"), "study.json")
    except InputError as error:
        assert_one_sentence(error)
        assert str(error).startswith("study.json: ")


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """A result's folder."""
    return make_result().save(tmp_path_factory.mktemp("saved") / "out")


def test_a_result_comes_back_from_its_folder(saved):
    assert plain(result_fields(load_result(saved))) == json.loads((saved / "result.json").read_text())


@given(st.data())
def test_a_changed_result_is_read_or_refused_in_one_sentence(saved, data):
    path = saved / "result.json"
    text = path.read_text()
    try:
        path.write_text(json_text(data.draw(changed(json.loads(text)))))
        load_result(saved)
    except InputError as error:
        assert_one_sentence(error)
        assert str(error).startswith(str(saved))
    finally:
        path.write_text(text)
