"""CTs of other kinds: one multi-frame file, slices of a tilted gantry, files whose axes are stored in another order."""

import json

import numpy as np
import pydicom
import pytest
import SimpleITK as sitk
from dicom_case import PATIENT, SHAPE, result_of, write_dicom_case
from dicom_stack import enhanced, stack
from dicom_validators import attribute_errors, entity_faults
from standard_registrations import registered_to_source

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.io.dicom_export.export import export_dicom
from PolyPoseLib.io.dicom_export.inputs import CtChoice
from PolyPoseLib.io.volumes import read_ct, read_volume, write_volume


def test_a_multi_frame_ct_is_referred_to_by_its_frames(tmp_path):
    case = write_dicom_case(tmp_path / "case")
    voxels = stack()
    order = np.random.default_rng(1).permutation(len(voxels))
    file = enhanced(voxels, order)
    for name, value in PATIENT.items():
        setattr(file, name, value)
    pydicom.dcmwrite(tmp_path / "case/ct.dcm", file, enforce_file_format=True)
    ct = read_ct(tmp_path / "case/ct.dcm")
    labels = np.zeros(ct.shape, np.uint8)
    labels[1:7, 1:4, 1:3], labels[1:7, 1:4, 3:5] = 25, 75
    write_volume(Volume(labels, ct.affine), tmp_path / "case/labels.nii.gz")
    case.study.write_text(json.dumps({**json.loads(case.study.read_text()), "ct": "ct.dcm"}))
    result, _ = result_of(np.random.default_rng(0), ct, Volume(labels, ct.affine))
    folder = export_dicom(result, case.study, tmp_path / "dicom")
    deformation = pydicom.dcmread(folder / "deformation.dcm")
    item = deformation.DeformableRegistrationSequence[0]
    assert item.SourceFrameOfReferenceUID == file.FrameOfReferenceUID
    (reference,) = item.ReferencedImageSequence
    assert reference.ReferencedSOPInstanceUID == file.SOPInstanceUID
    heights = [1.5 * float(order[n - 1]) for n in reference.ReferencedFrameNumber]
    assert heights == sorted(heights) and len(heights) == len(voxels)
    files = sorted(folder.rglob("*.dcm"))
    assert attribute_errors(*files) == []
    assert entity_faults(*files, tmp_path / "case/ct.dcm") == []


def test_a_tilted_gantry_gives_slices_on_the_straight_grid(tmp_path):
    normal_steps = [np.array([0.0, 0.3 * n, 1.5 * n]) for n in range(SHAPE[0])]
    axes = np.array([1, 0, 0, 0, 1, 0])
    case = write_dicom_case(tmp_path / "case", axes=axes, positions=normal_steps)
    folder = export_dicom(case.result, case.study, tmp_path / "dicom")
    written = read_volume(folder / "ct")
    assert written.same_grid(case.result.warped_ct)
    assert np.array_equal(written.voxels, np.rint(case.result.warped_ct.voxels))
    assert written.shape[1] > SHAPE[1]


@pytest.mark.parametrize("order", [(2, 0, 1), (1, 2, 0), (0, 1, 2)])
def test_a_file_of_sagittal_slices_becomes_an_axial_series(tmp_path, order):
    case = write_dicom_case(tmp_path / "case", axes=np.array([1, 0, 0, 0, 1, 0]))
    upright = case.result.warped_ct
    axes = [2 - n for n in order[::-1]]

    def sagittal(volume):
        voxels, affine = np.flip(volume.voxels.transpose(axes), 1), volume.affine.copy()
        affine[:3, :3] = affine[:3, list(order)]
        affine[:3, 3] += affine[:3, 1] * (voxels.shape[1] - 1)
        affine[:3, 1] *= -1
        return Volume(voxels.copy(), affine)

    ct = read_ct(case.ct_folder)
    points = np.random.default_rng(0).uniform(0, 10, (20, 3)).round()
    turned = sagittal(ct)
    back = np.rint(turned.to_index(ct.to_world(points))).astype(int)
    there = np.rint(points).astype(int)
    assert np.array_equal(turned.voxels[tuple(back.T[::-1])], ct.voxels[tuple(there.T[::-1])])
    write_volume(turned, tmp_path / "case/ct.nii.gz")
    case.study.write_text(json.dumps({**json.loads(case.study.read_text()), "ct": "ct.nii.gz"}))
    case.result.warped_ct, case.result.warped_labels = sagittal(upright), sagittal(case.result.warped_labels)
    folder = export_dicom(case.result, case.study, tmp_path / "dicom", CtChoice(new_patient="7"))
    for name, expected in (("original_ct", ct), ("ct", upright)):
        written = read_volume(folder / name)
        assert written.same_grid(expected)
        assert np.array_equal(written.voxels, np.rint(expected.voxels))
    first = pydicom.dcmread(folder / "ct/0001.dcm")
    assert list(first.ImageOrientationPatient) == [1, 0, 0, 0, 1, 0]
    segmentation = sitk.ReadImage(str(folder / "segmentation.dcm"))
    assert segmentation.GetSize()[:2] == (SHAPE[2], SHAPE[1])
    points = upright.to_world(points)
    whole = pydicom.dcmread(folder / "deformation.dcm")
    source = pydicom.dcmread(folder / "original_ct/0001.dcm").FrameOfReferenceUID
    assert np.abs(registered_to_source(whole, source, points) - case.formula(points)).max() < 0.02
