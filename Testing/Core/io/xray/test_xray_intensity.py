"""What pixel values mean: whatever the encoding, more bone must give larger line integrals."""

import numpy as np
import pytest
import SimpleITK as sitk
from pydicom.dataset import Dataset
from xray_samples import dataset, save

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.xray.read import read_xray

FULL = 4095


def phantom(seed=0, shape=(40, 48)):
    """Line integrals from 0 (one corner in the beam) to 5."""
    rng = np.random.default_rng(seed)
    lines = rng.uniform(0.2, 5, shape)
    lines[:4, :12] = 0
    return lines


def linear(lines):
    return np.rint(FULL * np.exp(-lines)).astype(np.uint16)


def logarithmic(lines):
    return np.rint(FULL * (1 - lines / 6)).astype(np.uint16)


def correlation(a, b):
    return np.corrcoef(np.ravel(a), np.ravel(b))[0, 1]


PROCESSED = {"PresentationIntentType": "FOR PRESENTATION"}
RAW = {"PresentationIntentType": "FOR PROCESSING"}

ENCODINGS = {
    "XA LIN": ("XA", linear, {"PixelIntensityRelationship": "LIN"}),
    "XA LOG": ("XA", logarithmic, {"PixelIntensityRelationship": "LOG"}),
    "XA DISP": ("XA", logarithmic, {"PixelIntensityRelationship": "DISP"}),
    "XA without tags": ("XA", logarithmic, {"PixelIntensityRelationship": None}),
    "RF LIN": ("RF", linear, {"PixelIntensityRelationship": "LIN"}),
    "DX raw LIN": (
        "DX",
        linear,
        {"PixelIntensityRelationship": "LIN", "PixelIntensityRelationshipSign": 1, **RAW},
    ),
    "DX raw LIN, falling": (
        "DX",
        lambda lines: FULL - linear(lines),
        {"PixelIntensityRelationship": "LIN", "PixelIntensityRelationshipSign": -1, **RAW},
    ),
    "DX raw LOG": (
        "DX",
        logarithmic,
        {"PixelIntensityRelationship": "LOG", "PixelIntensityRelationshipSign": 1, **RAW},
    ),
    "DX LOG, falling": (
        "DX",
        lambda lines: FULL - logarithmic(lines),
        {"PixelIntensityRelationship": "LOG", "PixelIntensityRelationshipSign": -1, **PROCESSED},
    ),
    "DX MONOCHROME1": (
        "DX",
        logarithmic,
        {
            "PixelIntensityRelationship": "LOG",
            "PixelIntensityRelationshipSign": 1,
            "PhotometricInterpretation": "MONOCHROME1",
            "PresentationLUTShape": "INVERSE",
            **PROCESSED,
        },
    ),
    "MG whose sign contradicts its display": (
        "MG",
        lambda lines: FULL - logarithmic(lines),
        {"PixelIntensityRelationship": "LOG", "PixelIntensityRelationshipSign": 1, **PROCESSED},
    ),
    "CR MONOCHROME1": ("CR", logarithmic, {"PhotometricInterpretation": "MONOCHROME1"}),
    "CR MONOCHROME2": ("CR", lambda lines: FULL - logarithmic(lines), {}),
    "CR MONOCHROME2, falling slope": (
        "CR",
        logarithmic,
        {"RescaleSlope": "-10", "RescaleIntercept": "3000"},
    ),
    "CR MONOCHROME1, falling slope": (
        "CR",
        lambda lines: FULL - logarithmic(lines),
        {"RescaleSlope": "-1", "RescaleIntercept": "4095", "PhotometricInterpretation": "MONOCHROME1"},
    ),
    "CR with INVERSE": ("CR", logarithmic, {"PresentationLUTShape": "INVERSE"}),
    "RT image": ("RTIMAGE", lambda lines: FULL - logarithmic(lines), {}),
    "RT image, falling slope": (
        "RTIMAGE",
        lambda lines: FULL - linear(lines),
        {
            "PixelIntensityRelationship": "LIN",
            "PixelIntensityRelationshipSign": -1,
            "RescaleSlope": "-1",
            "RescaleIntercept": "4095",
        },
    ),
}


@pytest.mark.parametrize("name", ENCODINGS)
def test_more_bone_gives_larger_line_integrals(tmp_path, name):
    modality, encode, attributes = ENCODINGS[name]
    lines = phantom()
    xray = read_xray(save(dataset(encode(lines), modality, **attributes), tmp_path / "x.dcm"))
    image = xray.image[:, ::-1] if xray.mirrored else xray.image
    assert correlation(image, lines) > 0.999


@pytest.mark.parametrize("name", ["XA LIN", "DX raw LIN", "DX raw LIN, falling", "RT image, falling slope"])
def test_intensities_become_the_line_integrals_themselves(tmp_path, name):
    modality, encode, attributes = ENCODINGS[name]
    lines = phantom()
    xray = read_xray(save(dataset(encode(lines), modality, **attributes), tmp_path / "x.dcm"))
    step = 0.5 / (FULL * np.exp(-lines.max()))
    np.testing.assert_allclose(xray.image, lines, atol=1.1 * step)


def test_a_log_image_of_a_c_arm_is_made_linear_by_its_modality_lut(tmp_path):
    lines = phantom()
    item = Dataset()
    item.add_new("LUTDescriptor", "US", [FULL + 1, 0, 16])
    table = 65535 * np.exp((np.arange(FULL + 1) / FULL - 1) * 6)
    item.add_new("LUTData", "OW", np.rint(table).astype("<u2").tobytes())
    ds = dataset(logarithmic(lines), PixelIntensityRelationship="LOG", ModalityLUTSequence=[item])
    np.testing.assert_allclose(read_xray(save(ds, tmp_path / "x.dcm")).image, lines, atol=0.01)


def test_the_direct_beam_can_be_given(tmp_path):
    path = save(dataset(linear(phantom() + 1)), tmp_path / "x.dcm")
    estimated = read_xray(path)
    given = read_xray(path, fields={"unattenuated": FULL})
    np.testing.assert_allclose(given.image - estimated.image, 1, atol=0.01)
    assert any("I0 = 4095 (given)" in line for line in given.provenance)
    assert any("estimate" in line for line in estimated.provenance)


def test_saturated_and_dead_pixels_stay_finite(tmp_path):
    pixels = linear(phantom())
    pixels[10:14, 10:14] = 0
    image = read_xray(save(dataset(pixels), tmp_path / "x.dcm")).image
    assert np.isfinite(image).all()
    assert image.min() >= 0
    assert image.max() == pytest.approx(np.log(2 * FULL), abs=0.01)


@pytest.mark.parametrize("key", ["intensity", "polarity"])
def test_the_study_file_decides_over_the_tags(tmp_path, key):
    lines = phantom()
    path = save(dataset(FULL - logarithmic(lines), PixelIntensityRelationship="LIN"), tmp_path / "x.dcm")
    assert correlation(read_xray(path, fields={key: "attenuation"}).image, lines) > 0.999
    assert correlation(read_xray(path, fields={key: "log_transmission"}).image, lines) < -0.999
    with pytest.raises(InputError, match="give one of"):
        read_xray(path, fields={key: "bright"})


GEOMETRY = {"source_to_detector_mm": 1000, "pixel_spacing_mm": [0.4, 0.4]}


@pytest.mark.parametrize("ending", [".nii", ".nii.gz", ".nrrd", ".mha"])
def test_real_numbers_are_line_integrals_by_default_and_the_default_is_stated(tmp_path, ending):
    lines = phantom().astype(np.float32)
    path = tmp_path / f"x{ending}"
    sitk.WriteImage(sitk.GetImageFromArray(lines), path)
    xray = read_xray(path, fields=GEOMETRY)
    np.testing.assert_array_equal(xray.image, lines)
    assert any("line_integral by default" in line for line in xray.provenance)
    assert any('"intensity"' in line for line in xray.warnings)
    assert xray.mask.all()


def test_a_single_slice_volume_is_an_image(tmp_path):
    lines = phantom().astype(np.float32)
    sitk.WriteImage(sitk.GetImageFromArray(lines[None]), tmp_path / "x.nii.gz")
    np.testing.assert_array_equal(read_xray(tmp_path / "x.nii.gz", fields=GEOMETRY).image, lines)


@pytest.mark.parametrize("ending", [".png", ".tif"])
@pytest.mark.parametrize("depth", [np.uint8, np.uint16])
def test_pictures_are_bright_behind_bone_by_default(tmp_path, ending, depth):
    lines = phantom()
    pixels = np.rint(lines / 5 * np.iinfo(depth).max).astype(depth)
    path = tmp_path / f"x{ending}"
    sitk.WriteImage(sitk.GetImageFromArray(pixels), path)
    xray = read_xray(path, fields=GEOMETRY)
    assert correlation(xray.image, lines) > 0.999
    assert any("attenuation by default" in line for line in xray.provenance)
    dark = read_xray(path, fields={**GEOMETRY, "intensity": "log_transmission"})
    assert correlation(dark.image, lines) < -0.999


def test_transmission_in_real_numbers(tmp_path):
    lines = phantom()
    sitk.WriteImage(sitk.GetImageFromArray(np.exp(-lines).astype(np.float32)), tmp_path / "x.nrrd")
    xray = read_xray(tmp_path / "x.nrrd", fields={**GEOMETRY, "intensity": "transmission", "unattenuated": 1})
    np.testing.assert_allclose(xray.image, lines, atol=1e-5)


def test_the_affine_scale_ignores_what_is_masked(tmp_path):
    lines = phantom()
    pixels = FULL - logarithmic(lines)
    edge = dict(ShutterShape="RECTANGULAR", ShutterLeftVerticalEdge=1, ShutterRightVerticalEdge=40)
    edge.update(ShutterUpperHorizontalEdge=1, ShutterLowerHorizontalEdge=40)
    plain = read_xray(save(dataset(pixels, "CR", **edge), tmp_path / "a.dcm"))
    spoiled = pixels.copy()
    spoiled[:, 42:] = 65535 >> 4
    again = read_xray(save(dataset(spoiled, "CR", **edge), tmp_path / "b.dcm"))
    np.testing.assert_allclose(again.image[:, :38], plain.image[:, :38], atol=1e-6)
