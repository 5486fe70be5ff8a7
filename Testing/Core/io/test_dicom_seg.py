"""DICOM SEG as segmentations: every kind, on any grid, as other programs write them; damaged ones in one sentence."""

import json

import numpy as np
import pytest
from dicom_stack import write_stack
from pydicom.sequence import Sequence
from pydicom.uid import DeflatedExplicitVRLittleEndian, ExplicitVRLittleEndian, RLELossless
from segment_files import item, random_affine, saved, seg_dataset, text
from small_study import write_small_study

from PolyPoseLib.__main__ import main
from PolyPoseLib.data.study import Study
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.io import dicom_items, dicom_seg
from PolyPoseLib.io.segmentations import read_segmentation
from PolyPoseLib.io.volumes import read_volume

SHAPE = (9, 7, 5)
KINDS = ["BINARY", "FRACTIONAL", "LABELMAP"]


def blobs(rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Two masks without a common voxel, with empty planes between and around."""
    values = rng.random(SHAPE)
    values[[0, 4, 8]] = 0.5
    return {"hip left": values > 0.8, "femur": values < 0.3}


def masks_of(found, grid: Volume) -> dict[str, np.ndarray]:
    return {each.name: found.on_grid(each.layer, grid).voxels == each.label for each in found.segments}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(6))
def test_every_voxel_is_where_the_file_says_on_any_grid(tmp_path, kind, seed):
    rng = np.random.default_rng(seed)
    affine, masks = random_affine(rng, oblique=seed < 4), blobs(rng)
    found = read_segmentation(saved(seg_dataset(masks, affine, kind), tmp_path / "seg.dcm"))
    grid = Volume(np.zeros(SHAPE, np.uint8), affine)
    read = masks_of(found, grid)
    assert list(read) == list(masks)
    assert all(np.array_equal(read[name], masks[name]) for name in masks)
    assert not found.warnings


@pytest.mark.parametrize("kind", ["FRACTIONAL", "LABELMAP"])
def test_compressed_frames_are_read(tmp_path, kind):
    rng = np.random.default_rng(1)
    affine, masks = random_affine(rng), blobs(rng)
    whole = seg_dataset(masks, affine, kind)
    whole.compress(RLELossless, generate_instance_uid=False)
    found = read_segmentation(saved(whole, tmp_path / "seg.dcm"))
    assert np.array_equal(masks_of(found, Volume(np.zeros(SHAPE), affine))["femur"], masks["femur"])


@pytest.mark.parametrize("kind", ["BINARY", "FRACTIONAL", "LABELMAP"])
def test_files_of_an_independent_writer_are_read(tmp_path, kind):
    highdicom = pytest.importorskip("highdicom")
    from highdicom.seg import Segmentation, SegmentDescription
    from pydicom import dcmread
    from pydicom.sr.codedict import codes

    write_stack(tmp_path / "ct", np.zeros(SHAPE, int), axes=(0.6, 0.8, 0, 0, 0, -1))
    slices = [dcmread(each) for each in sorted((tmp_path / "ct").iterdir())]
    for each in slices:
        each.FrameOfReferenceUID, each.StudyInstanceUID = "1.2.3", "1.2.4"
        each.PatientBirthDate = each.PatientSex = each.AccessionNumber = each.StudyID = ""
        each.SliceThickness = 2.5
        each.StudyDate = each.StudyTime = each.ReferringPhysicianName = ""
    slices.sort(key=lambda each: each.InstanceNumber)
    masks = blobs(np.random.default_rng(2))
    names = [
        SegmentDescription(n + 1, name, codes.SCT.Bone, codes.SCT.Bone, "MANUAL")
        for n, name in enumerate(masks)
    ]
    pixels = masks["hip left"] + 2 * masks["femur"].astype(np.uint8)
    if kind == "FRACTIONAL":
        pixels = np.stack([mask * 0.7 for mask in masks.values()], axis=-1)
    whole = Segmentation(
        slices, pixels, kind, names, highdicom.UID(), 1, highdicom.UID(), 1, "maker", "model", "1", "2",
        max_fractional_value=10,
    )  # fmt: skip
    whole.save_as(tmp_path / "seg.dcm")
    read = masks_of(read_segmentation(tmp_path / "seg.dcm"), read_volume(tmp_path / "ct"))
    assert all(np.array_equal(read[name], masks[name]) for name in masks)


def test_overlaps_go_to_the_smaller_segment_with_a_warning(tmp_path):
    large, small = np.zeros(SHAPE, bool), np.zeros(SHAPE, bool)
    large[1:8], small[3:5] = True, True
    small[6, 0, 0] = True
    found = read_segmentation(saved(seg_dataset({"s": small, "l": large}, np.eye(4)), tmp_path / "seg.dcm"))
    read = masks_of(found, Volume(np.zeros(SHAPE), np.eye(4)))
    assert np.array_equal(read["s"], small)
    assert np.array_equal(read["l"], large & ~small)
    assert len(found.warnings) == 1
    assert "in 71 voxels" in found.warnings[0]


def test_segments_that_no_voxel_has_are_known_by_name(tmp_path):
    masks = {**blobs(np.random.default_rng(0)), "absent": np.zeros(SHAPE, bool)}
    found = read_segmentation(saved(seg_dataset(masks, np.eye(4)), tmp_path / "seg.dcm"))
    with pytest.raises(InputError, match="is empty"):
        found.find("absent", "bone")


@pytest.mark.parametrize("stated", [None, 0.5, 77.0])
def test_neighbouring_planes_decide_their_distance(tmp_path, stated):
    masks = {"bone": np.ones(SHAPE, bool)}
    whole = seg_dataset(masks, np.eye(4))
    measures = whole.SharedFunctionalGroupsSequence[0].PixelMeasuresSequence[0]
    del measures.SpacingBetweenSlices
    if stated:
        measures.SpacingBetweenSlices = stated
    found = read_segmentation(saved(whole, tmp_path / "seg.dcm"))
    assert found.layers[0].shape == SHAPE
    assert np.allclose(found.layers[0].affine, np.eye(4))


def study_with(folder, frame, labels_frame="1.2.3", **fields):
    path = write_small_study(folder)
    labels = read_volume(folder / "labels.nii.gz")
    masks = {name: labels.voxels == number for name, number in (("hip_left", 25), ("femur_left", 75))}
    saved(seg_dataset(masks, labels.affine, frame=labels_frame), folder / "seg.dcm")
    ct = read_volume(folder / "ct.nii.gz")
    write_stack(folder / "ct", ct.voxels, step=1.0, positions=[(0, 0, k) for k in range(len(labels.voxels))],
                FrameOfReferenceUID=frame, PixelSpacing=[1, 1])  # fmt: skip
    study = {**json.loads(path.read_text()), "ct": "ct", "segmentation": "seg.dcm", **fields}
    path.write_text(json.dumps(study))
    return path


@pytest.mark.parametrize(
    ("frame", "fields"),
    [
        ("1.2.3", {"structures": {"pelvis": ["hip_left"], "femur": ["femur_left"]}}),
        ("1.2.9", {"structures": {"pelvis": [77], "femur": [75]}, "label_table": "totalsegmentator_v2"}),
    ],
)
def test_studies_name_the_segments_and_hear_of_another_scan(tmp_path, frame, fields):
    study = Study.load(study_with(tmp_path / "s", frame, **fields))
    labels = read_volume(tmp_path / "s" / "labels.nii.gz").voxels
    assert np.array_equal(study.structures.mask("pelvis"), labels == 25)
    assert np.array_equal(study.structures.mask("femur"), labels == 75)
    assert any("another scan" in each for each in study.warnings) == (frame != "1.2.3")


def test_structures_are_proposed_from_names_alone(tmp_path, capsys):
    masks = {"hip_left": np.ones(SHAPE, bool), "femur_left": np.zeros(SHAPE, bool)}
    saved(seg_dataset(masks, np.eye(4)), tmp_path / "seg.dcm")
    assert main(["structures", str(tmp_path / "seg.dcm")]) == 0
    assert json.loads(capsys.readouterr().out)["anchor"] == "pelvis"


def without(whole, *places):
    target = whole
    for place in places[:-1]:
        target = target[place][0] if isinstance(place, str) else target[place]
    delattr(target, places[-1])
    return whole


def moved(whole, number, position):
    group = whole.PerFrameFunctionalGroupsSequence[number]
    group.PlanePositionSequence[0].ImagePositionPatient = text(position)
    return whole


def turned(whole):
    group = whole.PerFrameFunctionalGroupsSequence[2]
    group.PlaneOrientationSequence = Sequence([item(ImageOrientationPatient=[0, 1, 0, 0, 0, 1])])
    return whole


def changed(whole, **tags):
    for tag, value in tags.items():
        setattr(whole, tag, value)
    return whole


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (lambda w: without(w, "PerFrameFunctionalGroupsSequence"), "where it is"),
        (lambda w: changed(w, NumberOfFrames=10**9), "where it is|cut short"),
        (lambda w: changed(w, Rows=60000, Columns=60000), "cut short|too much"),
        (lambda w: changed(w, PixelData=w.PixelData[:10]), "cut short"),
        (lambda w: changed(w, SegmentationType="SURFACE"), "BINARY, FRACTIONAL or LABELMAP"),
        (lambda w: changed(w, SegmentSequence=w.SegmentSequence[:1]), "does not list"),
        (lambda w: changed(w, SegmentSequence=Sequence([])), "0 segments"),
        (lambda w: changed(w, SharedFunctionalGroupsSequence=Sequence([])), "ImageOrientationPatient"),
        (lambda w: moved(w, 1, (0, 0, 9e5)), "unevenly spaced"),
        (lambda w: moved(w, 1, (0, 0, 2.5)), "unevenly spaced"),
        (lambda w: moved(w, 1, (40, 0, 2)), "beside each other"),
        (lambda w: turned(w), "different directions"),
        (lambda w: changed(w, BitsAllocated=32), "1, 8 or 16 bits|cut short"),
    ],
)  # fmt: skip
def test_damaged_segmentations_end_in_one_sentence(tmp_path, damage, words):
    whole = damage(seg_dataset({"bone": np.ones(SHAPE, bool), "more": np.ones(SHAPE, bool)}, np.eye(4)))
    with pytest.raises(InputError, match=words) as found:
        read_segmentation(saved(whole, tmp_path / "seg.dcm"))
    assert "Nobody" not in str(found.value)


def test_files_cut_anywhere_end_in_one_sentence(tmp_path):
    content = saved(
        seg_dataset(blobs(np.random.default_rng(0)), np.eye(4)), tmp_path / "seg.dcm"
    ).read_bytes()
    for at in np.random.default_rng(0).integers(140, len(content) - 2, 25):
        (tmp_path / "cut.dcm").write_bytes(content[:at])
        with pytest.raises(InputError):
            read_segmentation(tmp_path / "cut.dcm")


def test_grids_beyond_the_bound_are_refused_before_they_are_made(tmp_path, monkeypatch):
    monkeypatch.setattr(dicom_seg, "MAX_VOXELS", np.prod(SHAPE) - 1)
    with pytest.raises(InputError, match="too much"):
        read_segmentation(saved(seg_dataset({"a": np.ones(SHAPE, bool)}, np.eye(4)), tmp_path / "seg.dcm"))


@pytest.mark.parametrize("syntax", [ExplicitVRLittleEndian, DeflatedExplicitVRLittleEndian])
def test_files_of_very_many_items_are_refused_before_they_are_parsed(tmp_path, monkeypatch, syntax):
    whole = seg_dataset({"a": np.ones(SHAPE, bool)}, np.eye(4))
    whole.file_meta.TransferSyntaxUID = syntax
    assert read_segmentation(saved(whole, tmp_path / "seg.dcm")).segments
    monkeypatch.setattr(dicom_items, "MAX_ITEMS", 20)
    with pytest.raises(InputError, match="more than 20 items"):
        read_segmentation(tmp_path / "seg.dcm")


def test_names_are_shown_on_one_line_and_never_commanding(tmp_path):
    name = "bone\x1b[31m" + "x" * 500
    found = read_segmentation(
        saved(seg_dataset({name: np.ones(SHAPE, bool)}, np.eye(4)), tmp_path / "seg.dcm")
    )
    assert found.segments[0].name.isprintable()
    assert len(found.segments[0].name) <= 210
