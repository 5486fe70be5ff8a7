"""Shutters that no tag declares are found whatever their shape and colour; pictures without one lose nothing."""

import numpy as np
import pytest
from picture_files import png
from scipy import ndimage
from shuttered_pictures import OUTSIDES, SHAPES, anatomy, opening, shuttered
from xray_samples import dataset, save

from PolyPoseLib.io.xray.read import read_xray
from PolyPoseLib.io.xray.shutter import find_field

SEEDS = range(2)


def field_of(picture, proportional=False, outside_is=None):
    field = find_field(picture.astype(np.float32), proportional, outside_is)
    return np.ones(picture.shape, dtype=bool) if field is None else field.mask(picture.shape)


def overlap(found, truth):
    return (found & truth).sum() / (found | truth).sum()


@pytest.mark.parametrize("outside", OUTSIDES)
@pytest.mark.parametrize("shape", SHAPES)
def test_the_field_is_found_whatever_its_shape_and_the_colour_outside(shape, outside):
    for seed in SEEDS:
        truth = opening(shape, seed)
        picture = shuttered(anatomy(seed), truth, outside, seed)
        assert overlap(field_of(picture), truth) >= 0.97, seed
        assert overlap(field_of(255 - picture), truth) >= 0.97, seed


@pytest.mark.parametrize("air", [False, True], ids=["body fills the picture", "air beside the body"])
def test_a_picture_without_shutter_loses_nothing(air):
    for seed in range(2):
        picture = anatomy(seed, air)
        sharpened = np.clip(picture + 1.5 * (picture - ndimage.gaussian_filter(picture, 4)), 0, 1)
        for shown in (picture, sharpened, np.clip(1.6 * picture - 0.3, 0, 1), 1 - np.exp(-4 * picture)):
            assert field_of(np.rint(255 * shown)).all(), seed
            assert field_of(np.rint(255 * (1 - shown))).all(), seed


def test_metal_letters_and_rails_are_no_shutters():
    for seed in range(4):
        picture = anatomy(seed)
        picture[:, 20:26] = picture[40:46] = picture[150:180, 130:] = picture[8:30, 160:180] = 0.98
        assert field_of(np.rint(255 * picture)).all(), seed


def test_a_field_does_not_depend_on_the_number_of_pixels():
    truth, picture = opening("tilted", 3), shuttered(anatomy(3), opening("tilted", 3), "black", 3)
    large = np.kron(picture, np.ones((3, 3), dtype=np.uint8))
    assert overlap(field_of(large), np.kron(truth, np.ones((3, 3), dtype=bool))) >= 0.97


def test_what_transmits_more_than_the_patient_is_no_shutter_of_unprocessed_values(tmp_path):
    truth = opening("square", 1)
    beam = np.where(truth, 4000 * np.exp(-4 * anatomy(1)), 60).astype(np.uint16)
    assert overlap(read_xray(save(dataset(beam), tmp_path / "dark.dcm")).mask, truth) >= 0.93
    beam[~truth] = 4000
    assert read_xray(save(dataset(beam), tmp_path / "bright.dcm")).mask.all()


def test_the_field_reaches_the_mask_and_the_provenance_of_a_picture(tmp_path):
    truth = opening("round", 5)
    path = png(tmp_path / "x.png", shuttered(anatomy(5), truth, "black", 5))
    xray = read_xray(path, fields={"source_to_detector_mm": 1000, "pixel_spacing_mm": [0.5, 0.5]})
    assert overlap(xray.mask, truth) >= 0.97
    assert any("collimator or shutter, detected" in line for line in xray.provenance)


def test_a_mask_from_the_study_takes_the_place_of_what_is_found(tmp_path):
    path = png(tmp_path / "x.png", shuttered(anatomy(5), opening("round", 5), "black", 5))
    png(tmp_path / "mask.png", np.full((200, 200), 255, dtype=np.uint8))
    fields = {"source_to_detector_mm": 1000, "pixel_spacing_mm": [0.5, 0.5], "mask": "mask.png"}
    xray = read_xray(path, fields=fields)
    assert not any("collimator or shutter" in line for line in xray.provenance)
    assert xray.mask.sum() > 1.1 * opening("round", 5).sum()


@pytest.mark.parametrize("shape", [(16, 16), (20, 900), (60, 60)])
def test_small_narrow_and_constant_pictures_lose_nothing(shape):
    assert field_of(np.full(shape, 7.0)).all()
    assert field_of(np.random.default_rng(0).random(shape)).all()
