"""A folder of one mask per structure, as TotalSegmentator writes by default."""

import json

import numpy as np
import pytest
from small_study import write_small_study

from PolyPoseLib.data.study import Study
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.io import mask_folder
from PolyPoseLib.io.segmentations import read_segmentation
from PolyPoseLib.io.volumes import read_volume, write_volume

SHAPE = (6, 7, 8)
AFFINE = np.array([[-1.5, 0, 0, 10], [0, 2, 0, 20], [0, 0, 3, -5], [0, 0, 0, 1.0]])


def box(low: int, high: int) -> np.ndarray:
    mask = np.zeros(SHAPE, np.uint8)
    mask[:, :, low:high] = 1
    return mask


def write_masks(folder, affine=AFFINE, **masks):
    folder.mkdir(exist_ok=True)
    for name, mask in masks.items():
        write_volume(Volume(mask, affine), folder / f"{name}.nii.gz")
    return folder


def test_every_mask_is_a_segment_named_like_its_file(tmp_path):
    folder = write_masks(tmp_path / "masks", my_left=box(0, 2), my_right=box(3, 5), empty=box(0, 0))
    (folder / "statistics.json").write_text("{}")
    (folder / "preview.png").write_bytes(b"no image")
    found = read_segmentation(folder)
    assert {each.name for each in found.segments} == {"my_left", "my_right", "empty"}
    assert np.allclose(found.layers[0].affine, AFFINE)
    for name, mask in (("my_left", box(0, 2)), ("my_right", box(3, 5))):
        layer, label = found.find(name, "bone")
        assert np.array_equal(found.layers[layer].voxels == label, mask > 0)
    with pytest.raises(InputError, match="empty"):
        found.find("empty", "bone")
    assert not found.warnings


def test_names_of_totalsegmentator_have_its_numbers(tmp_path):
    found = read_segmentation(write_masks(tmp_path / "m", sacrum=box(0, 2), femur_left=box(3, 5)))
    assert sorted(found.labels_present(0)) == [25, 75]


@pytest.mark.parametrize("names", ["ab", "ba"])
def test_overlaps_go_to_the_smaller_mask_whatever_its_name(tmp_path, names):
    large, small = names
    found = read_segmentation(write_masks(tmp_path / "m", **{large: box(0, 5), small: box(4, 6)}))
    masks = {each.name: found.layers[0].voxels == each.label for each in found.segments}
    assert np.array_equal(masks[small], box(4, 6) > 0)
    assert np.array_equal(masks[large], box(0, 4) > 0)
    assert len(found.warnings) == 1
    assert f"in {SHAPE[0] * SHAPE[1]} voxels" in found.warnings[0]


def study_with(folder, structures, **fields):
    path = write_small_study(folder)
    labels = read_volume(folder / "labels.nii.gz")
    (folder / "masks").mkdir()
    for name, number in (("hip_left", 25), ("femur_left", 75)):
        mask = labels.with_voxels((labels.voxels == number).astype(np.uint8))
        write_volume(mask, folder / "masks" / f"{name}.nii.gz")
    study = {**json.loads(path.read_text()), "segmentation": "masks", "structures": structures, **fields}
    path.write_text(json.dumps(study))
    return path


@pytest.mark.parametrize(
    ("structures", "fields"),
    [
        ({"pelvis": ["hip_left"], "femur": ["femur_left"]}, {}),
        ({"pelvis": [77], "femur": [75]}, {"label_table": "totalsegmentator_v2"}),
    ],
)
def test_studies_name_the_files_or_the_numbers_of_a_table(tmp_path, structures, fields):
    study = Study.load(study_with(tmp_path / "s", structures, **fields))
    labels = read_volume(tmp_path / "s" / "labels.nii.gz").voxels
    assert np.array_equal(study.structures.mask("pelvis"), labels == 25)
    assert np.array_equal(study.structures.mask("femur"), labels == 75)


def test_numbers_without_a_table_are_refused(tmp_path):
    with pytest.raises(InputError, match="list the names of its files"):
        Study.load(study_with(tmp_path / "s", {"pelvis": [1], "femur": [2]}))


def renamed(folder, name, other):
    (folder / name).rename(folder / other)
    return folder


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda f: write_masks(write_masks(f, a=box(0, 2)), AFFINE + 0.5 * np.eye(4, 4, 3), b=box(3, 4)), "b.* grid"),
        (lambda f: write_masks(f, a=2 * box(0, 2) + 3 * box(3, 5)), "a.* no mask"),
        (lambda f: write_masks(f, a=-box(0, 2).astype(np.int16)), "a.* no mask"),
        (lambda f: write_masks(f, a=box(0, 2) * 0.5 + box(3, 5) * 0.7), "a.* no mask"),
        (lambda f: renamed(write_masks(f, a=box(0, 2), b=box(3, 4)), "b.nii.gz", "a.nii"), "one name"),
    ],
)  # fmt: skip
def test_folders_that_are_no_masks_of_one_scan_are_refused(tmp_path, make, words):
    with pytest.raises(InputError, match=words):
        read_segmentation(make(tmp_path / "m"))


def test_folders_of_thousands_of_files_are_refused_unread(tmp_path, monkeypatch):
    folder = write_masks(tmp_path / "m", a=box(0, 2))
    for number in range(8):
        (folder / f"{number}.nii").write_bytes(b"")
    monkeypatch.setattr(mask_folder, "MAX_MASKS", 8)
    with pytest.raises(InputError, match="9 images"):
        read_segmentation(folder)
    monkeypatch.setattr(mask_folder, "MAX_ENTRIES", 8)
    with pytest.raises(InputError, match="more than 8 files"):
        read_segmentation(folder)
