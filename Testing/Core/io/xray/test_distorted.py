"""A round field is an image intensifier's, whose distortion counts unless something says that it was corrected."""

import numpy as np
import pytest
from xray_samples import dataset

from PolyPoseLib.io.xray.distorted import is_round
from PolyPoseLib.io.xray.read import read_xray

SHAPE = (240, 256)
WARNING = "image intensifier"


def disc(radius, row=0.0, column=0.0, shape=SHAPE) -> np.ndarray:
    """A disc about the image's middle, or off it; in shares of half the shorter side."""
    half = min(shape) / 2
    rows, columns = np.indices(shape)
    away = np.hypot(rows - (shape[0] - 1) / 2 - row * half, columns - (shape[1] - 1) / 2 - column * half)
    return away <= radius * half


@pytest.mark.parametrize("seed", range(20))
def test_discs_are_round_wherever_the_picture_cuts_them(seed):
    rng = np.random.default_rng(seed)
    assert is_round(disc(rng.uniform(0.8, 1.25), *rng.uniform(-0.08, 0.08, 2)))


@pytest.mark.parametrize("seed", range(20))
def test_fields_with_straight_sides_are_not_round(seed):
    rng = np.random.default_rng(seed)
    rows, columns = np.indices(SHAPE) - (np.array(SHAPE)[:, None, None] - 1) / 2
    inside = np.ones(SHAPE, bool)
    for angle in np.arange(4) * np.pi / 2 + rng.uniform(-0.4, 0.4):
        inside &= rows * np.sin(angle) + columns * np.cos(angle) <= rng.uniform(60, 110)
    assert not is_round(inside)


def test_a_whole_picture_and_a_small_hole_in_it_are_not_round():
    assert not is_round(np.ones(SHAPE, bool))
    assert not is_round(~disc(0.3))
    assert not is_round(disc(0.5))


def xray(tmp_path, fields=None, shape=None):
    """An X-ray behind a declared round shutter, or with a field of a declared shape."""
    pixels = np.random.default_rng(0).integers(1000, 3000, SHAPE, dtype=np.uint16)
    shutter = {
        "ShutterShape": "CIRCULAR",
        "CenterOfCircularShutter": [SHAPE[0] // 2, SHAPE[1] // 2],
        "RadiusOfCircularShutter": 125,
    }
    path = tmp_path / "x.dcm"
    attributes = {**shutter, "ImagerPixelSpacing": [0.5, 0.5], "FieldOfViewShape": shape}
    dataset(pixels, **{k: v for k, v in attributes.items() if v}).save_as(path, enforce_file_format=True)
    return read_xray(path, fields=fields or {})


def test_a_round_field_counts_as_distorted_and_says_what_to_do(tmp_path):
    found = xray(tmp_path)
    assert found.maybe_distorted
    (warning,) = (each for each in found.warnings if WARNING in each)
    assert '"distortion_corrected": true' in warning


@pytest.mark.parametrize(
    ("fields", "shape", "distorted"),
    [
        ({"distortion_corrected": True}, None, False),
        ({"distortion_corrected": False}, "RECTANGLE", True),
        ({"camera": "known", "extrinsic": np.diag([1, 1, 1, 1.0]).tolist()}, None, False),
        ({}, "RECTANGLE", False),
        ({}, "ROUND", True),
    ],
)
def test_what_says_whether_it_was_corrected(tmp_path, fields, shape, distorted):
    found = xray(tmp_path, fields, shape)
    assert found.maybe_distorted == distorted
    if not distorted:
        assert not any(WARNING in each for each in found.warnings)
