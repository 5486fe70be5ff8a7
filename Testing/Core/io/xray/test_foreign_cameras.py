"""Cameras as other programs write them: extrinsics without their last row, negative focal lengths."""

import json

import numpy as np
import pytest
import SimpleITK as sitk

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.xray.read import read_xray

POSE = [[1.0, 0, 0, 5], [0, 0, -1, -7], [0, 1, 0, 800]]
K = [[2500.0, 0, 20], [0, 2500, 30], [0, 0, 1]]


@pytest.fixture
def picture(tmp_path):
    lines = np.random.default_rng(0).random((48, 64)).astype(np.float32)
    sitk.WriteImage(sitk.GetImageFromArray(lines), tmp_path / "x.nii.gz")
    return tmp_path / "x.nii.gz"


def test_three_rows_are_an_extrinsic(picture):
    xray = read_xray(picture, fields={"intrinsics": K, "extrinsic": POSE, "camera": "known"})
    np.testing.assert_array_equal(xray.extrinsic, [*POSE, [0, 0, 0, 1]])
    for wrong in (POSE[:2], [row[:3] for row in POSE], [*POSE, [0, 0, 0, 2]]):
        with pytest.raises(InputError, match='"extrinsic"'):
            read_xray(picture, fields={"intrinsics": K, "extrinsic": wrong})


def negative(pose):
    """The same camera from the detector's side, z toward the source, as xreg writes it, with its K."""
    turned = np.diag([-1.0, 1, -1]) @ np.array(pose)
    return [[-2500.0, 0, 64 - 1 - 20], [0, -2500, 30], [0, 0, 1]], turned.tolist()


def test_the_detectors_side_with_negative_focal_lengths_is_the_same_camera_of_a_mirrored_file(picture):
    plain = read_xray(picture, fields={"intrinsics": K, "extrinsic": POSE})
    mirrored = picture.with_name("m.nii.gz")
    sitk.WriteImage(sitk.GetImageFromArray(np.ascontiguousarray(plain.image[:, ::-1])), mirrored)
    intrinsics, pose = negative(POSE)
    xray = read_xray(mirrored, fields={"intrinsics": intrinsics, "extrinsic": pose})
    assert xray.mirrored
    np.testing.assert_array_equal(xray.image, plain.image)
    np.testing.assert_allclose(xray.intrinsics, plain.intrinsics)
    np.testing.assert_allclose(xray.extrinsic, plain.extrinsic)
    with pytest.raises(InputError, match='"mirrored" is false'):
        read_xray(mirrored, fields={"intrinsics": intrinsics, "extrinsic": pose, "mirrored": False})


def test_a_calibration_with_negative_focal_lengths(picture):
    intrinsics, pose = negative(POSE)
    rotation, translation = [row[:3] for row in pose], [row[3] for row in pose]
    fields = {"intrinsics": intrinsics, "rotation": rotation, "translation": translation}
    (picture.parent / "camera.json").write_text(json.dumps(fields))
    entry = {"calibration": "camera.json", "calibration_frame": "ct"}
    xray = read_xray(picture, fields={**entry, "rig": "room"})
    assert xray.mirrored and xray.rig is not None
    np.testing.assert_allclose(xray.extrinsic[:3], POSE)
    np.testing.assert_allclose(xray.rig.extrinsic[:3], POSE)
