"""Calibrations give back the cameras that they were written from; wrong ones are refused in a sentence."""

import json

import numpy as np
import pytest
from random_camera import camera

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.xray.calibration import read_calibration


@pytest.mark.parametrize("separator", [",", ";", " "])
def test_csv(tmp_path, separator):
    true = camera(1)
    matrix = 0.01 * true.intrinsics @ true.extrinsic[:3]
    path = tmp_path / "camera.csv"
    path.write_text("\n".join(separator.join(f"{v:.12g}" for v in row) for row in matrix))
    found = read_calibration(path)
    np.testing.assert_allclose(found.extrinsic, true.extrinsic, atol=1e-4)
    np.testing.assert_allclose(found.intrinsics, true.intrinsics, rtol=1e-6, atol=1e-4)


def test_json_with_rows_upward_and_another_unit(tmp_path):
    true = camera(2)
    upward = np.array([[1.0, 0, 0], [0, -1, true.height - 1], [0, 0, 1]])
    centimetres = true.extrinsic[:3].copy()
    centimetres[:, 3] /= 10
    path = tmp_path / "camera.json"
    fields = {"projection": (upward @ true.intrinsics @ centimetres).tolist(), "rows": "up", "unit_mm": 10}
    path.write_text(json.dumps(fields))
    with pytest.raises(InputError, match="image_size"):
        read_calibration(path)
    path.write_text(json.dumps({**fields, "image_size": [true.height, true.width]}))
    found = read_calibration(path)
    np.testing.assert_allclose(found.extrinsic, true.extrinsic, atol=1e-6)
    np.testing.assert_allclose(found.intrinsics, true.intrinsics, rtol=1e-8, atol=1e-6)


def mayacam(true, **blocks):
    def rows(table):
        return "\n".join(",".join(f"{v:.12g}" for v in np.atleast_1d(row)) for row in table)

    parts = {
        "image size": f"{true.width},{true.height}",
        "camera matrix": rows(true.intrinsics),
        "rotation": rows(true.extrinsic[:3, :3]),
        "translation": rows(true.extrinsic[:3, 3:]),
        **blocks,
    }
    return "\n\n".join(f"{head}\n{body}" for head, body in parts.items() if body is not None) + "\n"


def test_mayacam(tmp_path):
    true = camera(3)
    path = tmp_path / "cam1.txt"
    path.write_text(mayacam(true))
    found = read_calibration(path)
    np.testing.assert_allclose(found.extrinsic, true.extrinsic, atol=1e-8)
    np.testing.assert_allclose(found.intrinsics, true.intrinsics)
    assert found.image_size == (1000, 1024)
    path.write_text(mayacam(true, rotation=None))
    with pytest.raises(InputError, match='lacks the block "rotation"'):
        read_calibration(path)
    path.write_text(mayacam(true, rotation="1,0,0\n0,1,0\n0,0,-1"))
    with pytest.raises(InputError, match="reflection"):
        read_calibration(path)


def test_a_text_that_names_the_camera_matrix_without_a_heading_is_refused(tmp_path):
    path = tmp_path / "cam1.txt"
    path.write_text("the camera matrix of view 1\n1,2,3\n")
    with pytest.raises(InputError, match='lacks the block "camera matrix"'):
        read_calibration(path)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("{", "valid JSON"),
        ("3", "one object"),
        ('{"projektion": []}', 'did you mean "projection"'),
        ("{}", 'give "projection"'),
        ('{"projection": [[1, 2], [3, 4]]}', "3 x 4"),
        ('{"intrinsics": [[1, 0, 0], [0, 0, 0], [0, 0, 1]]}', "focal"),
        ('{"intrinsics": [[9, 0, 0], [0, 9, 0], [0, 0, 1]], "distortion": [1]}', "four or five"),
        ('{"intrinsics": [[9, 0, 0], [0, 9, 0], [0, 0, 1]], "rows": "left"}', '"rows"'),
    ],
)
def test_wrong_files_are_refused_with_their_name(tmp_path, text, reason):
    path = tmp_path / "camera.json"
    path.write_text(text)
    with pytest.raises(InputError, match=reason) as error:
        read_calibration(path)
    assert "camera.json" in str(error.value)


K = "[[400, 0, 31], [0, 400, 31], [0, 0, 1]]"
P = "[[400, 0, 31, 0], [0, 400, 31, 0], [0, 0, 1, 700]]"
BIG = "9" * 400


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (f'{{"intrinsics": {K}, "distortion": ["a", "b", "c", "d"]}}', '"distortion"'),
        (f'{{"intrinsics": {K}, "distortion": {{"k1": 0.1}}}}', '"distortion"'),
        (f'{{"intrinsics": {K}, "distortion": [[1], [1, 2]]}}', '"distortion"'),
        (f'{{"intrinsics": {K}, "distortion": [[1, 2], [1, 2]]}}', '"distortion"'),
        (f'{{"intrinsics": {K}, "distortion": [true, 0, 0, 0]}}', '"distortion"'),
        (f'{{"intrinsics": {K}, "distortion": 0.1}}', '"distortion"'),
        (f'{{"intrinsics": {K}, "distortion": [{BIG}, 0, 0, 0]}}', "whole number of 400 digits"),
        (f'{{"intrinsics": {K.replace("400", BIG)}}}', "whole number of 400 digits"),
        (f'{{"intrinsics": {K.replace("31", "true")}}}', '"intrinsics"'),
        (f'{{"intrinsics": {K.replace("31", chr(34) + "31" + chr(34))}}}', '"intrinsics"'),
        (f'{{"projection": {P.replace("400", BIG)}}}', "whole number of 400 digits"),
        (f'{{"projection": {P.replace("700", "7" * 5000)}}}', "whole number of 5000 digits"),
        (f'{{"projection": {P}, "unit_mm": {BIG}}}', "whole number of 400 digits"),
        (f'{{"projection": {P}, "unit_mm": 1e308}}', '"unit_mm"'),
        (f'{{"projection": {P}, "unit_mm": 1e6}}', '"unit_mm"'),
        (f'{{"projection": {P}, "unit_mm": true}}', '"unit_mm"'),
        (f'{{"projection": {P}, "unit_mm": -1}}', '"unit_mm"'),
        (f'{{"projection": {P.replace("700", "1e300")}}}', "translation"),
        (f'{{"projection": {P}, "image_size": [-5, -5]}}', '"image_size"'),
        (f'{{"projection": {P}, "image_size": [64, 0]}}', '"image_size"'),
        (f'{{"projection": {P}, "image_size": [64.5, 64]}}', '"image_size"'),
        (f'{{"projection": {P}, "image_size": [NaN, 64]}}', '"image_size"'),
        (f'{{"projection": {P}, "image_size": [1e300, 64]}}', '"image_size"'),
        (f'{{"projection": {P}, "image_size": [true, true]}}', '"image_size"'),
        (f'{{"projection": {P}, "image_size": [{BIG}, 64]}}', "whole number of 400 digits"),
        ("[" * 100000, "nested too deeply"),
        ('{"a":' * 100000, "nested too deeply"),
    ],
)
def test_values_that_are_none_are_refused_with_their_name(tmp_path, text, reason):
    path = tmp_path / "camera.json"
    path.write_text(text)
    with pytest.raises(InputError, match=reason) as error:
        read_calibration(path)
    message = str(error.value)
    assert "camera.json" in message and "\n" not in message and len(message) < 400


@pytest.mark.parametrize("size", ["nan,64", "inf,64", "0,64", "-64,64", "64.5,64", "64", "a,b", "1e300,64"])
def test_an_image_size_that_is_none_is_refused(tmp_path, size):
    path = tmp_path / "cam1.txt"
    path.write_text(mayacam(camera(3), **{"image size": size}))
    with pytest.raises(InputError, match="image size") as error:
        read_calibration(path)
    assert "cam1.txt" in str(error.value)


def test_a_distortion_in_one_row_is_read(tmp_path):
    path = tmp_path / "camera.json"
    path.write_text(f'{{"intrinsics": {K}, "distortion": [[0.1, 0, 0, 0, -0.2]]}}')
    assert read_calibration(path).distortion == (0.1, 0, 0, 0, -0.2)
