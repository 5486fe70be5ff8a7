"""Structures: proposals, label maps, .seg.nrrd with layers, overlaps."""

import numpy as np
import pytest
import SimpleITK as sitk

from PolyPoseLib.data.label_names import TABLES, label_table, propose_anchor, propose_structures, structure_of
from PolyPoseLib.data.segmentation import Segmentation
from PolyPoseLib.data.structures import Structures, build_structures, structures_from_labels
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.segmentations import read_segmentation
from PolyPoseLib.io.volumes import write_volume

SHAPE = (8, 9, 10)


def blocks(seed=0) -> np.ndarray:
    """Labels 1 to 4 as slabs with some background."""
    labels = np.repeat(np.arange(1, 5), 2)[:, None, None] * np.ones(SHAPE, int)
    labels[np.random.default_rng(seed).random(SHAPE) < 0.2] = 0
    return labels.astype(np.uint8)


def ct() -> Volume:
    affine = np.diag([1.5, -2, 2.5, 1])
    affine[:3, 3] = 10, 20, 30
    return Volume(np.zeros(SHAPE, np.float32), affine)


def on_ct(labels: np.ndarray) -> Volume:
    return Volume(labels, ct().affine)


def write_seg(path, layers, segments) -> None:
    """A .seg.nrrd as Slicer writes it: layers along the first axis when there are several."""
    images = [sitk.GetImageFromArray(layer) for layer in layers]
    image = images[0] if len(images) == 1 else sitk.Compose(images)
    for n, (identifier, name, layer, value) in enumerate(segments):
        for field, text in (("ID", identifier), ("Name", name), ("Layer", layer), ("LabelValue", value)):
            if text is not None:
                image.SetMetaData(f"Segment{n}_{field}", str(text))
    sitk.WriteImage(image, str(path), True)


def test_tables_follow_totalsegmentator():
    v1, v2 = label_table("totalsegmentator_v1"), label_table("totalsegmentator_v2")
    assert len(v1) == 104
    assert len(v2) == 117
    assert (v2[25], v2[26], v2[27], v2[50]) == ("sacrum", "vertebrae_S1", "vertebrae_L5", "vertebrae_C1")
    assert (v2[75], v2[78], v2[92], v2[115], v2[116]) == (
        "femur_left", "hip_right", "rib_left_1", "rib_right_12", "sternum",
    )  # fmt: skip
    assert (v1[18], v1[88], v1[92]) == ("vertebrae_L5", "femur_left", "sacrum")
    assert label_table("totalsegmentator_v3")[26] == "vertebrae_L6"
    for table in TABLES:
        names = list(label_table(table).values())
        assert len(set(names)) == len(names)
    with pytest.raises(InputError, match="totalsegmentator_v2"):
        label_table("totalsegmentator_2")


def test_proposals_group_bones_that_move_together():
    groups = propose_structures(range(1, 118), "totalsegmentator_v2")
    assert sorted(groups["pelvis"]) == [25, 26, 77, 78]
    assert groups["femur_left"] == [75]
    assert groups["lumbar_spine"] == [27, 28, 29, 30, 31]
    assert len(groups["thoracic_spine"]) == 12
    assert len(groups["cervical_spine"]) == 7
    assert len(groups["ribs_left"]) == len(groups["ribs_right"]) == 12
    listed = [label for labels in groups.values() for label in labels]
    assert len(set(listed)) == len(listed)
    names = label_table("totalsegmentator_v2")
    soft = {"heart", "spinal_cord", "costal_cartilages", "brain", "hip", "gluteus_maximus_left", "colon"}
    assert not soft & {names[label] for label in listed}
    assert propose_anchor(list(groups)) == "pelvis"
    assert propose_anchor(["ribs_left", "thoracic_spine"]) == "thoracic_spine"
    assert propose_anchor([]) is None


def test_proposals_of_versions_hold_the_same_bones():
    named = [
        {
            structure: sorted(label_table(table)[label] for label in labels)
            for structure, labels in propose_structures(label_table(table), table).items()
        }
        for table in ("totalsegmentator_v1", "totalsegmentator_v2")
    ]
    for structure in named[0]:
        difference = set(named[1][structure]) ^ set(named[0][structure])
        assert difference <= {"vertebrae_S1"}


def test_single_bones_on_request():
    groups = propose_structures([27, 28, 92, 104, 77], "totalsegmentator_v2", "bones")
    assert groups == {
        "pelvis": [77], "vertebra_L4": [28], "vertebra_L5": [27], "rib_left_1": [92], "rib_right_1": [104],
    }  # fmt: skip


@pytest.mark.parametrize(
    ("name", "structure"),
    [
        ("hip_left", "pelvis"), ("Left hip", "pelvis"), ("left hip bone", "pelvis"), ("Sacrum", "pelvis"),
        ("L5 vertebra", "lumbar_spine"), ("vertebrae_T12", "thoracic_spine"), ("S1 vertebra", "pelvis"),
        ("Left femur", "femur_left"), ("clavicula_right", "clavicle_right"), ("right rib 3", "ribs_right"),
        ("tibia", "lower_leg"), ("heart", None), ("spinal_cord", None), ("costal_cartilages", None),
    ],
)  # fmt: skip
def test_names_of_several_programs_are_understood(name, structure):
    assert structure_of(name) == structure


@pytest.mark.parametrize(
    ("name", "structure"),
    [
        ("left rib 4", "rib_left_4"), ("Left Fourth rib", "rib_left_4"), ("Right Twelfth rib", "rib_right_12"),
        ("rib_left_10", "rib_left_10"), ("left rib", "ribs_left"), ("Left Hip", "pelvis"), ("Sacrum", "pelvis"),
        ("right femur", "femur_right"), ("L5 vertebra", "vertebra_L5"), ("left clavicle", "clavicle_left"),
        ("hyoid bone", "hyoid"), ("lower teeth", "mandible"), ("upper teeth", "skull"),
        ("Entire costal cartilage", None), ("Spinal cord", None), ("Left Iliopsoas muscle", None),
    ],
)  # fmt: skip
def test_the_names_that_slicers_extensions_give_are_understood(name, structure):
    """SlicerTotalSegmentator and SlicerMONAIAuto3DSeg give Slicer's labels of their terms, or SNOMED CT's words."""
    assert structure_of(name, "bones") == structure


def test_numbers_need_a_table():
    with pytest.raises(InputError, match="depends on the table"):
        propose_structures([25])


def test_structures_from_a_label_map():
    labels = blocks()
    found = structures_from_labels(on_ct(labels), {"a": [3], "b": [1, 4]}, ct())
    assert np.array_equal(found.mask("a"), labels == 3)
    assert np.array_equal(found.mask("b"), (labels == 1) | (labels == 4))
    assert found.index("b") == 1
    assert found.labels.dtype == np.int16
    assert np.isclose(found.volume_share().sum(), 1)
    expected = ct().to_world(np.argwhere(labels == 3)[:, ::-1]).mean(0)
    assert np.allclose(found.centroids(ct().affine)[0], expected)


def test_names_of_a_table_stand_for_numbers():
    labels = np.where(blocks() == 1, 75, 77).astype(np.uint8)
    segmentation = Segmentation.from_labels(on_ct(labels))
    found, _ = build_structures(
        segmentation, {"f": ["femur_left"], "p": ["hip_left"]}, ct(), "totalsegmentator_v2"
    )
    assert np.array_equal(found.mask("f"), labels == 75)


def test_another_grid_is_resampled():
    fine = Volume(np.repeat(np.repeat(np.repeat(blocks(), 2, 0), 2, 1), 2, 2), np.diag([0.5, 0.5, 0.5, 1]))
    coarse = Volume(
        np.zeros(SHAPE), np.diag([1, 1, 1, 1.0]) + np.pad(np.full((3, 1), 0.25), ((0, 1), (3, 0)))
    )
    found = structures_from_labels(fine, {"a": [3]}, coarse)
    assert np.array_equal(found.mask("a"), blocks() == 3)


@pytest.mark.parametrize(
    ("groups", "words"),
    [
        ({"a": [9]}, "label 9 .* is not in the image.*choose from 1, 2, 3, 4"),
        ({"a": [1], "b": [2, 1]}, 'lists label 1, which is listed by structure "a" too'),
        ({"a": [1, 1]}, "listed twice"),
        ({"a": []}, "no labels"),
        ({}, "is empty"),
        ({"a": ["hip"]}, "plain label map has no names"),
    ],
)
def test_wrong_groups_are_refused(groups, words):
    with pytest.raises(InputError, match=words):
        structures_from_labels(on_ct(blocks()), groups, ct())


def test_structures_outside_the_ct_are_refused():
    far = Volume(blocks(), np.diag([1, 1, 1, 1.0]) + np.pad(np.full((3, 1), 500.0), ((0, 1), (3, 0))))
    with pytest.raises(InputError, match="outside the CT"):
        structures_from_labels(far, {"a": [1]}, ct())


@pytest.mark.parametrize(("value", "words"), [(-1, "from -1"), (0.5, "whole numbers"), (1e7, "label map")])
def test_images_that_are_no_labels_are_refused(value, words):
    voxels = blocks().astype(np.float32)
    voxels[0, 0, 0] = value
    with pytest.raises(InputError, match=words):
        Segmentation.from_labels(on_ct(voxels))


def test_real_numbers_that_are_whole_are_labels(tmp_path):
    write_volume(on_ct(blocks().astype(np.float32)), tmp_path / "labels.nii.gz")
    found = read_segmentation(tmp_path / "labels.nii.gz")
    assert np.array_equal(found.layers[0].voxels, blocks())
    assert found.labels_present(0).tolist() == [1, 2, 3, 4]


@pytest.mark.parametrize("number", [0, 5])
def test_labels_without_a_layer_are_in_the_only_one(tmp_path, number):
    path = tmp_path / "other.seg.nrrd"
    image = sitk.GetImageFromArray(blocks())
    for n, (name, value) in enumerate((("femur", 1), ("pelvis", 3)), start=number):
        image.SetMetaData(f"Segment{n}_Name", name)
        image.SetMetaData(f"Segment{n}_LabelValue", str(value))
    sitk.WriteImage(image, str(path), True)
    found, _ = build_structures(
        read_segmentation(path), {"f": ["femur"], "p": ["pelvis"]}, Volume(np.zeros(SHAPE), np.eye(4))
    )
    assert np.array_equal(found.mask("f"), blocks() == 1)
    assert np.array_equal(found.mask("p"), blocks() == 3)


def test_seg_nrrd_with_names(tmp_path):
    path = tmp_path / "a.seg.nrrd"
    write_seg(path, [blocks()], [("Segment_1", "left hip", 0, 2), ("Segment_2", "sacrum", 0, 3)])
    segmentation = read_segmentation(path)
    grid = Volume(np.zeros(SHAPE), np.eye(4))
    found, _ = build_structures(segmentation, {"p": ["left hip", "Segment_2"]}, grid)
    assert np.array_equal(found.mask("p"), (blocks() == 2) | (blocks() == 3))
    with pytest.raises(InputError, match='did you mean "left hip"'):
        build_structures(segmentation, {"p": ["left hop"]}, grid)
    numbers, _ = build_structures(segmentation, {"p": [2, 3]}, grid)
    assert np.array_equal(numbers.labels, found.labels)


def test_overlapping_layers_keep_both_segments(tmp_path):
    path = tmp_path / "a.seg.nrrd"
    first, second = np.zeros(SHAPE, np.uint8), np.zeros(SHAPE, np.uint8)
    first[:4], second[4:] = 1, 1
    second[3, 0, :4] = 1
    write_seg(path, [first, second], [("S1", "big", 0, 1), ("S2", "other", 1, 1)])
    segmentation = read_segmentation(path)
    assert segmentation.has_layers
    grid = Volume(np.zeros(SHAPE), np.eye(4))
    found, warnings = build_structures(segmentation, {"a": ["big"], "b": ["other"]}, grid)
    assert any("4 voxels" in warning and '"a" and "b"' in warning for warning in warnings)
    assert found.mask("b").sum() == (second > 0).sum() - 4
    assert found.mask("a").sum() == (first > 0).sum()
    reversed_, _ = build_structures(segmentation, {"b": ["other"], "a": ["big"]}, grid)
    assert np.array_equal(reversed_.mask("a"), found.mask("a"))
    one, _ = build_structures(segmentation, {"a": ["big", "other"]}, grid)
    assert np.array_equal(one.mask("a"), (first | second) > 0)
    with pytest.raises(InputError, match="list segments by name"):
        build_structures(segmentation, {"a": [1]}, grid)


def test_structures_that_overlap_much_are_refused(tmp_path):
    path = tmp_path / "a.seg.nrrd"
    first, second = np.zeros(SHAPE, np.uint8), np.zeros(SHAPE, np.uint8)
    first[:4], second[3:] = 1, 1
    write_seg(path, [first, second], [("S1", "x", 0, 1), ("S2", "y", 1, 1)])
    with pytest.raises(InputError, match=r'"a" and "b" overlap in 90 voxels \(25\.0 % of "a"'):
        build_structures(
            read_segmentation(path), {"a": ["x"], "b": ["y"]}, Volume(np.zeros(SHAPE), np.eye(4))
        )


def test_older_seg_nrrd_has_one_segment_a_layer(tmp_path):
    path = tmp_path / "old.seg.nrrd"
    layers = [(blocks() == n).astype(np.uint8) for n in (1, 2, 3)]
    write_seg(path, layers, [(f"S{n}", f"bone {n}", None, None) for n in (1, 2, 3)])
    segmentation = read_segmentation(path)
    grid = Volume(np.zeros(SHAPE), np.eye(4))
    found, _ = build_structures(segmentation, {"a": ["bone 3"], "b": ["bone 1"]}, grid)
    assert np.array_equal(found.mask("a"), blocks() == 3)


def test_segments_of_one_name_and_empty_segments_are_refused(tmp_path):
    path = tmp_path / "a.seg.nrrd"
    write_seg(path, [blocks()], [("S1", "hip", 0, 2), ("S2", "hip", 0, 3), ("S3", "void", 0, 99)])
    grid = Volume(np.zeros(SHAPE), np.eye(4))
    with pytest.raises(InputError, match="2 segments are named"):
        build_structures(read_segmentation(path), {"a": ["hip"]}, grid)
    with pytest.raises(InputError, match="is empty"):
        build_structures(read_segmentation(path), {"a": ["void"]}, grid)


@pytest.mark.parametrize(
    ("names", "labels", "words"),
    [
        (("a", "a"), blocks() > 0, "name of its own"),
        (("a",), blocks(), "there are 1 names"),
        (("a", "b"), blocks() == 1, '"b" has no voxel'),
        ((), blocks() * 0, "is empty"),
        (("a",), blocks() * 1.0, "whole numbers"),
    ],
)
def test_structures_that_exist_are_valid(names, labels, words):
    labels = labels.astype(np.int16) if labels.dtype == bool else labels
    with pytest.raises(InputError, match=words):
        Structures(names, labels)


def test_the_nearest_name_is_suggested_for_an_unknown_structure():
    found = structures_from_labels(on_ct(blocks()), {"femur_left": [1], "pelvis": [2]}, ct())
    with pytest.raises(InputError, match='did you mean "femur_left"'):
        found.index("femur_lft")
