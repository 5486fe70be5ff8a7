"""NRRD files in every patient frame and unit, given by where three voxels lie in the patient."""

from itertools import permutations, product

import numpy as np
import pytest
import SimpleITK as sitk

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.segmentations import read_segmentation
from PolyPoseLib.io.volumes import read_ct_with_warnings, read_volume

SIZES = (5, 6, 7)
WORDS = {"l": "left", "r": "right", "p": "posterior", "a": "anterior", "s": "superior", "i": "inferior"}
TOWARDS = {"l": (0, 1), "r": (0, -1), "p": (1, 1), "a": (1, -1), "s": (2, 1), "i": (2, -1)}
FRAMES = ["".join(letters) for axes in permutations(["lr", "pa", "si"]) for letters in product(*axes)]


def voxels() -> np.ndarray:
    values = np.random.default_rng(0).integers(-1000, 1500, SIZES[::-1]).astype("<i2")
    values.flat[:2] = -1000, 1500
    return values


def write(path, *lines: str, directions="(2,0,0) (0,3,0) (0,0,4)", origin="(10,20,30)", encoding="raw"):
    """A file with these lines in its header besides those of its grid."""
    head = [
        "NRRD0004",
        "type: short",
        "dimension: 3",
        "sizes: 5 6 7",
        "endian: little",
        f"encoding: {encoding}",
    ]
    head += [*lines]
    head += [f"space directions: {directions}", f"space origin: {origin}"] if directions else []
    data = voxels().tobytes()
    if encoding == "gzip":
        import gzip

        data = gzip.compress(data)
    path.write_bytes("\n".join([*head, "", ""]).encode() + data)
    return path


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("is_in_words", [False, True])
def test_every_patient_frame_is_read(tmp_path, frame, is_in_words):
    name = "-".join(WORDS[each] for each in frame) if is_in_words else frame.upper()
    volume = read_volume(write(tmp_path / "ct.nrrd", f"space: {name}"))
    assert np.array_equal(volume.voxels, voxels())
    for index in ((0, 0, 0), (4, 0, 0), (0, 5, 0), (1, 2, 6)):
        expected = np.zeros(3)
        for letter, steps in zip(frame, np.array([10, 20, 30]) + np.array(index) * [2, 3, 4], strict=True):
            axis, sign = TOWARDS[letter]
            expected[axis] = sign * steps
        assert np.allclose(volume.to_world(np.array(index)), expected)


@pytest.mark.parametrize("encoding", ["raw", "gzip"])
def test_a_frame_of_other_programs_keeps_voxels_and_slanted_axes(tmp_path, encoding):
    slanted = "(1.6,1.2,0) (-1.8,2.4,0) (0,0,4)"
    lai = read_volume(write(tmp_path / "a.nrrd", "space: LAI", directions=slanted, encoding=encoding))
    lps = read_volume(write(tmp_path / "b.nrrd", "space: LPS", directions=slanted))
    assert np.array_equal(lai.voxels, lps.voxels)
    assert np.allclose(lai.affine, np.diag([1, -1, -1, 1]) @ lps.affine)


@pytest.mark.parametrize("frame", ["LPS", "RAS", "LAI"])
@pytest.mark.parametrize(
    ("unit", "millimetres"), [("mm", 1), ("cm", 10), ("m", 1000), ("um", 0.001), ("centimeters", 10), ("", 1)]
)
def test_units_become_millimetres(tmp_path, frame, unit, millimetres):
    written = write(tmp_path / "ct.nrrd", f"space: {frame}", f'space units: "{unit}" "{unit}" "{unit}"')
    plain = read_volume(write(tmp_path / "mm.nrrd", f"space: {frame}"))
    assert np.allclose(read_volume(written).affine[:3], plain.affine[:3] * millimetres)


def test_units_of_plain_spacings_become_millimetres(tmp_path):
    path = write(tmp_path / "ct.nrrd", "spacings: 0.2 0.3 0.4", 'units: "cm" "cm" "cm"', directions=None)
    assert np.allclose(read_volume(path).spacing, [2, 3, 4])


@pytest.mark.parametrize("units", ['"pixel" "pixel" "pixel"', '"mm" "cm" "mm"', '"cm" "mm" "mm"'])
def test_units_that_are_no_lengths_or_differ_are_refused(tmp_path, units):
    with pytest.raises(InputError, match=r"ct\.nrrd: its .*units.* save it again in millimetres"):
        read_volume(write(tmp_path / "ct.nrrd", "space: LPS", f"space units: {units}"))


@pytest.mark.parametrize("space", ["LLS", "left-up-superior", "lapis", "LPSR"])
def test_a_frame_that_is_none_is_one_sentence(tmp_path, space):
    with pytest.raises(InputError, match=r"ct\.nrrd") as error:
        read_volume(write(tmp_path / "ct.nrrd", f"space: {space}"))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("space", ["space: scanner-xyz", "space: 3D-right-handed", "space dimension: 3"])
def test_a_ct_without_a_patient_frame_is_read_as_lps_with_a_warning(tmp_path, space):
    ct, warnings = read_ct_with_warnings(write(tmp_path / "ct.nrrd", space))
    assert np.allclose(ct.affine, [[2, 0, 0, 10], [0, 3, 0, 20], [0, 0, 4, 30], [0, 0, 0, 1]])
    assert "left and right" in " ".join(warnings)
    for frame in ("RAS", "left-posterior-superior", "LAI"):
        assert "left" not in " ".join(read_ct_with_warnings(write(tmp_path / "b.nrrd", f"space: {frame}"))[1])


def test_a_segmentation_in_another_frame_keeps_its_segments(tmp_path):
    fields = ["Segment0_ID:=a", "Segment0_Name:=femur", "Segment0_LabelValue:=1", "Segment0_Layer:=0"]
    path = write(tmp_path / "labels.seg.nrrd", "space: LAI", *fields)
    path.write_bytes(path.read_bytes()[: -voxels().nbytes] + (voxels() > 0).astype("<i2").tobytes())
    segmentation = read_segmentation(path)
    assert segmentation.has_segment("femur")
    assert np.allclose(segmentation.layers[0].affine[:3, 3], [10, -20, -30])


def test_voxels_in_another_file_are_read_in_their_unit_but_not_in_such_a_frame(tmp_path):
    (tmp_path / "voxels.raw").write_bytes(voxels().tobytes())
    lines = ["data file: voxels.raw", 'space units: "cm" "cm" "cm"']
    volume = read_volume(write(tmp_path / "ct.nhdr", "space: LPS", *lines))
    assert np.allclose(volume.spacing, [20, 30, 40]) and np.array_equal(volume.voxels, voxels())
    with pytest.raises(InputError, match=r"none of LPS, RAS and LAS, .* save it again in LPS"):
        read_volume(write(tmp_path / "ct.nhdr", "space: LAI", *lines))


def test_what_is_written_is_read_again_in_the_same_place(tmp_path):
    image = sitk.GetImageFromArray(voxels())
    image.SetOrigin((1, 2, 3))
    image.SetDirection((0, -1, 0, 1, 0, 0, 0, 0, 1))
    sitk.WriteImage(image, str(tmp_path / "ct.nrrd"))
    assert np.allclose(read_volume(tmp_path / "ct.nrrd").affine[:3, :3], [[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    assert not read_ct_with_warnings(tmp_path / "ct.nrrd")[1]
