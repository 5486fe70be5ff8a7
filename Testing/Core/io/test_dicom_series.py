"""DICOM stacks: order, geometry, and what makes a stack unfit."""

import numpy as np
import pydicom
import pytest
from dicom_stack import SHAPE, enhanced, stack, write_stack
from pydicom.uid import generate_uid

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.volumes import read_ct, read_volume

AXES = ([1, 0, 0, 0, 1, 0], [0.8, 0.6, 0, -0.6, 0.8, 0], [1, 0, 0, 0, 0, -1], [-1, 0, 0, 0, 1, 0])


@pytest.mark.parametrize("axes", AXES)
def test_slices_are_sorted_by_position(tmp_path, axes):
    voxels = stack()
    normal = write_stack(tmp_path / "ct", voxels, axes)
    ct = read_ct(tmp_path / "ct")
    assert np.array_equal(ct.voxels, voxels)
    assert np.allclose(ct.affine[:3, 2], 2.5 * normal, atol=1e-6)
    assert np.allclose(ct.affine[:3, 0], 0.9 * np.array(axes[:3]), atol=1e-6)
    assert np.allclose(ct.affine[:3, 1], 0.7 * np.array(axes[3:]), atol=1e-6)
    assert np.allclose(ct.affine[:3, 3], [10, -20, 30])


def test_gantry_tilt_is_in_the_affine_and_a_filled_in_angle_is_not(tmp_path):
    voxels = stack()
    write_stack(
        tmp_path / "tilted", voxels, positions=[np.array([0, 0.2 * n, 2.5 * n]) for n in range(SHAPE[0])]
    )
    tilted = read_volume(tmp_path / "tilted")
    assert np.array_equal(tilted.voxels, voxels)
    assert np.allclose(tilted.affine[:3, 2], [0, 0.2, 2.5], atol=1e-6)
    write_stack(tmp_path / "straight", voxels, GantryDetectorTilt=15)
    assert np.allclose(read_volume(tmp_path / "straight").affine[:3, 2], [0, 0, 2.5], atol=1e-6)


def test_slices_that_no_tilt_displaced_are_refused_and_named(tmp_path):
    positions = [np.array([0, 0.2 * n, 2.5 * n]) for n in range(SHAPE[0])]
    positions[3] = positions[3] + [0, 2.0, 0]
    write_stack(tmp_path / "ct", stack(), positions=positions)
    with pytest.raises(InputError, match=r"slice 4 of 8 lies 2\.0 mm beside the line of the others"):
        read_volume(tmp_path / "ct")


def test_missing_uneven_and_repeated_slices_are_refused(tmp_path):
    even = [np.array([0, 0, 2.5 * n]) for n in range(SHAPE[0])]
    missing = [*even[:5], *(np.array([0, 0, 2.5 * n + 5]) for n in range(5, SHAPE[0]))]
    write_stack(tmp_path / "missing", stack(), positions=missing)
    with pytest.raises(InputError, match=r"2 slice\(s\) are missing between 10\.00 and 17\.50 mm"):
        read_volume(tmp_path / "missing")
    write_stack(
        tmp_path / "uneven", stack(), positions=[*even[:5], *(np.add(p, [0, 0, 0.9]) for p in even[5:])]
    )
    with pytest.raises(InputError, match="unevenly spaced"):
        read_volume(tmp_path / "uneven")
    write_stack(tmp_path / "twice", stack(), positions=[even[0], *even[:-1]])
    with pytest.raises(InputError, match="same place"):
        read_volume(tmp_path / "twice")


def test_rounded_positions_are_not_uneven(tmp_path):
    rounded = [np.array([0, 0, round(0.625 * n, 1)]) for n in range(SHAPE[0])]
    write_stack(tmp_path / "ct", stack(), positions=rounded)
    assert read_volume(tmp_path / "ct").shape == SHAPE


def test_several_series_are_listed_and_chosen(tmp_path):
    first, second = stack(1), stack(2)
    uid = generate_uid()
    write_stack(tmp_path / "ct", first, number=3)
    write_stack(tmp_path / "ct", second, number=7, uid=uid, SeriesDescription="thin, Nobody^Nowhere")
    words = rf'2 CT series: set "ct_series" to one of 3 \(8 slices, "[0-9.]+"\); 7 \(8 slices, "{uid}"\)\.$'
    with pytest.raises(InputError, match=words) as error:
        read_volume(tmp_path / "ct")
    assert "Nobody" not in str(error.value) and "thin" not in str(error.value)
    assert np.array_equal(read_volume(tmp_path / "ct", 3).voxels, first)
    assert np.array_equal(read_volume(tmp_path / "ct", "7").voxels, second)
    assert np.array_equal(read_volume(tmp_path / "ct", str(uid)).voxels, second)
    with pytest.raises(InputError, match="no series has"):
        read_volume(tmp_path / "ct", 9)


def test_localizers_and_other_files_are_left_aside(tmp_path):
    voxels = stack()
    write_stack(tmp_path / "ct", voxels)
    write_stack(tmp_path / "ct", voxels[:1], number=1, ImageType=["ORIGINAL", "PRIMARY", "LOCALIZER"])
    (tmp_path / "ct" / "README.txt").write_text("hello")
    assert np.array_equal(read_volume(tmp_path / "ct").voxels, voxels)


def test_folders_without_a_ct_are_refused(tmp_path):
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="no DICOM image"):
        read_volume(tmp_path / "empty")
    write_stack(tmp_path / "mr", stack(), Modality="MR")
    with pytest.raises(InputError, match=r"no CT series here \(found: MR\)"):
        read_volume(tmp_path / "mr")
    write_stack(tmp_path / "one", stack()[:1])
    with pytest.raises(InputError, match="one slice only"):
        read_volume(tmp_path / "one")
    write_stack(tmp_path / "mixed", stack())
    write_stack(tmp_path / "nowhere", stack(), ImagePositionPatient=None)
    with pytest.raises(InputError, match="ImagePositionPatient"):
        read_volume(tmp_path / "nowhere")


def test_enhanced_ct_is_read_by_its_functional_groups(tmp_path):
    voxels = stack()
    file = enhanced(voxels, np.random.default_rng(1).permutation(SHAPE[0]))
    pydicom.dcmwrite(tmp_path / "ct.dcm", file, enforce_file_format=True)
    ct = read_ct(tmp_path / "ct.dcm")
    assert np.array_equal(ct.voxels, voxels)
    assert np.allclose(ct.spacing, [0.9, 0.7, 1.5])


@pytest.mark.parametrize("share", [0.0, 0.1, 0.9, 0.999])
def test_a_slice_with_too_few_pixels_is_refused_and_named(tmp_path, share):
    """The toolkit would fill the rest with whatever the memory held."""
    write_stack(tmp_path / "ct", stack())
    path = sorted((tmp_path / "ct").iterdir())[3]
    file = pydicom.dcmread(path)
    file.PixelData = file.PixelData[: int(share * len(file.PixelData)) // 2 * 2]
    file.save_as(path)
    with pytest.raises(InputError, match=r"cut short|no pixels") as error:
        read_ct(tmp_path / "ct")
    assert path.name in str(error.value)


@pytest.mark.parametrize("cut", [1, 2, 13, 40])
def test_a_slice_whose_file_ends_early_is_refused_and_named(tmp_path, cut):
    write_stack(tmp_path / "ct", stack())
    path = sorted((tmp_path / "ct").iterdir())[3]
    path.write_bytes(path.read_bytes()[:-cut])
    with pytest.raises(InputError, match="cut short") as error:
        read_ct(tmp_path / "ct")
    assert path.name in str(error.value)


@pytest.mark.parametrize("tag", ["Columns", "BitsAllocated", "PixelData", "PixelSpacing", "SamplesPerPixel"])
@pytest.mark.parametrize("frames", [1, SHAPE[0]])
def test_missing_attributes_are_one_sentence_or_do_not_matter(tmp_path, tag, frames):
    (tmp_path / "ct").mkdir()
    voxels = stack()
    if frames == 1:
        write_stack(tmp_path / "ct", voxels)
    else:
        pydicom.dcmwrite(tmp_path / "ct" / "a.dcm", enhanced(voxels, range(frames)), enforce_file_format=True)
    path = sorted((tmp_path / "ct").iterdir())[-1]
    file = pydicom.dcmread(path)
    file["PixelData"].VR = "OW"
    if tag in file:
        del file[tag]
    else:
        del file.SharedFunctionalGroupsSequence[0].PixelMeasuresSequence
    file.save_as(path)
    if tag == "SamplesPerPixel" and frames == 1:
        assert np.array_equal(read_ct(tmp_path / "ct").voxels, voxels)
        return
    with pytest.raises(InputError) as error:
        read_ct(tmp_path / "ct")
    assert path.name in str(error.value) and "\n" not in str(error.value)


def replace_number(path, value):
    """Write bytes in the place of the whole number 8765, whose rule the writer would mind."""
    content = path.read_bytes()
    assert content.count(b"IS\x04\x008765") == 1
    path.write_bytes(content.replace(b"IS\x04\x008765", b"IS\x04\x00" + value))


@pytest.mark.parametrize("value", [b"abc ", b"-123", b"1\\2 ", b"   1"])
def test_a_number_of_frames_that_is_none_is_refused(tmp_path, value):
    write_stack(tmp_path / "ct", stack()[:1], NumberOfFrames=8765)
    path = next((tmp_path / "ct").iterdir())
    replace_number(path, value)
    with pytest.raises(InputError, match="one slice" if value == b"   1" else "NumberOfFrames") as error:
        read_volume(path)
    assert path.name in str(error.value)


def test_a_series_number_that_is_none_is_no_number(tmp_path):
    write_stack(tmp_path / "ct", stack(), SeriesNumber=8765)
    for path in (tmp_path / "ct").iterdir():
        replace_number(path, b"abc ")
    assert read_volume(tmp_path / "ct").shape == SHAPE
    with pytest.raises(InputError, match=r'no series has the number .* one of "'):
        read_volume(tmp_path / "ct", 4)


@pytest.mark.parametrize("frames", [1, SHAPE[0]])
def test_random_bytes_in_a_file_never_escape_as_other_errors(tmp_path, frames):
    (tmp_path / "ct").mkdir()
    if frames == 1:
        write_stack(tmp_path / "ct", stack())
    else:
        pydicom.dcmwrite(
            tmp_path / "ct" / "a.dcm", enhanced(stack(), range(frames)), enforce_file_format=True
        )
    path = sorted((tmp_path / "ct").iterdir())[-1]
    content, rng = path.read_bytes(), np.random.default_rng(0)
    refused = 0
    for _ in range(120):
        damaged = bytearray(content)
        for place in rng.integers(132, len(content) - 480, rng.integers(1, 6)):
            damaged[place] = rng.integers(256)
        path.write_bytes(damaged)
        try:
            read_volume(tmp_path / "ct")
        except InputError as error:
            refused += 1
            assert "Nobody" not in str(error)
    assert refused > 5
