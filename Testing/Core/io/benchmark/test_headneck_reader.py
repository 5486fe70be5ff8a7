"""Head&Neck: a replica of both layouts, written by SimpleITK and pydicom, read end to end."""

import os
import re
import shutil
from pathlib import Path

import numpy as np
import pydicom
import pytest
from dicom_postures import write_dicom
from pydicom.uid import generate_uid
from two_postures import (
    C5,
    C5_CENTRE,
    C5_MOTION,
    MARKER,
    REPOSITIONED,
    SKULL,
    TRACHEA,
    dice_of,
    grids,
    moved,
    pixel_of,
    plain_rendering,
    scan,
    spot,
    write_image,
)

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.benchmark import headneck
from PolyPoseLib.io.benchmark.dicom_patient import dicom_scans

_ = plain_rendering


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    root = tmp_path_factory.mktemp("headneck")
    for number, (is_second, affine) in enumerate(zip((False, True), grids(), strict=True), start=1):
        hu, labels = scan(is_second, affine)
        write_image(hu, affine, root / "HN_P007" / f"ct_{number}.nii.gz")
        write_image(labels, affine, root / "HN_P007" / f"labels_{number}.nii.gz")
    return root


@pytest.fixture(scope="module")
def case(root):
    (found,) = headneck.cases(root, "HN_P007", ["2x30"])
    return found


def test_a_case_says_what_it_is(root, case):
    assert headneck.subjects(root) == ["HN_P007"]
    assert (case.name, case.dataset, case.subject, case.views) == (
        "HN_P007-2x30",
        "headneck",
        "HN_P007",
        "2x30",
    )
    assert case.study.anchor == "skull" and set(case.study.structures.names) == {"skull", "vertebra_C5"}
    assert dict(case.labels) == {"skull": (SKULL,), "vertebra_C5": (C5,), "trachea": (TRACHEA,)}
    assert dict(case.groups) == {"bones": ("vertebra_C5", "skull"), "soft organs": ("trachea",)}
    assert all(xray.camera == "known" for xray in case.study.xrays)
    axes = [camera.axis for camera in case.truth.cameras]
    assert np.degrees(np.arccos(axes[0] @ axes[1])) == pytest.approx(30)


def test_the_marker_of_the_later_scan_appears_where_the_camera_says(case):
    """The X-rays are of the second CT and the cameras are stated in the first one's world."""
    for xray, camera in zip(case.study.xrays, case.truth.cameras, strict=True):
        assert np.allclose(xray.extrinsic, camera.extrinsic) and np.allclose(
            xray.intrinsics, camera.intrinsics
        )
        expected = pixel_of(camera, MARKER)
        assert np.abs(spot(xray.image, expected) - expected).max() < 0.7


def test_the_repositioning_is_taken_out(case):
    """The truth lies in the first scan's world within the labels' own accuracy (voxels of 3 to 3.6 mm)."""
    expected = np.linalg.inv(REPOSITIONED) @ grids()[1]
    skull = np.argwhere(case.truth.labels.voxels == SKULL)[::9, ::-1].astype(float)
    corners = np.stack(np.meshgrid(*[(0, 55)] * 3), axis=-1).reshape(-1, 3).astype(float)
    for points, most in ((skull, 0.9), (corners, 2.5)):
        error = moved(case.truth.labels.affine, points) - moved(expected, points)
        assert np.linalg.norm(error, axis=1).max() < most
    assert case.truth.ct.affine == pytest.approx(case.truth.labels.affine)
    told = " ".join(case.study.warnings)
    degrees = float(re.search(r"and ([0-9.]+) degrees", told)[1])
    residual = float(re.search(r"distance of ([0-9.]+) mm", told)[1])
    assert degrees == pytest.approx(9.0, abs=0.7) and residual < 1.0
    assert "poorly" not in told


def test_rest_is_wrong_for_what_moved_and_the_truth_is_right(case):
    to_moving = np.linalg.inv(C5_MOTION)
    assert dice_of(case, (C5,), np.eye(4)) < 0.7
    assert dice_of(case, (C5,), to_moving) > 0.9
    assert dice_of(case, (C5,), C5_MOTION) < 0.5
    assert dice_of(case, (SKULL,), np.eye(4)) > 0.95


def test_held_out_masks_show_the_moved_bone(case):
    views = case.truth.held_out
    assert len(views) == 5 and len({view.name for view in views}) == 5
    centre = moved(C5_MOTION, C5_CENTRE)
    for view in views:
        mask = view.masks["vertebra_C5"]
        rows, columns = np.nonzero(mask)
        box = np.array([(columns.min() + columns.max()) / 2, (rows.min() + rows.max()) / 2])
        at = pixel_of(view.camera, centre)
        assert mask[tuple(np.rint(at[::-1]).astype(int))]
        assert np.abs(box - at).max() < 3
        assert set(view.masks) == {"skull", "vertebra_C5", "trachea"}
        for other in case.truth.cameras:
            # Neither a given view nor the mirror image of one.
            assert np.degrees(np.arccos(min(abs(view.camera.axis @ other.axis), 1.0))) > 3


@pytest.mark.long
def test_cases_come_one_at_a_time(root, monkeypatch):
    """The second set of views is rendered when it is asked for, and the scans are read once."""
    from PolyPoseLib.io.benchmark import two_scans

    rendered = []
    honest = two_scans.project
    monkeypatch.setattr(two_scans, "project", lambda *given: rendered.append(1) or honest(*given))
    found = headneck.cases(root, "HN_P007", ["1x0", "2x180"])
    assert next(found).views == "1x0" and len(rendered) == 1
    assert next(found).views == "2x180" and len(rendered) == 3


NAMES = {"Skull": SKULL, "C5": C5, "Trachea": TRACHEA}


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    """The later study's folder sorts first, and the patient's folder carries a name."""
    root = tmp_path_factory.mktemp("archive")
    write_dicom(root / "Miller_Anna", True, "20100301", NAMES)
    write_dicom(root / "Miller_Anna", False, "20091022", NAMES)
    return root


def test_dicom_with_structure_sets_is_read_in_the_order_of_its_dates(archive, caplog):
    (subject,) = headneck.subjects(archive)
    assert "miller" not in subject.lower() and len(subject) > 6
    (case,) = headneck.cases(archive, subject, ["2x180"])
    assert set(case.study.structures.names) == {"skull", "vertebra_C5"} and "trachea" in case.labels
    said = f"{case.name} {case.study.warnings} {caplog.text}".lower()
    assert "miller" not in said and "anna" not in said
    # The marker is in the later scan only.
    assert case.study.ct.voxels.max() < 1000 < case.truth.ct.voxels.max()
    for xray, camera in zip(case.study.xrays, case.truth.cameras, strict=True):
        expected = pixel_of(camera, MARKER)
        assert np.abs(spot(xray.image, expected) - expected).max() < 1.0
    number = case.labels["vertebra_C5"]
    assert dice_of(case, number, np.eye(4)) < 0.75 < 0.85 < dice_of(case, number, np.linalg.inv(C5_MOTION))


def _one(tmp_path, labels="plain", **kept):
    affine = grids()[0]
    hu, numbers = scan(False, affine)
    folder = tmp_path / "HN_P001"
    for number in kept.get("scans", (1, 2)):
        write_image(hu, affine, folder / f"ct_{number}.nii.gz")
        if labels == "plain":
            write_image(numbers, affine, folder / f"labels_{number}.nii.gz")
    return folder, numbers, affine


def _refusal(root):
    with pytest.raises(InputError) as caught:
        list(headneck.cases(root, headneck.subjects(root)[0], ["2x30"]))
    return str(caught.value)


def test_an_empty_folder_is_told_where_the_data_are_to_be_had(tmp_path):
    for place in (tmp_path, tmp_path / "missing"):
        with pytest.raises(InputError, match=r"Cancer Imaging Archive"):
            headneck.subjects(place)


@pytest.mark.parametrize(
    "above", ["HNSCC-3DCT-RT", "manifest-1578/HNSCC-3DCT-RT", "a/manifest-1/HNSCC-3DCT-RT"]
)
@pytest.mark.parametrize("kind", ["nifti", "dicom"])
def test_a_folder_above_the_collection_is_told_which_one_to_give(tmp_path, kind, above):
    """The collection was taken for one patient, and its name was hashed."""
    for name in ("HN_P001", "HN_P002"):
        folder = tmp_path / above / name
        folder = folder if kind == "nifti" else folder / "10-22-2009-NA-NA-1" / "2.000000-CT-1"
        folder.mkdir(parents=True)
        (folder / ("ct_1.nii.gz" if kind == "nifti" else "1-001.dcm")).touch()
    (tmp_path / "metadata.csv").touch()
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError) as refused:
        headneck.subjects(tmp_path)
    where = Path(above)
    assert f"lie in {where}, deeper than they should: give {tmp_path / where}." in str(refused.value)
    assert headneck.subjects(tmp_path / where) == ["HN_P001", "HN_P002"]


def test_a_collection_beside_patients_is_no_patient(tmp_path):
    for name in ("HN_P001", "old/HN_P001"):
        (tmp_path / name).mkdir(parents=True)
        (tmp_path / name / "ct_1.nii.gz").touch()
    with pytest.raises(InputError, match=r"lie in old, deeper"):
        headneck.subjects(tmp_path)


def test_files_of_two_patients_in_one_folder_are_refused_without_a_name(archive, tmp_path):
    shutil.copytree(archive, tmp_path / "data")
    for path in (tmp_path / "data").glob("*/20100301*/*/*.dcm"):
        file = pydicom.dcmread(path)
        file.PatientID = "0815"
        file.save_as(path)
    with pytest.raises(InputError, match="its DICOM files are of 2 patients by their PatientID") as refused:
        dicom_scans(tmp_path / "data/Miller_Anna", tmp_path / "data")
    assert not any(each in str(refused.value) for each in ("4711", "0815"))
    for path in (tmp_path / "data").glob("*/20100301*/*/*.dcm"):
        file = pydicom.dcmread(path)
        file.PatientID = ""
        file.save_as(path)
    assert len(dicom_scans(tmp_path / "data/Miller_Anna", tmp_path / "data")) == 2


def test_one_scan_is_not_enough(tmp_path):
    _one(tmp_path, scans=(1,))
    assert "two of different days" in _refusal(tmp_path)


def test_the_highest_number_is_the_latest_ct_even_where_one_is_missing(tmp_path):
    _one(tmp_path, scans=(1, 2, 4))
    affine = grids()[0]
    hu, _ = scan(True, affine)
    write_image(hu, affine, tmp_path / "HN_P001" / "ct_4.nii.gz")
    (case,) = headneck.cases(tmp_path, "HN_P001", ["1x0"])
    assert case.study.ct.voxels.max() < 1000 < case.truth.ct.voxels.max()  # the marker is in the fourth alone


def test_a_patient_without_the_first_ct_is_listed_and_says_so(tmp_path):
    _one(tmp_path, scans=(2, 3))
    assert headneck.subjects(tmp_path) == ["HN_P001"]
    (case,) = headneck.cases(tmp_path, "HN_P001", ["1x0"])
    assert any("no ct_1" in each and "ct_2" in each for each in case.study.warnings)


def test_missing_labels_are_named_with_the_fix(tmp_path):
    folder, _, _ = _one(tmp_path)
    (folder / "labels_2.nii.gz").unlink()
    said = _refusal(tmp_path)
    assert "labels_2.nii.gz" in said and "TotalSegmentator" in said


def test_a_structure_set_that_cannot_be_read_is_no_reason_to_look_for_missing_files_only(archive, tmp_path):
    root = tmp_path / "copy"
    shutil.copytree(archive, root)
    (drawn,) = root.glob("*/20100301*/1.000000-Structures/1-1.dcm")
    drawn.write_bytes(drawn.read_bytes()[:200])
    (subject,) = headneck.subjects(root)
    with pytest.raises(
        InputError, match=r"labels_2\.nii\.gz, nor is there a structure set drawn on it that can be"
    ):
        list(headneck.cases(root, subject, ["2x180"]))


def test_labels_of_another_scan_are_refused(tmp_path):
    folder, numbers, affine = _one(tmp_path)
    elsewhere = affine.copy()
    elsewhere[:3, 3] += [150, 0, 0]
    write_image(numbers, elsewhere, folder / "labels_1.nii.gz")
    assert "another grid" in _refusal(tmp_path)


def test_scans_in_metres_are_refused(tmp_path):
    folder, _, affine = _one(tmp_path)
    hu, _ = scan(False, affine)
    tiny = affine.copy()
    tiny[:3] *= 1e-3
    write_image(hu, tiny, folder / "ct_1.nii.gz")
    assert "millimetres" in _refusal(tmp_path)


def test_links_out_of_the_folder_are_refused(tmp_path):
    folder, _, _ = _one(tmp_path / "data")
    outside = tmp_path / "outside.nii.gz"
    (folder / "ct_2.nii.gz").rename(outside)
    (folder / "ct_2.nii.gz").symlink_to(outside)
    assert "leads out of the data set's folder" in _refusal(tmp_path / "data")


def test_a_patients_folder_that_lies_elsewhere_is_refused_before_it_is_looked_into(tmp_path, monkeypatch):
    _one(tmp_path / "data")
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "data/HN_P008").symlink_to(tmp_path / "elsewhere")
    looked = []
    listed = os.scandir
    monkeypatch.setattr(os, "scandir", lambda folder: (looked.append(Path(folder).name), listed(folder))[1])
    with pytest.raises(InputError, match="HN_P008: it leads out of the data set's folder"):
        headneck.subjects(tmp_path / "data")
    assert looked == ["data"]


@pytest.mark.long
def test_another_patients_later_scan_is_refused(tmp_path):
    """Its skull has another shape, so no rigid motion brings the two together."""
    folder, numbers, affine = _one(tmp_path)
    longer = np.where(numbers == SKULL, 0, numbers)
    k, j, i = np.indices(numbers.shape)
    longer[(np.abs(k - 40) < 22) & (np.abs(j - 28) < 6) & (np.abs(i - 30) < 6)] = SKULL
    write_image(longer, affine, folder / "labels_2.nii.gz")
    assert "one patient" in _refusal(tmp_path)


def test_a_ct_whose_slices_lie_in_two_folders_is_refused(archive, tmp_path):
    """Half of its slices would be a shorter CT."""
    shutil.copytree(archive, tmp_path / "data")
    place = next((tmp_path / "data").rglob("2.000000-CT"))
    (place / "more").mkdir()
    slices = sorted(place.glob("*.dcm"))
    for each in slices[len(slices) // 2 :]:
        each.rename(place / "more" / each.name)
    with pytest.raises(InputError, match="the slices of one CT lie in 2 folders"):
        dicom_scans(tmp_path / "data/Miller_Anna", tmp_path / "data")


def test_a_choice_of_series_is_among_the_warnings_of_the_case(archive, tmp_path):
    root = tmp_path / "copy"
    shutil.copytree(archive, root)
    (place,) = root.glob("*/20100301*/2.000000-CT")
    other = shutil.copytree(place, place.parent / "3.000000-CT")
    uid = generate_uid()
    for path in other.iterdir():
        file = pydicom.dcmread(path)
        file.SeriesInstanceUID, file.SeriesNumber = uid, 3
        file.save_as(path)
    (subject,) = headneck.subjects(root)
    (case,) = headneck.cases(root, subject, ["1x0"])
    assert any("later scan: " in each and "series 2 was taken" in each for each in case.study.warnings)
