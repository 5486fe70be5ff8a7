"""Segments are named as the study names them, whatever its segmentation is, and coded where DICOM has a code."""

import json

import numpy as np
import pydicom
import pytest
from dicom_case import write_dicom_case
from segment_files import saved, seg_dataset

from PolyPoseLib.data.segmentation import Segment as NamedSegment
from PolyPoseLib.data.segmentation import Segmentation
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.io.dicom_export.export import export_dicom
from PolyPoseLib.io.dicom_export.inputs import label_names
from PolyPoseLib.io.dicom_export.segment_codes import BONE, TISSUE, segment_code
from PolyPoseLib.io.dicom_export.segmentation import segments_present
from PolyPoseLib.io.volumes import read_volume

LABELS = Volume(np.array([[[0, 1, 2, 3]]], np.uint8), np.eye(4))


def test_names_come_from_segments_then_the_table_then_structures():
    plain = Segmentation.from_labels(LABELS)
    groups = {"pelvis": [1, 2], "femur": [3]}
    assert label_names(plain, groups, None) == ({1: "pelvis 1", 2: "pelvis 2", 3: "femur"}, {1, 2, 3})
    names, bones = label_names(plain, groups, "totalsegmentator_v2")
    assert (names[1], names[3], names[75], bones) == ("spleen", "kidney_left", "femur_left", {1, 2, 3})
    named = Segmentation(
        (LABELS,), (NamedSegment("S1", "ilium", 0, 1), NamedSegment("S2", "thigh", 0, 3)), numbered=False
    )
    names, bones = label_names(named, {"pelvis": ["ilium"], "femur": ["S2"], "tibia": ["absent"]}, None)
    assert (names, bones) == ({1: "ilium", 3: "thigh"}, {1, 3})


def test_every_label_that_is_present_has_a_name_of_its_own():
    names = {1: "same\\name", 2: "same\\name", 3: "n" * 100}
    found = segments_present(LABELS, names, {2})
    assert [each.label for each in found] == [1, 2, 3]
    assert [each.is_bone for each in found] == [False, True, False]
    assert len({each.name for each in found}) == 3
    assert all(len(each.name) <= 64 and "\\" not in each.name for each in found)
    assert [each.name for each in segments_present(LABELS, {}, ())] == ["label 1", "label 2", "label 3"]


@pytest.mark.parametrize(
    ("name", "meaning", "side"),
    [
        ("femur_left", "Femur", "Left"),
        ("vertebrae_L5", "L5 vertebra", None),
        ("rib_right_4", "Rib", "Right"),
        ("Fourth rib", "Rib", None),
        ("sacrum", "Sacrum", None),
        ("liver", "Liver", None),
        ("left hip bone", "Bone", "Left"),
        ("lesion 3", "Tissue", None),
        ("", "Tissue", None),
    ],
)
def test_codes(name, meaning, side):
    code = segment_code(name, is_bone=False)
    assert code.kind[2] == meaning
    assert (code.side and code.side[2]) == side
    assert segment_code("lesion 3", is_bone=True).kind == BONE != TISSUE


def test_segments_of_a_dicom_segmentation_keep_their_names(tmp_path):
    case = write_dicom_case(tmp_path / "case")
    ct = read_volume(case.ct_folder)
    labels = read_volume(tmp_path / "case/labels.nii.gz").voxels
    masks = {"Hüfte": labels == 25, "Oberschenkel": labels == 75}
    saved(seg_dataset(masks, ct.affine, SpecificCharacterSet="ISO_IR 192"), tmp_path / "case/seg.dcm")
    fields = json.loads(case.study.read_text())
    del fields["label_table"]
    groups = {"pelvis": ["Hüfte"], "femur_left": ["Oberschenkel"]}
    case.study.write_text(json.dumps({**fields, "segmentation": "seg.dcm", "structures": groups}))
    warped = case.result.warped_labels.voxels
    renumbered = np.where(warped == 25, 1, np.where(warped == 75, 2, 0)).astype(np.uint8)
    case.result.warped_labels = Volume(renumbered, case.result.warped_labels.affine)
    folder = export_dicom(case.result, case.study, tmp_path / "dicom")
    whole = pydicom.dcmread(folder / "segmentation.dcm")
    assert {each.SegmentLabel for each in whole.SegmentSequence} == {"Hüfte", "Oberschenkel"}
    assert all(
        each.SegmentedPropertyTypeCodeSequence[0].CodeMeaning == "Bone" for each in whole.SegmentSequence
    )


def test_without_any_label_there_is_no_segmentation(tmp_path, caplog):
    case = write_dicom_case(tmp_path / "case")
    labels = case.result.warped_labels
    case.result.warped_labels = labels.with_voxels(np.zeros_like(labels.voxels))
    folder = export_dicom(case.result, case.study, tmp_path / "dicom")
    assert not (folder / "segmentation.dcm").exists() and not (folder / "contours.dcm").exists()
    assert "no segments and no contours" in caplog.text
