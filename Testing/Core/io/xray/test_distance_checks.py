"""DICOM's lengths and angles against each other: what cannot be is refused or flagged, what is usual is silent."""

import itertools
import re

import numpy as np
import pytest
from xray_samples import dataset, random_pixels, save

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.xray.read import read_xray

USUAL = "the file shows the patient from the detector's side"
"""The one warning that every C-arm image has."""


def read(tmp_path, pixels=None, modality="XA", fields=None, **attributes):
    attributes = {"PositionerPrimaryAngle": 0, "PositionerSecondaryAngle": 0, **attributes}
    pixels = random_pixels(shape=(40, 60)) if pixels is None else pixels
    return read_xray(save(dataset(pixels, modality, **attributes), tmp_path / "x.dcm"), fields=fields)


def odd(xray):
    return [line for line in xray.warnings if not line.startswith(USUAL)]


def geometry(distance, magnification, pitch):
    """Attributes of one consistent stand."""
    return {
        "DistanceSourceToDetector": distance,
        "DistanceSourceToPatient": distance / magnification,
        "EstimatedRadiographicMagnificationFactor": magnification,
        "ImagerPixelSpacing": [pitch, pitch],
        "PixelSpacing": [pitch / magnification] * 2,
        "PixelSpacingCalibrationType": "GEOMETRY",
        "DetectorElementSpacing": [pitch / 2, pitch / 2],
        "DetectorBinning": [2, 2],
        "FieldOfViewDimensions": [round(pitch * 300), round(pitch * 400)],
        "FieldOfViewShape": "RECTANGLE",
        "PatientOrientation": ["L", "F"],
    }


@pytest.mark.parametrize(
    ("distance", "pitch"), [(400, 0.2), (1000, 0.3), (1200, 0.15), (1800, 0.14), (3050, 0.2)]
)
def test_consistent_stands_are_silent(tmp_path, distance, pitch):
    pixels = random_pixels(shape=(300, 400))
    for magnification, primary in itertools.product((1.05, 1.4, 2.5), (-45, 0, 30)):
        attributes = geometry(distance, magnification, pitch) | {"PositionerPrimaryAngle": primary}
        for left_out in (
            "DistanceSourceToPatient",
            "EstimatedRadiographicMagnificationFactor",
            "PixelSpacing",
        ):
            assert not odd(read(tmp_path, pixels, **attributes | {left_out: None}))
        rounded = read(
            tmp_path, pixels, **attributes | {"DistanceSourceToPatient": round(distance / magnification)}
        )
        assert not odd(rounded)
        assert rounded.source_to_detector_mm == distance


@pytest.mark.parametrize("distance", [1, 51, 100, 180, 249])
def test_a_distance_in_another_unit_is_refused_and_can_be_corrected(tmp_path, distance):
    with pytest.raises(InputError, match=r"centimetres|not from"):
        read(tmp_path, DistanceSourceToDetector=distance)
    xray = read(tmp_path, DistanceSourceToDetector=distance, fields={"source_to_detector_mm": 1000})
    assert xray.source_to_detector_mm == 1000 and not odd(xray)


@pytest.mark.parametrize("distance", [260, 340, 3600, 15000])
def test_an_unusual_distance_is_flagged_wherever_it_comes_from(tmp_path, distance):
    for xray in (
        read(tmp_path, DistanceSourceToDetector=distance),
        read(tmp_path, fields={"source_to_detector_mm": distance}),
    ):
        assert any(f"{distance} mm from the detector" in line for line in odd(xray))


@pytest.mark.parametrize("key", ["DistanceSourceToPatient", "DistanceSourceToIsocenter"])
def test_a_patient_behind_the_detector_is_refused(tmp_path, key):
    attributes = {key: 1500, "DistanceSourceToDetector": 1020}
    pose = np.eye(4) + np.outer([0, 0, 1, 0], [0, 0, 0, 700])
    for fields in (None, {"extrinsic": pose.tolist()}, {"source_to_detector_mm": 1100}):
        with pytest.raises(InputError, match="behind the detector"):
            read(tmp_path, fields=fields, **attributes)
    xray = read(tmp_path, fields={"source_to_isocenter_mm": 700}, **attributes)
    assert not odd(xray) and np.linalg.norm(xray.extrinsic[:3, 3]) == pytest.approx(700)


@pytest.mark.parametrize("near", [1020, 1012, 70, 102])
def test_a_patients_distance_that_cannot_be_is_ignored_with_a_warning(tmp_path, near):
    xray = read(tmp_path, DistanceSourceToPatient=near, DistanceSourceToDetector=1020)
    assert any("cannot both be right" in line for line in odd(xray))
    assert xray.extrinsic[2, 3] == pytest.approx(0.7 * 1020)


def test_an_rt_image_may_lie_in_the_isocentre(tmp_path):
    attributes = {"GantryAngle": 0, "PatientPosition": "HFS", "RadiationMachineSAD": 1000, "RTImageSID": 1000}
    xray = read(tmp_path, modality="RTIMAGE", **attributes)
    assert xray.extrinsic[2, 3] == pytest.approx(1000)


CONTRADICTIONS = {
    "magnification": ({"EstimatedRadiographicMagnificationFactor": 1.8}, "magnification of 1.8"),
    "larger at the patient": ({"PixelSpacing": [0.45, 0.45]}, "exchanged"),
    "another geometry": ({"PixelSpacing": [0.29, 0.29]}, r"0.29 x 0.29 mm at the patient"),
    "one element": (
        {"ImagerPixelSpacing": [0.15, 0.15], "PixelSpacing": None},
        "2 x 2 of them make one pixel",
    ),
    "at the patient": (
        {"ImagerPixelSpacing": [0.3 / 1.4] * 2, "PixelSpacing": None},
        "may hold at the patient",
    ),
    "centimetres": ({"ImagerPixelSpacing": [0.03, 0.03], "PixelSpacing": None}, "which no detector does"),
    "field of view": ({"FieldOfViewDimensions": [200, 267]}, "field of view"),
    "orientation": ({"PatientOrientation": ["P", "F"]}, "was ignored"),
    "view position": ({"ViewPosition": "LL"}, "90 degrees apart"),
}


@pytest.mark.parametrize("name", CONTRADICTIONS)
def test_a_contradiction_is_flagged_with_its_numbers(tmp_path, name):
    change, sentence = CONTRADICTIONS[name]
    pixels = random_pixels(shape=(300, 400))
    xray = read(tmp_path, pixels, **geometry(1000, 1.4, 0.3) | change)
    assert any(re.search(sentence, line) for line in odd(xray))


@pytest.mark.parametrize("increments", [None, [0.0], [0.0, 0.0], [0.0, 10.0, 20.0]])
def test_increments_for_every_frame_or_none_are_silent(tmp_path, increments):
    pixels = random_pixels(shape=(3, 40, 60))
    for frame in range(3):
        xray = read(tmp_path, pixels, PositionerPrimaryAngleIncrement=increments, fields={"frame": frame})
        assert not odd(xray)
        turn = np.degrees(np.arctan2(xray.extrinsic[2, 0], -xray.extrinsic[2, 1]))
        assert turn == pytest.approx(increments[frame] if increments and increments[-1] else 0)


@pytest.mark.parametrize("increments", [[5.0], [0.0, 15.0], [0.0, 1.0, 2.0, 3.0]])
def test_another_number_of_increments_than_frames_is_flagged(tmp_path, increments):
    pixels = random_pixels(shape=(3, 40, 60))
    for frame in range(3):
        xray = read(tmp_path, pixels, PositionerPrimaryAngleIncrement=increments, fields={"frame": frame})
        assert any(f"3 frames but {len(increments)} values" in line for line in odd(xray))


def test_lengths_of_the_detector_stand_in_for_a_missing_spacing_as_guesses(tmp_path):
    pixels = random_pixels(shape=(300, 400))
    for attributes, pitch in (
        ({"DetectorElementSpacing": [0.15, 0.15], "DetectorBinning": [2, 2]}, 0.3),
        ({"IntensifierSize": 230}, 230 / 400),
        ({"FieldOfViewDimensions": [90, 120]}, 0.3),
    ):
        xray = read(tmp_path, pixels, ImagerPixelSpacing=None, **attributes)
        assert xray.pixel_spacing_mm == pytest.approx((pitch, pitch))
        assert any("guess" in line and '"pixel_spacing_mm"' in line for line in odd(xray))
        assert any(
            line.startswith("pixel_spacing_mm") and line.endswith("a guess") for line in xray.provenance
        )
        typed = read(
            tmp_path, pixels, ImagerPixelSpacing=None, fields={"pixel_spacing_mm": 0.25}, **attributes
        )
        assert typed.pixel_spacing_mm == (0.25, 0.25) and not any("guess" in line for line in odd(typed))
