"""Studies: every wrong field is one sentence that names the file, the field and the fix."""

import copy
import json
import os

import numpy as np
import pytest
import SimpleITK as sitk

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.study import Study
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.io import study_schema
from PolyPoseLib.io.json_records import parse_object
from PolyPoseLib.io.volumes import write_volume

SHAPE = (10, 11, 12)
RIGID = [[1, 0, 0, 0], [0, 0, -1, 5], [0, 1, 0, 800], [0, 0, 0, 1]]
XRAY = {
    "image": "ap.nii.gz",
    "source_to_detector_mm": 1020,
    "pixel_spacing_mm": [0.4, 0.4],
    "extrinsic": RIGID,
}
FIELDS = {
    "version": 1,
    "ct": "ct.nii.gz",
    "segmentation": "labels.nii.gz",
    "structures": {"pelvis": [1, 2], "femur_left": [3]},
    "anchor": "pelvis",
    "xrays": [XRAY, {**XRAY, "image": "oblique.nii.gz", "camera": "known"}],
    "options": {},
}


def labels() -> np.ndarray:
    voxels = np.zeros(SHAPE, np.uint8)
    voxels[:4], voxels[4:6], voxels[6:9] = 1, 2, 3
    return voxels


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    """A folder with a CT, labels and two X-rays."""
    folder = tmp_path_factory.mktemp("study")
    rng = np.random.default_rng(0)
    affine = np.diag([2.0, 2.0, 2.0, 1.0])
    write_volume(Volume(rng.integers(-1000, 1500, SHAPE).astype(np.int16), affine), folder / "ct.nii.gz")
    write_volume(Volume(labels(), affine), folder / "labels.nii.gz")
    for name in ("ap", "oblique"):
        image = sitk.GetImageFromArray(rng.random((40, 50)).astype(np.float32))
        sitk.WriteImage(image, str(folder / f"{name}.nii.gz"))
    return folder


def write(folder, fields, name="study.json"):
    path = folder / name
    path.write_text(fields if isinstance(fields, str) else json.dumps(fields))
    return path


def changed(**changes):
    """The fields of a right study with some replaced; ... removes one."""
    fields = {**copy.deepcopy(FIELDS), **changes}
    return {name: value for name, value in fields.items() if value is not ...}


def xray(**changes):
    return changed(xrays=[{**XRAY, **changes}])


def test_a_right_study_is_loaded(data):
    study = Study.load(write(data, FIELDS))
    assert study.ct.shape == SHAPE
    assert study.ct.voxels.dtype == np.float32
    assert study.structures.names == ("pelvis", "femur_left")
    assert np.array_equal(study.structures.mask("pelvis"), (labels() == 1) | (labels() == 2))
    assert np.array_equal(study.source_segmentation.voxels, labels())
    assert [each.camera for each in study.xrays] == ["initial", "known"]
    assert study.xrays[0].image.shape == (40, 50)
    assert np.allclose(study.xrays[0].extrinsic, RIGID)
    assert np.allclose(study.xrays[0].intrinsics[0, 0], 1020 / 0.4)


def test_labels_have_the_names_of_a_table_where_the_study_names_one(data):
    assert Study.load(write(data, FIELDS)).label_names == {}
    named = Study.load(write(data, changed(label_table="totalsegmentator_v2"))).label_names
    assert (named[25], named[75], named[76]) == ("sacrum", "femur_left", "femur_right")


def test_the_version_may_be_absent(data):
    assert Study.load(write(data, changed(version=...))).anchor == "pelvis"


def test_absent_labels_are_told_in_the_warnings(data):
    study = Study.load(write(data, changed(structures={"pelvis": [1, 2, 9], "femur_left": [3], "rib": [7]})))
    assert study.structures.names == ("pelvis", "femur_left")
    assert sum("segmentation" in warning for warning in study.warnings) == 2


def test_initial_poses_are_read_and_those_of_absent_structures_left_out(data):
    structures = {"pelvis": [1, 2], "femur_left": [3], "rib": [7]}
    study = Study.load(
        write(data, changed(structures=structures, initial_poses={"femur_left": RIGID, "rib": RIGID}))
    )
    assert list(study.initial_poses) == ["femur_left"]
    assert np.allclose(study.initial_poses["femur_left"], RIGID)
    assert not Study.load(write(data, changed(initial_poses=None))).initial_poses


def test_one_structure_and_one_view_are_allowed(data):
    study = Study.load(write(data, changed(structures={"pelvis": [1]}, xrays=[XRAY])))
    assert len(study.structures) == 1
    assert any("one X-ray" in warning for warning in study.warnings)


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ("{", "line 1, column 2"),
        ('{"a": 1,\n "b": }', "line 2, column 7"),
        ('{"version": 1, "version": 1}', '"version" is given twice'),
        ('{"version": NaN}', "NaN"),
        ('{"x": -Infinity}', "Infinity"),
        ("[1]", "one JSON object"),
        ("[" * 100000, "nested too deeply"),
        ("\ufeff" + "{}", "is missing"),
        (changed(version=2), "update PolyPose"),
        (changed(version="1"), "set it to 1"),
        (changed(version=True), "set it to 1"),
        (changed(ct=...), 'the field "ct" is missing'),
        (changed(xrays=...), '"xrays" is missing'),
        (changed(anchr="pelvis"), 'did you mean "anchor"'),
        (changed(qqq=1), "give one of ct, segmentation"),
        (changed(ct=5), '"ct" is 5; give a text'),
        (changed(ct="absent.nii.gz"), '"ct" names "absent.nii.gz", but there is no such file'),
        (changed(ct="a\0b"), "path of a file"),
        (changed(structures=[1]), '"structures" must be an object'),
        (changed(structures={}), '"structures" is empty'),
        (changed(structures={"pelvis": 1}), '"pelvis" must be a list'),
        (changed(structures={"pelvis": []}), '"pelvis" is empty'),
        (changed(structures={"pelvis": [0]}), "above 0"),
        (changed(structures={"pelvis": [1.5]}), "above 0"),
        (changed(structures={"pelvis": [True]}), "above 0"),
        (changed(structures={"pelvis": [1], " ": [2]}), "name that is empty"),
        (changed(structures={"pelvis": [77]}), "label 77 .* is not in the image"),
        (changed(structures={"pelvis": [1], "b": [1]}), "listed by structure"),
        (changed(structures={"pelvis": ["hip"]}), "no names"),
        (changed(anchor="plevis"), 'did you mean "pelvis"'),
        (changed(anchor=None), '"anchor" is null; give a text'),
        (changed(xrays=[]), "at least one X-ray"),
        (changed(xrays={}), '"xrays" must be a list'),
        (changed(xrays=["a"]), r'"xrays"\[0\] must be an object'),
        (changed(xrays=[{}]), 'field "image" is missing'),
        (changed(xrays=[XRAY, XRAY]), "same image"),
        (xray(imge="a"), 'did you mean "image"'),
        (xray(camera="sure"), "camera"),
        (xray(image="absent.dcm"), "no such file"),
        (xray(extrinsic=[[1, 0], [0, 1]]), "4x4"),
        (xray(extrinsic="I"), "extrinsic"),
        (xray(extrinsic=np.diag([2, 1, 1, 1]).tolist()), "not rigid"),
        (xray(extrinsic=np.diag([-1, 1, 1, 1]).tolist()), "reflection"),
        (xray(pixel_spacing_mm=[0.4]), "pixel_spacing_mm"),
        (xray(pixel_spacing_mm=[0, 0.4]), "pixel_spacing_mm"),
        (xray(source_to_detector_mm=-5), "source_to_detector_mm"),
        (xray(source_to_detector_mm=None), "source_to_detector_mm"),
        (changed(options={"presett": "fast"}), 'did you mean "preset"'),
        (changed(options=[]), '"options" must be an object'),
        (changed(label_table="v9"), "label table"),
        (changed(ct_series=1.5), "ct_series"),
        (changed(initial_poses=[RIGID]), '"initial_poses" must be an object'),
        (changed(initial_poses={"femur_lft": RIGID}), 'did you mean "femur_left"'),
        (changed(initial_poses={"femur_left": RIGID[:3]}), "4x4"),
        (changed(initial_poses={"femur_left": np.diag([-1, 1, 1, 1]).tolist()}), "reflection"),
        (changed(initial_poses={"pelvis": RIGID}), "does not move"),
        (changed(initial_poses={"femur_left": RIGID}, options={"preset": "paper"}), "another preset"),
    ],
)
def test_wrong_studies_give_one_sentence(data, fields, words):
    with pytest.raises(InputError, match=words) as caught:
        Study.load(write(data, fields))
    message = str(caught.value)
    assert "study.json" in message
    assert "\n" not in message


def test_missing_huge_and_binary_study_files(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        Study.load(tmp_path / "study.json")
    with pytest.raises(InputError, match="this is a folder"):
        Study.load(tmp_path)
    (tmp_path / "binary.json").write_bytes(b"\xff\xfe\x00\x80")
    with pytest.raises(InputError, match="not UTF-8"):
        Study.load(tmp_path / "binary.json")
    with (tmp_path / "huge.json").open("wb") as stream:
        stream.truncate(study_schema.MAX_BYTES + 1)
    with pytest.raises(InputError, match="too large"):
        Study.load(tmp_path / "huge.json")


@pytest.mark.parametrize("field", ["ct", "segmentation", "image", "mask"])
@pytest.mark.parametrize("how", ["dots", "absolute", "link", "linked folder"])
def test_paths_that_leave_the_folder_are_refused(data, tmp_path, field, how):
    inside = tmp_path / "inside"
    inside.mkdir()
    for file in data.glob("*.nii.gz"):
        os.link(file, inside / file.name)
    name = {"ct": "ct.nii.gz", "segmentation": "labels.nii.gz"}.get(field, "ap.nii.gz")
    if how == "dots":
        target = os.path.relpath(data / name, inside)
    elif how == "absolute":
        target = str(data / name)
    elif how == "link":
        (inside / f"link_{name}").symlink_to(data / name)
        target = f"link_{name}"
    else:
        (inside / "linked").symlink_to(data)
        target = f"linked/{name}"
    fields = xray(**{field: target}) if field in ("image", "mask") else changed(**{field: target})
    path = write(inside, fields)
    with pytest.raises(InputError, match="outside the study's folder"):
        Study.load(path)
    assert Study.load(path, allow_outside=True).ct.shape == SHAPE


def test_headers_that_read_data_from_outside_are_refused(data, tmp_path):
    inside = tmp_path / "inside"
    inside.mkdir()
    for file in data.glob("*.nii.gz"):
        os.link(file, inside / file.name)
    image = sitk.ReadImage(str(data / "ct.nii.gz"))
    sitk.WriteImage(image, str(tmp_path / "ct.mhd"))
    header = (tmp_path / "ct.mhd").read_text()
    (inside / "ct.mhd").write_text(header.replace("ct.raw", "../ct.raw").replace("ct.zraw", "../ct.zraw"))
    path = write(inside, changed(ct="ct.mhd"))
    with pytest.raises(InputError, match="outside the study's folder"):
        Study.load(path)
    assert Study.load(path, allow_outside=True).ct.shape == SHAPE


def test_links_and_absolute_paths_inside_the_folder_are_read(data, tmp_path):
    for file in data.glob("*.nii.gz"):
        os.link(file, tmp_path / file.name)
    (tmp_path / "link.nii.gz").symlink_to("ct.nii.gz")
    fields = changed(ct="link.nii.gz", segmentation=str(tmp_path / "labels.nii.gz"))
    assert Study.load(write(tmp_path, fields)).ct.shape == SHAPE


def study_parts(data):
    study = Study.load(write(data, FIELDS))
    return {name: getattr(study, name) for name in ("ct", "structures", "anchor", "xrays")}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"xrays": ()}, "at least one X-ray"),
        ({"anchor": "spine"}, "no structure"),
        ({"ct": Volume(np.zeros((3, 3, 3)), np.eye(4))}, "resample the labels"),
        ({"ct": Volume(np.full(SHAPE, np.nan), np.eye(4))}, "NaN"),
        ({"options": {"preset": 1}}, "preset"),
        ({"source_segmentation": Volume(np.zeros((3, 3, 3), int), np.eye(4))}, "another grid"),
        ({"structures": Structures(("a",), np.ones(SHAPE, int))}, "no structure"),
    ],
)
def test_a_study_from_arrays_is_validated(data, change, words):
    parts = study_parts(data)
    assert Study(**parts).anchor == "pelvis"
    with pytest.raises(InputError, match=words):
        Study(**{**parts, **change})


def random_value(rng: np.random.Generator, depth: int = 0):
    """Any JSON value."""
    kinds = 5 if depth > 2 else 7
    match rng.integers(kinds):
        case 0:
            return None
        case 1:
            return bool(rng.integers(2))
        case 2:
            return int(rng.integers(-5, 100))
        case 3:
            return float(rng.normal() * 10.0 ** rng.integers(-300, 300))
        case 4:
            return str(rng.choice(["", " ", "pelvis", "a.nii.gz", "\0", "image", "known", "\ud800", "é"]))
        case 5:
            return [random_value(rng, depth + 1) for _ in range(rng.integers(4))]
    names = ["", "pelvis", "image", "extrinsic", "camera", "mask", "frame", "preset", "pixel_spacing_mm"]
    return {str(rng.choice(names)): random_value(rng, depth + 1) for _ in range(rng.integers(4))}


def test_whatever_is_written_the_check_never_stumbles():
    rng = np.random.default_rng(0)
    refused = 0
    for _ in range(1500):
        fields = copy.deepcopy(FIELDS)
        field, value = str(rng.choice(list(FIELDS))), random_value(rng)
        if field in ("structures", "xrays") and rng.integers(2):
            value = (
                {"pelvis": value}
                if field == "structures"
                else [{**XRAY, str(rng.choice([*XRAY, "mask"])): value}]
            )
        fields[field] = value
        try:
            study_schema.check(parse_object(json.dumps(fields), "study.json"), "study.json")
        except InputError as error:
            refused += 1
            assert str(error).startswith("study.json")
    assert refused > 1000
