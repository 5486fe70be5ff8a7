"""Hounsfield units of DICOM slices: each slice by its own attributes, padding as air, whatever is for display alone."""

import numpy as np
import pydicom
import pytest
from dicom_stack import SHAPE, stack, write_stack
from pydicom.uid import ExplicitVRBigEndian, ImplicitVRLittleEndian, RLELossless

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.volumes import read_volume


def changed(folder, change, only=None):
    """Apply a change to the files of a stack, or to the one of these slices; returns their paths."""
    paths = sorted(folder.iterdir())
    for path in paths:
        file = pydicom.dcmread(path)
        if only is None or file.InstanceNumber - 1 in only:
            change(file)
            file.save_as(path)
    return paths


def stored_as(file, kind, slope=1.0, intercept=0.0):
    """Store the same Hounsfield units by another rescale and type of pixels."""
    hu = file.pixel_array * float(file.RescaleSlope) + float(file.RescaleIntercept)
    pixels = np.round((hu - intercept) / slope)
    file.PixelRepresentation = int(np.dtype(kind).kind == "i")
    file.RescaleSlope, file.RescaleIntercept = slope, intercept
    file.BitsAllocated = file.BitsStored = 8 * np.dtype(kind).itemsize
    file.HighBit = file.BitsStored - 1
    file.PixelData = pixels.astype(kind).tobytes()
    file["PixelData"].VR = "OW"


@pytest.mark.parametrize("only", [{0}, {3}, {1, 2, 7}])
@pytest.mark.parametrize(
    ("kind", "slope", "intercept"), [("<i2", 1, 0), ("<u2", 1, -2000), ("<i4", 1, 5), ("<i2", -1, 9)]
)
def test_every_slice_is_read_by_its_own_attributes(tmp_path, only, kind, slope, intercept):
    voxels = stack()
    write_stack(tmp_path / "ct", voxels)
    changed(tmp_path / "ct", lambda file: stored_as(file, kind, slope, intercept), only)
    assert np.array_equal(read_volume(tmp_path / "ct").voxels, voxels)


def test_slopes_that_are_no_whole_numbers_count(tmp_path):
    voxels = stack()
    write_stack(tmp_path / "ct", voxels)
    changed(tmp_path / "ct", lambda file: stored_as(file, "<i2", 0.25, 3.5), {2})
    read = read_volume(tmp_path / "ct").voxels
    assert np.abs(read - voxels).max() <= 0.125 and np.array_equal(read[3], voxels[3])


@pytest.mark.parametrize("is_compressed", [False, True])
def test_an_inverted_display_leaves_the_values(tmp_path, is_compressed):
    def invert(file):
        file.PhotometricInterpretation = "MONOCHROME1"
        if is_compressed:
            file.compress(RLELossless, generate_instance_uid=False)

    voxels = stack()
    write_stack(tmp_path / "ct", voxels)
    changed(tmp_path / "ct", invert)
    assert np.array_equal(read_volume(tmp_path / "ct").voxels, voxels)


def test_compressed_slices_are_read_beside_others(tmp_path):
    voxels = stack()
    write_stack(tmp_path / "ct", voxels)
    changed(tmp_path / "ct", lambda file: file.compress(RLELossless, generate_instance_uid=False), {0, 4})
    assert np.array_equal(read_volume(tmp_path / "ct").voxels, voxels)


@pytest.mark.parametrize("kind", ["<u2", "<i2"])
@pytest.mark.parametrize("padding", [65535, 63536, -2000, 40000])
def test_padding_is_air_however_its_sign_is_written(tmp_path, kind, padding):
    voxels = stack()
    stored = np.array(padding).astype(kind)  # wraps as the pixels do

    def pad(file):
        pixels = np.frombuffer(file.PixelData, "<u2").astype(kind)
        pixels[:7] = pixels[20] = stored
        file.PixelData = pixels.tobytes()
        file.PixelRepresentation = int(kind == "<i2")
        file.add_new(0x00280120, "US" if padding >= 0 else "SS", padding)

    write_stack(tmp_path / "ct", voxels)
    changed(tmp_path / "ct", pad)
    expected = voxels.reshape(len(voxels), -1).copy()
    expected[:, :7] = expected[:, 20] = -1000
    assert np.array_equal(read_volume(tmp_path / "ct").voxels, expected.reshape(SHAPE))


def test_a_range_of_padding_is_air(tmp_path):
    def pad(file):
        pixels = np.frombuffer(file.PixelData, "<u2").copy()
        pixels[:4] = 60000, 60500, 61000, 61001
        file.PixelData = pixels.tobytes()
        file.add_new(0x00280120, "US", 60000)
        file.add_new(0x00280121, "US", 61000)

    write_stack(tmp_path / "ct", stack())
    changed(tmp_path / "ct", pad)
    assert (read_volume(tmp_path / "ct").voxels[:, 0, :4] == [-1000, -1000, -1000, 61001 - 1024]).all()


def test_padding_of_a_tissues_value_counts_at_the_edge_alone(tmp_path):
    """A header that names 0 HU as padding must not make holes in soft tissue."""
    voxels = np.full(SHAPE, 200)
    voxels[:, 0, :] = voxels[:, 2, 3] = 0
    write_stack(tmp_path / "ct", voxels, PixelPaddingValue=1024)
    read = read_volume(tmp_path / "ct").voxels
    assert (read[:, 0] == -1000).all() and (read[:, 2, 3] == 0).all() and (read[:, 1] == 200).all()


@pytest.mark.parametrize("only", [None, {0}, {5}])
def test_slices_without_preamble_and_file_meta_are_read(tmp_path, only):
    voxels = stack()
    write_stack(tmp_path / "ct", voxels)
    for path in sorted((tmp_path / "ct").iterdir()):
        file = pydicom.dcmread(path)
        if only is None or file.InstanceNumber - 1 in only:
            pydicom.dcmwrite(
                path, pydicom.Dataset(file), implicit_vr=True, little_endian=True, enforce_file_format=False
            )
            assert path.read_bytes()[128:132] != b"DICM"
    assert np.array_equal(read_volume(tmp_path / "ct").voxels, voxels)


@pytest.mark.parametrize("syntax", [ImplicitVRLittleEndian, ExplicitVRBigEndian])
def test_byte_order_and_kind_of_header_do_not_matter(tmp_path, syntax):
    def store(file):
        file.file_meta.TransferSyntaxUID = syntax
        if not syntax.is_little_endian:
            file.PixelData = np.frombuffer(file.PixelData, "<u2").astype(">u2").tobytes()

    voxels = stack()
    write_stack(tmp_path / "ct", voxels)
    for path in sorted((tmp_path / "ct").iterdir()):
        file = pydicom.dcmread(path)
        store(file)
        file["PixelData"].VR = "OW"
        pydicom.dcmwrite(path, file, implicit_vr=syntax.is_implicit_VR, little_endian=syntax.is_little_endian)
    assert np.array_equal(read_volume(tmp_path / "ct").voxels, voxels)


def test_overlays_in_unused_bits_are_left_out(tmp_path):
    def overlay(file):
        pixels = np.frombuffer(file.PixelData, "<u2").copy()
        pixels[::3] |= 1 << 13
        file.PixelData, file.BitsStored, file.HighBit = pixels.tobytes(), 12, 11
        file.add_new(0x60000102, "US", 13)

    voxels = stack()
    write_stack(tmp_path / "ct", voxels)
    changed(tmp_path / "ct", overlay)
    assert np.array_equal(read_volume(tmp_path / "ct").voxels, voxels)


def test_a_slope_of_zero_is_refused_and_named(tmp_path):
    write_stack(tmp_path / "ct", stack())
    paths = changed(tmp_path / "ct", lambda file: setattr(file, "RescaleSlope", 0), {4})
    with pytest.raises(InputError, match="rescale slope or intercept") as error:
        read_volume(tmp_path / "ct")
    assert any(path.name in str(error.value) for path in paths)
