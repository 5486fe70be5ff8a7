"""Numbers that no X-ray stand has are refused in a sentence, before anything overflows."""

import json
import warnings

import numpy as np
import pytest
import SimpleITK as sitk
from xray_samples import dataset, save

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import FOCAL_RANGE_PX, require_intrinsics
from PolyPoseLib.io.xray.calibration import read_calibration
from PolyPoseLib.io.xray.read import read_xray

ABSURD = [1e300, 1e200, 1e-200, 1e-300]
HUGE = [1e300, -1e300, 1e12]
USUAL = {"source_to_detector_mm": 1000, "pixel_spacing_mm": [0.4, 0.4], "intensity": "line_integral"}


@pytest.fixture(autouse=True)
def nothing_overflows():
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        yield


@pytest.fixture
def image(tmp_path):
    pixels = np.random.default_rng(0).random((40, 50)).astype(np.float32)
    sitk.WriteImage(sitk.GetImageFromArray(pixels), str(tmp_path / "ap.nii.gz"))
    return tmp_path / "ap.nii.gz"


def refusal(read, path, words, **fields) -> None:
    with pytest.raises(InputError, match=words) as error:
        read(path, fields=fields) if fields else read(path)
    message = str(error.value)
    assert path.name in message and "\n" not in message and len(message) < 400


def matrix(focal=400.0, column=24.5, skew=0.0) -> list:
    return [[focal, skew, column], [0, focal, 19.5], [0, 0, 1]]


@pytest.mark.parametrize("value", [*ABSURD, 1e-5, 1e12])
def test_focal_lengths_of_no_camera_are_refused(image, value):
    refusal(read_xray, image, '"intrinsics" has focal lengths', **USUAL, intrinsics=matrix(value))
    for row in range(2):
        one = matrix()
        one[row][row] = value
        with pytest.raises(InputError, match=r"from 0\.01 to 1e"):
            require_intrinsics(one)


@pytest.mark.parametrize("value", FOCAL_RANGE_PX)
def test_the_ends_of_the_range_belong_to_it(value):
    assert np.linalg.inv(require_intrinsics(matrix(value))).max() < 1e4


@pytest.mark.parametrize("value", HUGE)
@pytest.mark.parametrize(
    ("field", "entry"),
    [
        ("intrinsics", lambda value: matrix(column=value)),
        ("intrinsics", lambda value: matrix(skew=value)),
        ("principal_point_px", lambda value: [value, 20]),
        ("principal_point_px", lambda value: [20, value]),
        ("isocenter_mm", lambda value: [0, value, 0]),
        ("landmarks", lambda value: [{"point": [value, 0, 0], "pixel": [1, 1]}]),
        ("landmarks", lambda value: [{"point": [0, 0, 0], "pixel": [1, value]}]),
    ],
)
def test_points_beyond_all_detectors_and_patients_are_refused(image, field, entry, value):
    refusal(read_xray, image, field, **{**USUAL, field: entry(value)})


@pytest.mark.parametrize("value", ABSURD)
@pytest.mark.parametrize("field", ["source_to_detector_mm", "pixel_spacing_mm"])
def test_distances_and_spacings_of_no_stand_are_refused(image, field, value):
    refusal(read_xray, image, f'"{field}" is .*give', **{**USUAL, field: value})


@pytest.mark.parametrize("value", [*ABSURD, 1.0, 1e5])
@pytest.mark.parametrize(("modality", "tag"), [("XA", "DistanceSourceToDetector"), ("RTIMAGE", "RTImageSID")])
def test_distances_from_dicom_are_checked_too(tmp_path, modality, tag, value):
    path = save(dataset(modality=modality, **{tag: value}), tmp_path / "x.dcm")
    refusal(read_xray, path, 'add the right "source_to_detector_mm"')
    assert read_xray(path, fields={"source_to_detector_mm": 1000}).source_to_detector_mm == 1000


@pytest.mark.parametrize("value", [*ABSURD, 1e-4, 100.0])
@pytest.mark.parametrize("axis", range(2))
def test_spacings_from_dicom_are_checked_too(tmp_path, value, axis):
    pair = [0.4, 0.4]
    pair[axis] = value
    path = save(dataset(ImagerPixelSpacing=pair), tmp_path / "x.dcm")
    refusal(read_xray, path, 'add the right "pixel_spacing_mm"')
    assert read_xray(path, fields={"pixel_spacing_mm": 0.4}).pixel_spacing_mm == (0.4, 0.4)


def test_a_distance_that_follows_from_focal_length_and_spacing_is_checked(image):
    fields = {"intrinsics": matrix(1e8), "pixel_spacing_mm": 0.4, "intensity": "line_integral"}
    refusal(read_xray, image, "by its focal length and pixel spacing", **fields)
    assert read_xray(image, fields={**fields, "source_to_detector_mm": 1000}).source_to_detector_mm == 1000


@pytest.mark.parametrize("value", [*ABSURD, 1e12])
@pytest.mark.parametrize(
    "calibration",
    [
        lambda value: {"intrinsics": matrix(value)},
        lambda value: {"projection": [[value, 0, 20, 0], [0, value, 20, 0], [0, 0, 1, 700]]},
        lambda value: {"projection": [[400, 0, 20, 0], [0, 400, 20, 0], [0, 0, value, 700]]},
    ],
)
def test_a_calibration_of_no_camera_is_refused(tmp_path, calibration, value):
    path = tmp_path / "camera.json"
    path.write_text(json.dumps(calibration(value)))
    refusal(read_calibration, path, "focal lengths|singular")


@pytest.mark.parametrize("value", [1e300, -1e300, 1e7])
@pytest.mark.parametrize("place", range(5))
def test_a_distortion_of_no_lens_is_refused(tmp_path, place, value):
    path = tmp_path / "camera.json"
    coefficients = [0.0] * 5
    coefficients[place] = value
    path.write_text(json.dumps({"intrinsics": matrix(), "distortion": coefficients}))
    refusal(read_calibration, path, '"distortion"')


@pytest.mark.parametrize("scale", [1e-300, 1e-200, 1e-12, -1.0, 1e12, 1e200, -1e300])
def test_the_scale_of_a_projection_matrix_does_not_count(tmp_path, scale):
    path = tmp_path / "camera.csv"
    rows = np.array([[400, 0, 20, 0], [0, 400, 20, 0], [0, 0, 1, 700]]) * scale
    path.write_text("\n".join(",".join(map(repr, row)) for row in rows.tolist()))
    found = read_calibration(path)
    np.testing.assert_allclose(found.intrinsics, [[400, 0, 20], [0, 400, 20], [0, 0, 1]], rtol=1e-9)
    np.testing.assert_allclose(found.extrinsic[:3, 3], [-35, -35, 700], rtol=1e-9)


@pytest.mark.parametrize("distance", [1e300, 1e200, 1e12])
@pytest.mark.parametrize("scale", [1.0, 1e-300])
def test_a_projection_from_beyond_all_distances_is_refused(tmp_path, distance, scale):
    path = tmp_path / "camera.csv"
    rows = np.array([[400, 0, 20, 0], [0, 400, 20, 0], [0, 0, 1, 0]]) * scale
    rows[2, 3] = distance
    path.write_text("\n".join(",".join(map(repr, row)) for row in rows.tolist()))
    refusal(read_calibration, path, "its pose (has a translation beyond|holds NaN or infinity)")
