"""Landmarks and calibrations come back from JSON as they were; entries with wrong fields are refused by name."""

import json
import string

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from json_values import VALUES, assert_one_sentence
from scipy.spatial.transform import Rotation

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.xray.calibration import read_calibration
from PolyPoseLib.io.xray.fields import FIELDS, XrayFields
from PolyPoseLib.io.xray.landmarks import parse_landmarks

COORDINATE = st.floats(-1e6, 1e6)
PAIRS = st.lists(
    st.fixed_dictionaries(
        {
            "point": st.lists(COORDINATE, min_size=3, max_size=3),
            "pixel": st.lists(COORDINATE, min_size=2, max_size=2),
        },
        optional={"name": st.text()},
    ),
    min_size=1,
    max_size=6,
)


@given(PAIRS, st.integers(1, 4000))
def test_landmarks_come_back_from_their_entry(pairs, width):
    found = parse_landmarks(json.loads(json.dumps(pairs)), "ap")
    assert found.points.tolist() == [pair["point"] for pair in pairs]
    assert found.pixels.tolist() == [pair["pixel"] for pair in pairs]
    twice = found.mirrored(width).mirrored(width)
    np.testing.assert_allclose(twice.pixels, found.pixels, atol=1e-9)
    np.testing.assert_array_equal(twice.points, found.points)


@given(st.sampled_from(FIELDS), VALUES)
def test_any_value_of_a_field_is_right_or_refused_by_the_fields_name(field, value):
    try:
        XrayFields.parse({field: value}, "ap")
    except InputError as error:
        assert_one_sentence(error)
        assert str(error).startswith("ap: ") and f'"{field}"' in str(error)


@given(
    st.dictionaries(st.text(string.ascii_letters), VALUES, max_size=4).filter(
        lambda entry: not set(entry) & set(FIELDS)
    )
)
def test_fields_of_others_are_left_alone(entry):
    assert XrayFields.parse(entry, "ap") == XrayFields()


@st.composite
def cameras(draw: st.DrawFn) -> tuple[np.ndarray, np.ndarray, tuple[int, int]]:
    """Intrinsics, extrinsic and (rows, columns) of a camera within two metres."""
    rng = np.random.default_rng(draw(st.integers(0, 1 << 32)))
    rows, columns = draw(st.integers(16, 4096)), draw(st.integers(16, 4096))
    intrinsics = np.diag([*rng.uniform(500, 8000, 2), 1.0])
    intrinsics[:2, 2] = rng.uniform(0, 1, 2) * (columns, rows)
    extrinsic = np.eye(4)
    extrinsic[:3, :3] = Rotation.random(random_state=rng).as_matrix()
    extrinsic[:3, 3] = *rng.uniform(-300, 300, 2), rng.uniform(300, 2000)
    return intrinsics, extrinsic, (rows, columns)


SCALES = st.builds(lambda sign, power: sign * 10.0**power, st.sampled_from([1, -1]), st.floats(-9, 9))


def test_a_projection_of_any_scale_unit_and_direction_of_rows_comes_back(tmp_path):
    path = tmp_path / "camera.json"

    @given(cameras(), SCALES, st.sampled_from([0.001, 1.0, 10.0, 1000.0]), st.booleans())
    def examples(camera, scale, unit, upward):
        intrinsics, extrinsic, size = camera
        pose = extrinsic[:3].copy()
        pose[:, 3] /= unit
        matrix = scale * intrinsics @ pose
        if upward:
            matrix = np.array([[1, 0, 0], [0, -1, size[0] - 1], [0, 0, 1]]) @ matrix
        fields = {"projection": matrix.tolist(), "unit_mm": unit, "image_size": list(size)}
        path.write_text(json.dumps({**fields, "rows": "up"} if upward else fields))
        found = read_calibration(path)
        np.testing.assert_allclose(found.intrinsics, intrinsics, rtol=1e-6, atol=1e-4)
        np.testing.assert_allclose(found.extrinsic, extrinsic, rtol=1e-6, atol=1e-4)
        assert found.image_size == size

    examples()


def test_intrinsics_pose_and_distortion_come_back(tmp_path):
    path = tmp_path / "camera.json"

    @given(cameras(), st.lists(st.floats(-1, 1), min_size=4, max_size=5), st.sampled_from([1.0, 10.0]))
    def examples(camera, distortion, unit):
        intrinsics, extrinsic, size = camera
        fields = {
            "intrinsics": intrinsics.tolist(),
            "rotation": extrinsic[:3, :3].tolist(),
            "translation": (extrinsic[:3, 3] / unit).tolist(),
            "unit_mm": unit,
            "image_size": list(size),
            "distortion": distortion,
        }
        path.write_text(json.dumps(fields))
        found = read_calibration(path)
        np.testing.assert_array_equal(found.intrinsics, intrinsics)
        np.testing.assert_allclose(found.extrinsic, extrinsic, atol=1e-9)
        assert found.distortion == tuple(distortion) and found.image_size == size

    examples()
