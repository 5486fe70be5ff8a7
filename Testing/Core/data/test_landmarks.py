"""Landmarks, standard views and calibrations in an X-ray's entry."""

import json

import numpy as np
import pytest
import SimpleITK as sitk

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.xray.landmarks import parse_landmarks
from PolyPoseLib.io.xray.read import read_xray

PAIRS = [{"point": [1, 2, 3], "pixel": [10, 20]}, {"point": [4, 5, 6.5], "pixel": [30.5, 0], "name": "spine"}]


@pytest.fixture
def image(tmp_path):
    rng = np.random.default_rng(0)
    path = tmp_path / "ap.nii.gz"
    sitk.WriteImage(sitk.GetImageFromArray(rng.random((40, 50)).astype(np.float32)), str(path))
    return path


def fields(**more):
    return {"image": "ap.nii.gz", "source_to_detector_mm": 1000, "pixel_spacing_mm": [0.5, 0.5], **more}


def test_landmarks_come_with_the_xray(image):
    xray = read_xray(image, fields=fields(landmarks=PAIRS, standard_view="LL"))
    np.testing.assert_array_equal(xray.landmarks.points, [[1, 2, 3], [4, 5, 6.5]])
    np.testing.assert_array_equal(xray.landmarks.pixels, [[10, 20], [30.5, 0]])
    assert xray.standard_view == "LL"


def test_landmarks_follow_the_columns_when_they_are_reversed(image):
    xray = read_xray(image, fields=fields(landmarks=PAIRS, mirrored=True))
    np.testing.assert_array_equal(xray.landmarks.pixels, [[39, 20], [18.5, 0]])


def test_no_landmarks():
    assert parse_landmarks(None, "x") is None
    assert parse_landmarks([], "x") is None


@pytest.mark.parametrize(
    ("value", "reason"),
    [
        ({}, "list of objects"),
        ([3], r"\[0\] must be an object"),
        ([{"point": [1, 2, 3]}], r'^ap\[0\]."pixel" is null; give 2 finite numbers'),
        ([{"point": [1, 2], "pixel": [1, 2]}], r'"point" is \[1, 2\]; give 3 finite numbers'),
        ([{"point": [1, 2, True], "pixel": [1, 2]}], '"point" is .*; give 3 finite'),
        ([{"point": "abc", "pixel": [1, 2]}], '"point" is "abc"; give 3 finite'),
        ([{"point": [1, 2, 3], "pixel": [1, 2], "ras": 1}], 'unknown field "ras"'),
    ],
)
def test_wrong_landmarks_are_refused(value, reason):
    with pytest.raises(InputError, match=reason):
        parse_landmarks(value, "ap")


def test_an_unknown_view_is_refused(image):
    with pytest.raises(InputError, match='"standard_view" is "FRONT"; give one of "AP"'):
        read_xray(image, fields=fields(standard_view="FRONT"))


def calibration(path, **more):
    rotation = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
    content = {"intrinsics": [[900, 0, 24], [0, 910, 19], [0, 0, 1]], **more}
    if "pose" in content:
        content.pop("pose")
        content |= {"rotation": rotation, "translation": [0, 5, 800]}
    (path.parent / "camera.json").write_text(json.dumps(content))


def test_a_calibration_gives_intrinsics_and_only_on_request_the_pose(image):
    calibration(image, pose=True)
    entry = {"image": "ap.nii.gz", "calibration": "camera.json"}
    xray = read_xray(image, fields=entry)
    assert xray.intrinsics[0, 0] == 900 and xray.extrinsic is None
    xray = read_xray(image, fields={**entry, "calibration_frame": "ct", "camera": "known"})
    assert xray.camera == "known"
    np.testing.assert_allclose(xray.extrinsic[:3, 3], [0, 5, 800])


def test_distortion_is_undone(image):
    calibration(image, distortion=[0.5, 0, 0, 0])
    plain = read_xray(image, fields=fields())
    straight = read_xray(image, fields={"image": "ap.nii.gz", "calibration": "camera.json"})
    assert np.abs(plain.image - straight.image).max() > 1e-3
    assert any("distortion" in line for line in straight.provenance)


@pytest.mark.parametrize(
    ("entry", "reason"),
    [
        ({"calibration": "missing.json"}, "missing.json"),
        ({"calibration": "../camera.json"}, "outside the study"),
        ({"calibration": "camera.json", "calibration_frame": "ct"}, "holds no pose"),
        ({"calibration": "camera.json", "calibration_frame": "rig"}, '"own", "ct"'),
        ({"calibration": 7}, "path of a file"),
    ],
)
def test_wrong_calibrations_are_refused(image, entry, reason):
    calibration(image)
    with pytest.raises(InputError, match=reason):
        read_xray(image, fields={"image": "ap.nii.gz", **entry})


def test_a_rig_takes_its_place_from_the_calibration(image):
    calibration(image, pose=True)
    xray = read_xray(image, fields={"image": "ap.nii.gz", "calibration": "camera.json", "rig": "biplane"})
    assert xray.rig.name == "biplane" and xray.extrinsic is None
    np.testing.assert_allclose(xray.rig.extrinsic[:3, 3], [0, 5, 800])


def test_a_rig_takes_its_place_from_the_extrinsic(image):
    extrinsic = np.eye(4)
    extrinsic[2, 3] = 700
    xray = read_xray(image, fields=fields(rig="biplane", extrinsic=extrinsic.tolist()))
    np.testing.assert_array_equal(xray.rig.extrinsic, extrinsic)


@pytest.mark.parametrize(
    ("entry", "reason"),
    [
        ({"calibration": "camera.json"}, "nothing gives its place in it"),
        ({"source_to_detector_mm": 1000, "pixel_spacing_mm": [1, 1]}, "nothing gives its place in it"),
        ({"calibration": "camera.json", "rig": " "}, "a text that is not empty"),
        ({"calibration": "camera.json", "rig": 3}, '"rig"'),
    ],
)
def test_wrong_rigs_are_refused(image, entry, reason):
    calibration(image)
    with pytest.raises(InputError, match=reason):
        read_xray(image, fields={"image": "ap.nii.gz", "rig": "biplane", **entry})


def test_a_calibrated_rig_needs_the_view_from_the_source(image):
    calibration(image, pose=True)
    entry = {"image": "ap.nii.gz", "calibration": "camera.json", "rig": "biplane", "mirrored": True}
    with pytest.raises(InputError, match="needs the source"):
        read_xray(image, fields=entry)
