"""Volumes whose header gives an impossible spacing, unit or length: refused in one sentence, never corrected."""

import gzip
import struct

import numpy as np
import pytest
import SimpleITK as sitk

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.volumes import read_ct, read_volume, write_volume

SHAPE = (6, 7, 8)
NAN, INF = float("nan"), float("inf")
META = "ObjectType = Image\nNDims = 3\nBinaryData = True\n{}\nDimSize = 8 7 6\nElementType = MET_SHORT\n"
NRRD = "NRRD0004\ntype: short\ndimension: 3\nsizes: 8 7 6\n{}\nendian: little\nencoding: raw\n\n"


def voxels() -> np.ndarray:
    values = np.random.default_rng(0).integers(-1000, 1500, SHAPE).astype("<i2")
    values.flat[:2] = -1000, 1500
    return values


def nifti(path, offset=0, form="", *values, end=None):
    """Write a right CT with the header changed at one place, and its last bytes cut off."""
    write_volume(Volume(voxels(), np.diag([2.0, 2, 2, 1])), path.parent / "right.nii")
    content = bytearray((path.parent / "right.nii").read_bytes())
    struct.pack_into("<" + form, content, offset, *values)
    content = bytes(content[:end])
    path.write_bytes(gzip.compress(content) if path.name.endswith(".gz") else content)
    return path


def refusal(path, read=read_ct) -> str:
    with pytest.raises(InputError) as error:
        read(path)
    message = str(error.value)
    assert path.name in message and "\n" not in message
    return message


@pytest.mark.parametrize("ending", ["nii", "nii.gz"])
@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("value", [0.0, NAN, INF])
def test_a_spacing_that_is_none_is_refused(tmp_path, ending, axis, value):
    """The toolkit takes it for 1 mm."""
    path = nifti(tmp_path / f"ct.{ending}", 80 + 4 * axis, "f", value)
    assert "pixdim" in refusal(path)
    assert "pixdim" in refusal(path, read_volume)


@pytest.mark.parametrize(("code", "word"), [(1, "metres"), (3, "micrometres"), (5, "unknown unit")])
def test_other_units_than_millimetres_are_refused(tmp_path, code, word):
    assert word in refusal(nifti(tmp_path / "ct.nii", 123, "B", code | 8))


@pytest.mark.parametrize("code", [0, 2, 2 | 8])
def test_millimetres_and_no_unit_are_read(tmp_path, code):
    path = nifti(tmp_path / "ct.nii", 123, "B", code)
    assert np.allclose(read_ct(path).spacing, 2) and np.array_equal(read_ct(path).voxels, voxels())


@pytest.mark.parametrize("value", [INF, -INF, NAN, 1e30, -5.0])
@pytest.mark.parametrize("ending", ["nii", "nii.gz"])
def test_an_offset_outside_the_file_is_refused(tmp_path, value, ending):
    assert "damaged or cut short" in refusal(nifti(tmp_path / f"ct.{ending}", 108, "f", value))


@pytest.mark.parametrize("bits", [0, -8, 1])
def test_bits_that_contradict_the_datatype_do_not_hide_a_cut(tmp_path, bits):
    assert np.array_equal(read_ct(nifti(tmp_path / "whole.nii", 72, "h", bits)).voxels, voxels())
    assert "cut short" in refusal(nifti(tmp_path / "cut.nii", 72, "h", bits, end=-2))


def test_half_a_pair_under_the_name_of_a_whole_is_refused(tmp_path):
    assert "damaged" in refusal(nifti(tmp_path / "ct.nii", 344, "4s", b"ni1\0"))


@pytest.mark.parametrize("value", [NAN, INF])
def test_an_affine_that_is_none_is_refused_with_the_files_name(tmp_path, value):
    assert "qform or sform" in refusal(nifti(tmp_path / "ct.nii", 280, "f", value))
    assert "qform or sform" in refusal(nifti(tmp_path / "q.nii", 254, "hf", 0, value))


@pytest.mark.parametrize(
    ("name", "header"),
    [
        ("ct.mha", "ElementSpacing = -2 2 2"),
        ("ct.mha", "ElementSpacing: 2 2 -2.0"),
        ("ct.mha", "ElementSize = 2 -.5 2"),
        ("ct.nrrd", "spacings: 2 -2 2"),
    ],
)
def test_a_negative_spacing_is_refused(tmp_path, name, header):
    """The toolkit mirrors the CT."""
    text = META.format(header) + "ElementDataFile = LOCAL\n" if name == "ct.mha" else NRRD.format(header)
    (tmp_path / name).write_bytes(text.encode() + voxels().tobytes())
    assert "negative" in refusal(tmp_path / name)


@pytest.mark.parametrize(
    ("name", "header"),
    [
        ("ct.mha", "Offset = -8 -7 -6\nElementSpacing = 2 2 2e-0"),
        ("ct.nrrd", "space: left-posterior-superior\nspace directions: (-2,0,0) (0,-2,0) (0,0,2)"),
    ],
)
def test_signs_elsewhere_in_a_header_are_no_negative_spacing(tmp_path, name, header):
    text = META.format(header) + "ElementDataFile = LOCAL\n" if name == "ct.mha" else NRRD.format(header)
    (tmp_path / name).write_bytes(text.encode() + voxels().tobytes() + b"\nElementSpacing = -1\n")
    assert np.array_equal(read_ct(tmp_path / name).voxels, voxels())


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("spacing", [0.001, 0.04, 21.0, 700.0])
@pytest.mark.parametrize("ending", ["nrrd", "mha", "nii.gz"])
def test_voxels_of_a_size_that_no_ct_has_are_refused(tmp_path, axis, spacing, ending):
    path = tmp_path / f"ct.{ending}"
    diagonal = [2.0, 2.0, 2.0, 1.0]
    diagonal[axis] = spacing
    write_volume(Volume(voxels(), np.diag(diagonal)), path)
    assert "unit" in refusal(path)
    assert np.allclose(read_volume(path).spacing, diagonal[:3])


@pytest.mark.parametrize("spacing", [0.05, 0.3, 5.0, 10.0, 20.0])
def test_voxels_of_every_size_that_a_ct_has_are_read(tmp_path, spacing):
    image = sitk.GetImageFromArray(voxels())
    image.SetSpacing([spacing] * 3)
    sitk.WriteImage(image, str(tmp_path / "ct.mha"))
    assert np.allclose(read_ct(tmp_path / "ct.mha").spacing, spacing)


@pytest.mark.parametrize("ending", ["nii", "nii.gz"])
def test_the_last_of_an_odd_number_of_voxels_is_looked_at_too(tmp_path, ending):
    """The toolkit takes it for water."""
    values = np.linspace(-1000, 1500, 27, dtype=np.float32).reshape(3, 3, 3)
    values[-1, -1, -1] = NAN
    write_volume(Volume(np.zeros_like(values), np.eye(4)), tmp_path / "right.nii")
    content = (tmp_path / "right.nii").read_bytes()[: -values.nbytes] + values.tobytes()
    path = tmp_path / f"ct.{ending}"
    path.write_bytes(gzip.compress(content) if ending == "nii.gz" else content)
    assert "1 voxels are NaN" in refusal(path)
