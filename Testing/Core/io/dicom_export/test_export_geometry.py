"""Exported objects lie where they should, as others see them: GDCM, the standard's formulas, plastimatch, dcmqi."""

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pydicom
import pytest
import SimpleITK as sitk
from dicom_case import write_dicom_case
from standard_registrations import registered_to_source, source_to_registered

from PolyPoseLib.io.dicom_export.export import export_dicom
from PolyPoseLib.io.segmentations import read_segmentation

CASES = [(0, False), (1, True), (2, False), (3, True)]


@pytest.fixture(
    scope="module", params=CASES, ids=lambda each: f"seed{each[0]}-{'left' if each[1] else 'right'}"
)
def exported(request, tmp_path_factory):
    """(case, folder of the export)."""
    folder = tmp_path_factory.mktemp("export")
    seed, left_handed = request.param
    case = write_dicom_case(folder / "case", seed, left_handed)
    return case, export_dicom(case.result, case.study, folder / "dicom")


def gdcm_series(folder: Path) -> sitk.Image:
    """The one series of a folder, as SimpleITK's GDCM orders it."""
    reader = sitk.ImageSeriesReader()
    (uid,) = reader.GetGDCMSeriesIDs(str(folder))
    reader.SetFileNames(reader.GetGDCMSeriesFileNames(str(folder), uid))
    return reader.Execute()


def at(image: sitk.Image, points: np.ndarray, how=sitk.sitkLinear) -> np.ndarray:
    """Values at points (N, 3), LPS mm."""
    image = sitk.Cast(image, sitk.sitkFloat64)
    return np.array([image.EvaluateAtPhysicalPoint(each, how) for each in points.tolist()])


def points_within(image: sitk.Image, count: int, margin: int, seed: int) -> np.ndarray:
    """Voxels' centres (N, 3) at random, no nearer to the border than the margin."""
    size = np.array(image.GetSize())
    index = np.random.default_rng(seed).integers(margin, size - margin, (count, 3))
    return np.array([image.TransformIndexToPhysicalPoint(each) for each in index.tolist()])


def is_within(image: sitk.Image, points: np.ndarray) -> np.ndarray:
    """Whether points (N, 3) lie between an image's voxels, and not beside the outermost."""
    index = np.array([image.TransformPhysicalPointToContinuousIndex(each) for each in points.tolist()])
    return ((index > 1) & (index < np.array(image.GetSize()) - 2)).all(axis=1)


def frames_of(case, folder: Path) -> tuple[str, str]:
    """Frames of reference of the CT and of the warped CT."""
    source, warped = (next(each.glob("*.dcm")) for each in (case.ct_folder, folder / "ct"))
    return tuple(str(pydicom.dcmread(each).FrameOfReferenceUID) for each in (source, warped))


def test_the_warped_series_is_the_results_ct(exported):
    case, folder = exported
    read, warped = gdcm_series(folder / "ct"), case.result.warped_ct
    points = np.array([read.TransformIndexToPhysicalPoint(each) for each in np.ndindex(*read.GetSize())])
    index = np.rint(warped.to_index(points)).astype(int)
    assert np.abs(warped.to_world(index) - points).max() < 1e-5
    expected = np.rint(warped.voxels[index[:, 2], index[:, 1], index[:, 0]])
    stored = sitk.GetArrayFromImage(read).transpose(2, 1, 0).ravel()
    assert len(np.unique(index, axis=0)) == warped.voxels.size
    assert np.array_equal(stored, expected)
    assert expected.std() > 50


def test_the_warped_slices_lie_as_the_cts_do(exported):
    case, folder = exported
    taken = ("ImageOrientationPatient", "ImagePositionPatient", "PixelSpacing", "Rows", "Columns")

    def planes(files):
        read = sorted(map(pydicom.dcmread, files), key=lambda each: each.InstanceNumber)
        return [[np.ravel(each[name].value).astype(float) for name in taken] for each in read]

    ours, theirs = planes((folder / "ct").iterdir()), planes(case.ct_folder.iterdir())
    assert len(ours) == len(theirs)
    for one, other in zip(ours, theirs, strict=True):
        assert all(np.abs(a - b).max() < 2e-6 for a, b in zip(one, other, strict=True))
    grid = pydicom.dcmread(folder / "deformation.dcm").DeformableRegistrationSequence[0]
    turned = grid.DeformableRegistrationGridSequence[0].ImageOrientationPatient
    assert np.abs(np.array(turned, float) - ours[0][0]).max() < 1e-6


def test_the_deformation_leads_from_the_warped_series_to_the_ct(exported):
    case, folder = exported
    whole = pydicom.dcmread(folder / "deformation.dcm")
    source, warped = frames_of(case, folder)
    ct, carried = gdcm_series(case.ct_folder), gdcm_series(folder / "ct")
    points = points_within(carried, 200, 1, 0)
    led = registered_to_source(whole, source, points)
    assert np.abs(led - case.formula(points)).max() < 0.02
    assert np.linalg.norm(led - points, axis=1).mean() > 1.0
    opposite = 2 * points - led
    inside = is_within(ct, led) & is_within(ct, opposite)
    assert inside.sum() > 30
    here = at(carried, points[inside])
    assert np.abs(at(ct, led[inside]) - here).max() < 6  # HU, of which 0.5 are rounded
    assert np.abs(at(ct, opposite[inside]) - here).mean() > 30
    assert whole.FrameOfReferenceUID == warped != source


def test_each_bone_maps_the_ct_to_the_patient_as_xrayed(exported):
    case, folder = exported
    source, warped = frames_of(case, folder)
    files = sorted((folder / "bones").iterdir())
    assert [each.name for each in files] == ["01_pelvis.dcm", "02_femur_left.dcm"]
    points = points_within(gdcm_series(case.ct_folder), 50, 0, 1)
    for file, structure in zip(files, case.result.structures.values(), strict=True):
        whole = pydicom.dcmread(file)
        carried = source_to_registered(whole, source, points)
        pose = structure.fixed_to_moving
        assert np.abs(carried @ pose[:3, :3].T + pose[:3, 3] - points).max() < 1e-9
        assert np.array_equal(source_to_registered(whole, warped, points), points)
        assert whole.FrameOfReferenceUID == warped
    assert np.linalg.norm(carried - points, axis=1).min() > 0.5


def test_every_object_names_the_frames_of_its_images(exported):
    case, folder = exported
    source, warped = frames_of(case, folder)
    assert source != warped
    images = {each.SOPInstanceUID: each for each in map(pydicom.dcmread, case.ct_folder.iterdir())}
    images |= {each.SOPInstanceUID: each for each in map(pydicom.dcmread, (folder / "ct").iterdir())}
    whole = pydicom.dcmread(folder / "bones/02_femur_left.dcm")
    for item in whole.RegistrationSequence:
        named = {
            images[each.ReferencedSOPInstanceUID].FrameOfReferenceUID for each in item.ReferencedImageSequence
        }
        assert named == {item.FrameOfReferenceUID}
        assert len(item.ReferencedImageSequence) == len(images) / 2
    assert {each.FrameOfReferenceUID for each in whole.RegistrationSequence} == {source, warped}
    assert pydicom.dcmread(folder / "segmentation.dcm").FrameOfReferenceUID == warped


def test_a_warped_slice_names_the_slices_that_it_comes_from(exported):
    case, folder = exported
    places = {}
    for each in map(pydicom.dcmread, case.ct_folder.iterdir()):
        normal = np.cross(each.ImageOrientationPatient[:3], each.ImageOrientationPatient[3:])
        places[each.SOPInstanceUID] = float(np.array(each.ImagePositionPatient) @ normal)
    fewest = len(places)
    for each in map(pydicom.dcmread, (folder / "ct").iterdir()):
        row, column = np.array(each.ImageOrientationPatient).reshape(2, 3)
        size = np.array([each.Columns, each.Rows]) - 1
        corners = [
            np.array(each.ImagePositionPatient) + a * size[0] * 0.9 * row + b * size[1] * 0.7 * column
            for a in (0, 0.5, 1) for b in (0, 0.5, 1)
        ]  # fmt: skip
        along = case.formula(np.array(corners)) @ normal
        needed = {uid for uid, place in places.items() if along.min() <= place <= along.max()}
        named = {item.ReferencedSOPInstanceUID for item in each.get("SourceImageSequence", [])}
        assert needed <= named <= set(places)
        fewest = min(fewest, len(named))
    assert fewest < len(places)


def test_dcmqi_reads_the_labels_where_they_were(exported, tmp_path):
    program = shutil.which("segimage2itkimage")
    if program is None:
        pytest.skip("dcmqi is not installed (pip install dcmqi)")
    case, folder = exported
    command = [
        program,
        "--inputDICOM",
        folder / "segmentation.dcm",
        "--outputDirectory",
        tmp_path,
        "-t",
        "nii",
    ]
    subprocess.run([*map(str, command), "--mergeSegments"], check=True, capture_output=True, timeout=60)
    read = sitk.ReadImage(str(next(tmp_path.glob("*.nii.gz"))))
    names = {
        each["labelID"]: each["SegmentLabel"]
        for group in json.loads(next(tmp_path.glob("*.json")).read_text())["segmentAttributes"]
        for each in group
    }
    labels = case.result.warped_labels
    found = sitk.Resample(read, labels.to_sitk(), sitk.Transform(), sitk.sitkNearestNeighbor, 0)
    found = sitk.GetArrayFromImage(found)
    numbers = {name: number for number, name in names.items()}
    assert np.array_equal(found == numbers["femur_left"], labels.voxels == 75)
    assert np.array_equal(found == numbers["sacrum"], labels.voxels == 25)
    assert (labels.voxels == 75).any()


def test_contours_hold_the_labels_voxels_as_plastimatch_fills_them(exported, tmp_path):
    case, folder = exported
    names = {
        each.ROINumber: each.ROIName
        for each in pydicom.dcmread(folder / "contours.dcm").StructureSetROISequence
    }
    assert set(names.values()) - {"heart"} == {"femur_left", "sacrum"}
    grid = case.result.warped_labels
    read = read_segmentation(folder / "contours.dcm", grid)
    masks = {each.name: read.on_grid(each.layer, grid).voxels == each.label for each in read.segments}
    for name, label in (("femur_left", 75), ("sacrum", 25)):
        assert np.array_equal(masks[name], grid.voxels == label)
    program = shutil.which("plastimatch")
    if program is None:
        pytest.skip("plastimatch is not installed (pip install plastimatch)")
    command = [
        program, "convert", "--input", folder / "contours.dcm", "--referenced-ct", folder / "ct",
        "--output-prefix", tmp_path / "masks", "--prefix-format", "nrrd",
    ]  # fmt: skip
    subprocess.run(list(map(str, command)), check=True, capture_output=True, timeout=60)
    theirs = sitk.ReadImage(str(tmp_path / "masks/femur_left.nrrd"))
    found = sitk.Resample(theirs, grid.to_sitk(), sitk.Transform(), sitk.sitkNearestNeighbor, 0)
    different = (sitk.GetArrayFromImage(found) > 0) != (grid.voxels == 75)
    assert different.sum() <= 0.02 * (grid.voxels == 75).sum()


def test_plastimatch_writes_the_same_registrations(exported, tmp_path):
    program = shutil.which("plastimatch")
    if program is None:
        pytest.skip("plastimatch is not installed (pip install plastimatch)")
    case, folder = exported
    source, _ = frames_of(case, folder)

    def written(transform: Path, name: str) -> pydicom.Dataset:
        out = tmp_path / name
        command = [
            program, "xf-convert", "--input", transform, "--output-dicom", out, "--filenames-without-uids",
            "--fixed-rcs", folder / "ct", "--moving-rcs", case.ct_folder,
        ]  # fmt: skip
        subprocess.run(list(map(str, command)), check=True, capture_output=True, timeout=60)
        return pydicom.dcmread(next(out.glob("?ro.dcm")))

    field = case.result.transform.to_sitk_image()
    sitk.WriteImage(field, str(tmp_path / "field.mha"))
    points = points_within(gdcm_series(folder / "ct"), 50, 2, 2)
    theirs = written(tmp_path / "field.mha", "deformation")
    ours = pydicom.dcmread(folder / "deformation.dcm")
    if (
        np.linalg.det(case.result.transform.affine[:3, :3]) > 0
    ):  # theirs keeps a left-handed grid, which is not allowed
        gap = registered_to_source(ours, source, points) - registered_to_source(theirs, source, points)
        assert np.abs(gap).max() < 1e-3
    pose = case.result.structures["femur_left"].fixed_to_moving
    affine = sitk.AffineTransform(pose[:3, :3].ravel().tolist(), pose[:3, 3].tolist())
    sitk.WriteTransform(affine, str(tmp_path / "bone.tfm"))
    theirs = written(tmp_path / "bone.tfm", "bone")
    ours = pydicom.dcmread(folder / "bones/02_femur_left.dcm")
    gap = source_to_registered(ours, source, points) - source_to_registered(theirs, source, points)
    assert np.abs(gap).max() < 1e-3
