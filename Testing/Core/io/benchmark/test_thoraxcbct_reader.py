"""ThoraxCBCT: a replica of Learn2Reg's layout, read end to end."""

import json
import re

import numpy as np
import pytest
import SimpleITK as sitk
from scored_case import field_of
from two_postures import (
    C5,
    C5_MOTION,
    MARKER,
    dice_of,
    grids,
    moved,
    pixel_of,
    plain_rendering,
    scan,
    spot,
    write_image,
)

from PolyPoseLib.data.benchmark.system import Motion
from PolyPoseLib.errors import InputError
from PolyPoseLib.evaluation.benchmark.scores import score_case
from PolyPoseLib.io.benchmark import thoraxcbct

_ = plain_rendering
T4, T5, LIVER, RIB = 36, 37, 5, 95
RENUMBERED = {91: T4, C5: RIB, 79: 0, 16: LIVER}  # the same solids, under names of a thorax


def _write(root, patient, later=1, labels=True, fields=None):
    """A patient's planning CT and one CBCT, with labels as a user makes them."""
    for which, (is_second, affine) in zip((0, later), zip((False, True), grids(), strict=True), strict=True):
        hu, numbers = scan(is_second, affine)
        name = f"ThoraxCBCT_{patient:04d}_{which:04d}.nii.gz"
        write_image(hu, affine, root / "imagesTr" / name)
        if labels:
            table = np.arange(256, dtype=np.uint8)
            for old, new in RENUMBERED.items():
                table[old] = new
            write_image(table[numbers], affine, root / "labelsTr" / name)
    pairs = [
        {
            "fixed": f"./imagesTr/ThoraxCBCT_{patient:04d}_{later:04d}.nii.gz",
            "moving": f"./imagesTr/ThoraxCBCT_{patient:04d}_0000.nii.gz",
        }
    ]
    record = {"name": "ThoraxCBCT", "labels": {}, "training_paired_images": pairs, "registration_val": []}
    (root / "ThoraxCBCT_dataset.json").write_text(json.dumps({**record, **(fields or {})}))
    return root


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    return _write(tmp_path_factory.mktemp("thorax"), 3, later=2)


@pytest.fixture(scope="module")
def case(root):
    (found,) = thoraxcbct.cases(root, "0003-2", ["2x180"])
    return found


def test_a_pair_is_a_case_of_its_patient_and_says_what_it_is(root, case):
    """Two CBCTs of one patient are no two independent subjects."""
    assert thoraxcbct.subjects(root) == ["0003-2"]
    assert (case.subject, case.views) == thoraxcbct.row_names("0003-2", "2x180") == ("0003", "2x180")
    assert (case.name, case.views, case.study.anchor) == ("0003-2-2x180", "2x180", "thoracic_spine")
    assert dict(case.labels) == {"thoracic_spine": (T4,), "rib_left_4": (RIB,), "liver": (LIVER,)}
    assert set(case.groups) == {"bones", "soft organs"}


def test_x_rays_are_of_the_cbct_in_the_planning_cts_world(case):
    assert case.study.ct.voxels.max() < 1000 < case.truth.ct.voxels.max()
    for xray, camera in zip(case.study.xrays, case.truth.cameras, strict=True):
        expected = pixel_of(camera, MARKER)
        assert np.abs(spot(xray.image, expected) - expected).max() < 0.7
    assert dice_of(case, (RIB,), np.eye(4)) < 0.7 < 0.9 < dice_of(case, (RIB,), np.linalg.inv(C5_MOTION))


@pytest.mark.long
def test_the_jsons_own_labels_win_over_totalsegmentators(tmp_path):
    names = {"0": {"36": "T4", "95": "Left Rib 4", "5": "Oesophagus"}}
    root = _write(tmp_path, 1, fields={"labels": names})
    (case,) = thoraxcbct.cases(root, "0001-1", ["1x0"])
    assert "esophagus" in case.labels and "liver" not in case.labels


def _refusal(root):
    with pytest.raises(InputError) as caught:
        for subject in thoraxcbct.subjects(root):
            list(thoraxcbct.cases(root, subject, ["1x0"]))
    return str(caught.value)


def test_a_partial_copy_is_told(tmp_path):
    assert "imagesTr" in _refusal(tmp_path)
    (tmp_path / "imagesTr").mkdir()
    assert "no pair" in _refusal(tmp_path)
    root = _write(tmp_path, 1, labels=False)
    said = _refusal(root)
    assert "labelsTr" in said and "TotalSegmentator" in said
    (root / "imagesTr" / "ThoraxCBCT_0001_0000.nii.gz").unlink()
    assert re.search(r"0001_0000.nii.gz is missing", _refusal(root))
    (root / "ThoraxCBCT_dataset.json").write_text("{")
    assert "damaged" in _refusal(root)


def test_the_releases_own_labels_are_told_from_ones_of_bones_and_left_alone(tmp_path):
    """Only some patients of the release of 2023 have them; whoever saved others beside them would overwrite these."""
    root = _write(tmp_path, 11)
    for path in (root / "labelsTr").iterdir():
        image = sitk.ReadImage(str(path))
        values = sitk.GetArrayFromImage(image)
        plain = sitk.GetImageFromArray((np.indices(values.shape).sum(axis=0) % 14).astype(np.uint8))
        plain.CopyInformation(image)
        sitk.WriteImage(plain, str(path))
    before = {path: path.read_bytes() for path in (root / "labelsTr").iterdir()}
    said = _refusal(root)
    assert (
        "name no bone" in said and "ThoraxCBCT_OncoRegRelease_06_12_23" in said and "move or rename" in said
    )
    assert {path: path.read_bytes() for path in (root / "labelsTr").iterdir()} == before


def test_paths_in_the_json_lead_nowhere_else(tmp_path):
    """Only the names of images count; links out of the folder are refused."""
    root = _write(tmp_path / "data", 1)
    outside = tmp_path / "outside.nii.gz"
    (root / "imagesTr" / "ThoraxCBCT_0001_0001.nii.gz").rename(outside)
    pairs = [{"fixed": "../../outside.nii.gz", "moving": "/etc/passwd"}]
    (root / "ThoraxCBCT_dataset.json").write_text(json.dumps({"training_paired_images": pairs}))
    assert "no pair" in _refusal(root)
    (root / "imagesTr" / "ThoraxCBCT_0001_0001.nii.gz").symlink_to(outside)
    (root / "ThoraxCBCT_dataset.json").unlink()
    assert "leads out of" in _refusal(root)
    (root / "imagesTr").rename(tmp_path / "imagesTr")
    (root / "imagesTr").symlink_to(tmp_path / "imagesTr")
    assert "imagesTr: it leads out of" in _refusal(root)


@pytest.mark.long
def test_a_structure_that_the_planning_ct_cuts_off_is_scored_where_it_is_known(tmp_path):
    """It goes on in the later scan below the end of the first: nobody could find that part."""
    root = _write(tmp_path, 1)
    first, _ = grids()
    short = first.copy()
    short[:3, 3] += first[:3, 2] * 17  # the first 17 slices are missing
    hu, numbers = scan(False, short, (51, 56, 60))
    table = np.arange(256, dtype=np.uint8)
    for old, new in RENUMBERED.items():
        table[old] = new
    write_image(hu, short, root / "imagesTr" / "ThoraxCBCT_0001_0000.nii.gz")
    write_image(table[numbers], short, root / "labelsTr" / "ThoraxCBCT_0001_0000.nii.gz")
    (case,) = thoraxcbct.cases(root, "0001-1", ["1x0"])
    truth = case.truth.labels
    points = truth.to_world(np.argwhere(truth.voxels == LIVER)[:, ::-1])
    lowest = moved(short, np.zeros(3))[2]
    assert points[:, 2].min() > lowest + 8 and points[:, 2].max() > lowest + 20
    scores = score_case(case, Motion(field_of(np.eye(4))), minimum_mm2=20)
    assert scores["structures"]["liver"]["dice"] > 0.85 and scores["structures"]["liver"]["hd95_mm"] < 4
    assert scores["held_out"]["structures"]["liver"]["dice"] > 0.85


def test_labels_without_a_common_bone_are_told_with_their_file(tmp_path):
    root = _write(tmp_path, 3)
    labels = root / "labelsTr/ThoraxCBCT_0003_0001.nii.gz"
    image = sitk.ReadImage(str(labels))
    sitk.WriteImage(image * (image == LIVER), str(labels))
    with pytest.raises(
        InputError, match=r"ThoraxCBCT_0003_0001\.nii\.gz: the two scans have no bone in common"
    ):
        list(thoraxcbct.cases(root, "0003-1", ["2x30"]))
