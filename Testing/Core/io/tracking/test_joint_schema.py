"""Joints and names of landmarks as a TRACK.json gives them."""

import json

import numpy as np
import pytest

from PolyPoseLib.data.tracking.joints import CONVENTIONS, Joint, side_of
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.tracking.joint_schema import check_landmark_names, joints, those_that_are_there

BONES = ("pelvis", "femur_left", "tibia_left")
KNEE = {
    "name": "knee",
    "proximal": "femur_left",
    "distal": "tibia_left",
    "convention": "grood_suntay",
    "side": "left",
}


def parse(value):
    return joints(BONES)(json.loads(json.dumps(value)), '"joints"')


def test_joints_are_read():
    assert parse([KNEE]) == (Joint("knee", "femur_left", "tibia_left", "grood_suntay", "left"),)
    assert parse([]) == ()
    short = {"name": "hip", "proximal": "pelvis", "distal": "femur_left", "side": None}
    assert parse([short]) == (Joint("hip", "pelvis", "femur_left", "generic", "left"),)
    for convention in CONVENTIONS:
        assert parse([{**KNEE, "convention": convention}])[0].convention == convention


@pytest.mark.parametrize(
    "name, side",
    [
        ("femur_left", "left"), ("Right hip", "right"), ("vertebra_L5", "none"), ("bright_bone", "none"),
        ("left_or_right", "none"), ("RIGHT-TIBIA", "right"),
    ],
)  # fmt: skip
def test_the_side_that_a_name_says(name, side):
    assert side_of(name) == side


@pytest.mark.parametrize(
    "value, sentence",
    [
        ({}, '"joints" must be a list'),
        ("knee", '"joints" must be a list'),
        ([3], "give an object"),
        ([{}], '"name" is missing'),
        ([{**KNEE, "angle": 1}], 'field "angle" is not known'),
        ([{**KNEE, "distal": "tibia_lft"}], 'did you mean "tibia_left"'),
        ([{**KNEE, "distal": ["tibia_left"]}], "give a text"),
        ([{**KNEE, "convention": "ISB"}], 'give one of "grood_suntay"'),
        ([{**KNEE, "side": "medial"}], 'give one of "left"'),
        ([{**KNEE, "distal": "femur_left"}], 'are both "femur_left"'),
        ([{**KNEE, "name": "k" * 101}], "1 to 100 characters"),
        ([KNEE, KNEE], 'the name "knee" of an earlier one'),
        ([{**KNEE, "name": str(n)} for n in range(1001)], "give at most 1000"),
    ],
)
def test_wrong_joints_are_refused_with_their_place(value, sentence):
    with pytest.raises(InputError, match=sentence) as caught:
        parse(value)
    assert '"joints"' in str(caught.value)


def test_names_of_landmarks():
    check_landmark_names(["femur_left.hip_center", "tibia_left.origin"], BONES, '"landmarks"')
    for name, sentence in (
        ("hip_center", "has no bone"),
        ("femur.hip_center", 'did you mean "femur_left"'),
        ("femur_left.hip_centre", 'did you mean "hip_center"'),
        ("femur_left.", "is not known"),
    ):
        with pytest.raises(InputError, match=sentence):
            check_landmark_names([name], BONES, '"landmarks"')


def test_joints_of_bones_that_the_ct_does_not_show_are_left_out():
    given = parse([KNEE, {"name": "hip", "proximal": "pelvis", "distal": "femur_left"}])
    points = {"femur_left.origin": np.zeros(3), "tibia_left.origin": np.ones(3)}
    kept, landmarks, warnings = those_that_are_there(given, points, BONES[:2])
    assert [joint.name for joint in kept] == ["hip"] and list(landmarks) == ["femur_left.origin"]
    assert len(warnings) == 1 and '"knee" was left out' in warnings[0]
    assert those_that_are_there(given, points, BONES) == (given, points, [])
