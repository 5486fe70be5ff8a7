"""TRACK.json: known fields alone, and one sentence for whatever else it holds."""

import dataclasses
import json

import pytest
from hypothesis import given
from json_values import VALUES, assert_one_sentence, changed

from PolyPoseLib.data.tracking.track_options import TrackOptions
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.tracking import schema

RIGID = [[1, 0, 0, 0], [0, 0, -1, 5], [0, 1, 0, 800], [0, 0, 0, 1]]
CAMERA = {
    "name": "left", "images": "cam1", "calibration": "cam1.txt", "first": 3, "intensity": "transmission",
    "unattenuated": 4000, "mirrored": False, "camera": "known", "mask": "mask.png", "comment": "x",
}  # fmt: skip
FIELDS = {
    "version": 1, "ct": "ct.nii.gz", "segmentation": "labels.nii.gz", "structures": {"tibia": [1], "talus": [2, "x"]},
    "reference": "tibia", "still": ["tibia"], "frames_per_second": 250.5,
    "cameras": [CAMERA, {"images": "cam2", "extrinsic": RIGID, "source_to_detector_mm": 1000, "pixel_spacing_mm": 0.4}],
    "cameras_from": "result", "initial_poses": {"talus": RIGID}, "landmarks": {"talus.origin": [1, 2.5, 3]},
    "joints": [{"name": "ankle", "proximal": "tibia", "distal": "talus", "convention": "generic", "side": "left"}],
    "options": {"start": "registration", "prediction": "previous", "first": 2, "last": 30, "backward": False,
                "smooth": True, "threads": 2, "kernel": "torch"},
    "ct_series": "1.2", "label_table": "totalsegmentator_v2", "comment": "free",
}  # fmt: skip


def test_every_field_is_known():
    schema.check(FIELDS, "TRACK.json")
    schema.check({name: FIELDS[name] for name in schema.REQUIRED}, "TRACK.json")


def test_every_option_of_the_program_is_an_option_of_the_file():
    options = schema.track_options(FIELDS["options"], '"options"')
    assert options == TrackOptions(**FIELDS["options"])
    assert set(FIELDS["options"]) == {field.name for field in dataclasses.fields(TrackOptions)}
    assert schema.track_options({}, '"options"') == TrackOptions()


@given(changed(FIELDS))
def test_any_other_value_ends_in_one_sentence(fields):
    try:
        schema.check(fields, "TRACK.json")
    except InputError as error:
        assert_one_sentence(error)
        assert str(error).startswith("TRACK.json: ")


@given(VALUES)
def test_any_options_end_in_options_or_one_sentence(value):
    try:
        assert isinstance(schema.track_options(value, '"options"'), TrackOptions)
    except InputError as error:
        assert_one_sentence(error)


@pytest.mark.parametrize("missing", schema.REQUIRED)
def test_what_is_required_is_missed(missing):
    fields = {name: value for name, value in FIELDS.items() if name != missing}
    with pytest.raises(InputError, match=f'"{missing}"') as error:
        schema.check(fields, "TRACK.json")
    assert_one_sentence(error)


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"version": 2}, "update PolyPose"),
        ({"anchor": "tibia"}, '"anchor" is not known'),
        ({"reference": "tibi"}, 'did you mean "tibia"'),
        ({"still": ["femur"]}, '"femur" is not known'),
        ({"still": "tibia"}, "give a list"),
        ({"frames_per_second": 0}, "frames per second"),
        ({"frames_per_second": float("inf")}, "frames per second"),
        ({"cameras": []}, "at least one camera"),
        ({"cameras": [{"images": "x"}] * 17}, "at most 16"),
        ({"cameras": [{"image": "x"}]}, 'did you mean "images"'),
        ({"cameras": [{**CAMERA, "frame": 3}]}, '"frame" is not known'),
        ({"cameras": [{**CAMERA, "first": -1}]}, "counted from 0"),
        ({"cameras": [{**CAMERA, "first": 10**9}]}, '"first" is beyond'),
        ({"cameras": [{**CAMERA, "camera": "initial"}]}, "the cameras of a sequence are known"),
        ({"cameras": [CAMERA, CAMERA]}, "the same name"),
        ({"landmarks": {"a": [1, 2]}}, "3 finite numbers"),
        ({"landmarks": {"a": [1, 2, 1e9]}}, "farther than"),
        ({"initial_poses": {"talus": [[2, 0, 0, 0], *RIGID[1:]]}}, "not rigid"),
        ({"options": {"start": "landmarks"}}, "rest"),
        ({"options": {"threads": 10**6}}, '"threads" is 1000000'),
        ({"options": {"first": 3, "last": 2}}, "first <= last"),
        ({"options": {"smoth": True}}, '"options": The field "smoth" is not known: did you mean "smooth"'),
    ],
)
def test_wrong_fields_are_refused(changes, match):
    with pytest.raises(InputError, match=match) as error:
        schema.check({**FIELDS, **changes}, "TRACK.json")
    assert_one_sentence(error)


def test_names_of_cameras_are_counted_where_there_are_none():
    assert schema.camera_name({}, 0) == "camera 1" and schema.camera_name({"name": " AP "}, 3) == "AP"
    unnamed = {name: value for name, value in CAMERA.items() if name != "name"}
    with pytest.raises(InputError, match="the same name"):
        schema.check({**FIELDS, "cameras": [{**CAMERA, "name": "camera 2"}, unnamed]}, "TRACK.json")


def test_a_file_is_read_and_others_are_refused(tmp_path):
    path = tmp_path / "TRACK.json"
    path.write_text(json.dumps(FIELDS))
    assert schema.read(path)["reference"] == "tibia"
    for text in ("", "[]", "{", '{"ct": 1, "ct": 2}', '{"frames_per_second": 1e999}'):
        path.write_text(text)
        with pytest.raises(InputError) as error:
            schema.read(path)
        assert_one_sentence(error)
    with pytest.raises(InputError, match="no such file"):
        schema.read(tmp_path / "absent.json")
