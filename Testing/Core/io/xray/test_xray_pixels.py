"""Stored pixels: codecs, bits, signs, frames, Modality LUT. Line integrals reveal what was read."""

import numpy as np
import pytest
from pydicom.dataset import Dataset
from pydicom.uid import ExplicitVRBigEndian, JPEG2000Lossless, RLELossless
from xray_samples import dataset, random_pixels, save

from PolyPoseLib.data.notes import Notes
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.dicom import open_dicom
from PolyPoseLib.io.xray.pixels import apply_modality, stored_pixels
from PolyPoseLib.io.xray.read import read_xray
from PolyPoseLib.io.xray.tags import XrayTags


def stored(ds, frame=0):
    return stored_pixels(XrayTags(ds, frame), Notes("file"))


def values(ds):
    tags = XrayTags(ds)
    return apply_modality(stored(ds), tags, Notes("file"))


@pytest.mark.parametrize("bits", [8, 10, 12, 14, 16])
@pytest.mark.parametrize("signed", [False, True])
def test_stored_values_return_whatever_the_unused_bits_hold(bits, signed):
    rng = np.random.default_rng(bits)
    low, high = (-(1 << (bits - 1)), 1 << (bits - 1)) if signed else (0, 1 << bits)
    truth = rng.integers(low, high, (20, 24))
    noise = rng.integers(0, 1 << 16, truth.shape)
    for shift in range(16 - bits + 1):
        field = ((1 << bits) - 1) << shift
        raw = ((truth & ((1 << bits) - 1)) << shift) | (noise & ~field)
        ds = dataset(
            raw.astype(np.uint16), bits=bits, HighBit=bits - 1 + shift, PixelRepresentation=int(signed)
        )
        np.testing.assert_array_equal(stored(ds), truth)


@pytest.mark.parametrize("signed", [False, True])
def test_the_order_of_bytes_is_the_files(tmp_path, signed):
    truth = (
        np.random.default_rng(0)
        .integers(-900 if signed else 0, 4000, (20, 24))
        .astype("i2" if signed else "u2")
    )
    ds = dataset(truth, bits=16, PixelRepresentation=int(signed))
    ds.file_meta.TransferSyntaxUID = ExplicitVRBigEndian
    ds.PixelData = truth.astype(truth.dtype.newbyteorder(">")).tobytes()
    path = save(ds, tmp_path / "x.dcm")
    np.testing.assert_array_equal(stored(open_dicom(path, "x")), truth)


@pytest.mark.parametrize("syntax", [RLELossless, JPEG2000Lossless])
@pytest.mark.parametrize("signed", [False, True])
def test_lossless_codecs_return_the_same_values(tmp_path, syntax, signed):
    pixels = random_pixels(shape=(64, 72)).astype(np.int32) - (2000 if signed else 0)
    pixels = pixels.astype(np.int16 if signed else np.uint16)
    ds = dataset(pixels)
    try:
        ds.compress(syntax, generate_instance_uid=False)
    except (RuntimeError, NotImplementedError):
        pytest.skip(f"no encoder for {syntax.name} is installed")
    np.testing.assert_array_equal(stored(ds), pixels)


def test_a_missing_decoder_names_the_package(monkeypatch):
    from pydicom.pixels.decoders import base

    class Missing:
        is_available = False

    monkeypatch.setattr(base, "get_decoder", lambda syntax: Missing())
    for syntax, package in (
        ("1.2.840.10008.1.2.4.90", "pylibjpeg-openjpeg"),
        ("1.2.840.10008.1.2.4.80", "pylibjpeg-libjpeg"),
        ("1.2.840.10008.1.2.4.70", "pylibjpeg-libjpeg"),
        ("1.2.840.10008.1.2.5", "pylibjpeg-rle"),
    ):
        ds = dataset()
        ds.file_meta.TransferSyntaxUID = syntax
        with pytest.raises(InputError, match=f"pip install .*{package}"):
            stored(ds)


def test_a_video_is_refused_with_a_sentence():
    ds = dataset()
    ds.file_meta.TransferSyntaxUID = "1.2.840.10008.1.2.4.103"
    with pytest.raises(InputError, match="export it uncompressed"):
        stored(ds)


def test_every_frame_can_be_chosen_and_the_middle_one_is_the_default(tmp_path):
    frames = np.stack([random_pixels(seed) for seed in range(5)])
    path = save(dataset(frames), tmp_path / "run.dcm")
    for index in range(5):
        np.testing.assert_array_equal(stored(dataset(frames), index), frames[index])
        alone = read_xray(save(dataset(frames[index]), tmp_path / "one.dcm"))
        np.testing.assert_array_equal(read_xray(path, fields={"frame": index}).image, alone.image)
        np.testing.assert_array_equal(read_xray(path, frame=index).image, alone.image)
    middle = read_xray(path)
    np.testing.assert_array_equal(middle.image, read_xray(path, frame=2).image)
    assert any('"frame"' in warning for warning in middle.warnings)
    assert not any('"frame"' in warning for warning in read_xray(path, frame=2).warnings)


def test_a_frame_that_does_not_exist_is_refused(tmp_path):
    path = save(dataset(np.stack([random_pixels()] * 3)), tmp_path / "run.dcm")
    with pytest.raises(InputError, match="from 0 to 2"):
        read_xray(path, frame=3)


def test_rescale_is_applied_and_its_direction_known():
    ds = dataset(RescaleSlope="-0.5", RescaleIntercept="100")
    got, order = values(ds)
    np.testing.assert_allclose(got, random_pixels() * -0.5 + 100)
    assert order == -1


@pytest.mark.parametrize("bits", [8, 16])
def test_a_modality_lut_is_looked_up_with_its_ends_clamped(bits):
    rng = np.random.default_rng(bits)
    table = np.sort(rng.integers(0, 1 << bits, 100)).astype("<u2")
    item = Dataset()
    item.add_new("LUTDescriptor", "US", [100, 50, bits])
    item.add_new("LUTData", "OW", table.tobytes())
    pixels = rng.integers(0, 300, (20, 20)).astype(np.uint16)
    got, order = values(dataset(pixels, ModalityLUTSequence=[item]))
    np.testing.assert_array_equal(got, table[np.clip(pixels.astype(int) - 50, 0, 99)])
    assert order == 1


def test_a_broken_modality_lut_is_refused():
    item = Dataset()
    item.add_new("LUTDescriptor", "US", [4096, 0, 16])
    item.add_new("LUTData", "OW", b"\0" * 10)
    with pytest.raises(InputError, match="Modality LUT"):
        values(dataset(ModalityLUTSequence=[item]))


def test_voi_windows_are_not_applied(tmp_path):
    plain = read_xray(save(dataset(), tmp_path / "a.dcm"))
    windowed = read_xray(save(dataset(WindowCenter=100, WindowWidth=10), tmp_path / "b.dcm"))
    np.testing.assert_array_equal(plain.image, windowed.image)


def test_gray_in_colour_is_read_and_colour_is_refused(tmp_path):
    gray = np.random.default_rng(0).integers(0, 255, (20, 20), dtype=np.uint8)
    ds = dataset(gray, bits=8, SamplesPerPixel=3, PhotometricInterpretation="RGB", PlanarConfiguration=0)
    ds.PixelData = np.stack([gray] * 3, -1).tobytes()
    np.testing.assert_array_equal(stored(ds), gray)
    ds.PixelData = np.random.default_rng(1).integers(0, 255, (20, 20, 3), dtype=np.uint8).tobytes()
    with pytest.raises(InputError, match="colour"):
        stored(ds)
