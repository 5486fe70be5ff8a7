"""A result of a DICOM CT, whose transform is a formula: for tests of what is exported."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import SimpleITK as sitk
from dicom_stack import write_stack
from pydicom.uid import generate_uid
from result_case import random_pose
from scipy.ndimage import gaussian_filter

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.result import CameraResult, Result, StructureResult
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.io.volumes import read_ct, write_volume

SHAPE = (12, 20, 16)
STEP_MM = 1.5
PATIENT = {
    "PatientName": "Nobody^Nowhere", "PatientID": "4711", "PatientBirthDate": "19500102", "PatientSex": "F",
    "StudyDate": "20240203", "StudyTime": "101112", "StudyID": "S1", "AccessionNumber": "A1",
    "ReferringPhysicianName": "Doctor^Who", "Manufacturer": "Scanners", "KVP": "120", "PatientPosition": "HFS",
    "BodyPartExamined": "PELVIS", "WindowCenter": "40", "WindowWidth": "400",
}  # fmt: skip


@dataclass
class DicomCase:
    """A study on disk with a DICOM CT, and a result of it.

    ``formula`` takes fixed to moving points (N, 3), LPS mm.
    """

    study: Path
    ct_folder: Path
    result: Result
    formula: object


def write_dicom_case(folder: Path, seed=0, left_handed=False, axes=None, **tags) -> DicomCase:
    """Write slices in an oblique direction, a label map and a study; the result's grid may be left-handed.

    tags: attributes of every slice, and what else ``write_stack`` takes.
    """
    rng = np.random.default_rng(seed)
    folder.mkdir(exist_ok=True)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0][:2].ravel() if axes is None else axes
    voxels = np.rint(gaussian_filter(rng.normal(size=SHAPE), 2.0) * 9000).clip(-1000, 3000).astype(int)
    voxels.flat[:2] = -1000, 1500
    tags = {"FrameOfReferenceUID": generate_uid(), "StudyInstanceUID": generate_uid(), **PATIENT, **tags}
    write_stack(folder / "ct", voxels, axes.tolist(), STEP_MM, **tags)
    ct = read_ct(folder / "ct")
    labels = np.zeros(ct.shape, np.uint8)
    labels[2:10, 3:9, 3:13], labels[3:9, 11:17, 4:12] = 25, 75
    labels[0, 0, :3] = 51
    if left_handed:
        affine = ct.affine.copy()
        affine[:3, 3] += (ct.shape[0] - 1) * affine[:3, 2]
        affine[:3, 2] *= -1
        ct, labels = Volume(ct.voxels[::-1].copy(), affine), labels[::-1].copy()
    write_volume(Volume(labels, ct.affine), folder / "labels.nii.gz")
    (folder / "ap.dcm").touch()
    study = {
        "version": 1, "ct": "ct", "segmentation": "labels.nii.gz", "anchor": "pelvis", "xrays": [{"image": "ap.dcm"}],
        "structures": {"pelvis": [25], "femur_left": [75]}, "label_table": "totalsegmentator_v2",
    }  # fmt: skip
    (folder / "study.json").write_text(json.dumps(study))
    result, formula = result_of(rng, ct, Volume(labels, ct.affine))
    return DicomCase(folder / "study.json", folder / "ct", result, formula)


def result_of(rng, ct: Volume, labels: Volume):
    """A result whose field is a slow wave, sampled finely enough to be interpolated to 0.01 mm."""
    wave, phase = rng.normal(size=(3, 3)) / 60, rng.uniform(0, 6, 3)

    def formula(points):
        return points + 3.0 * np.sin(points @ wave + phase)

    affine = ct.affine.copy()
    affine[:3, :3] *= 1.25
    affine[:3, 3] -= ct.affine[:3, :3] @ [4, 5, 3]
    nodes = np.stack(np.meshgrid(*map(np.arange, (17, 24, 20)), indexing="ij"), axis=-1)[..., ::-1]
    points = nodes @ affine[:3, :3].T + affine[:3, 3]
    field = DisplacementField((formula(points.reshape(-1, 3)).reshape(points.shape) - points), affine)
    image, transform = ct.to_sitk(), field.to_sitk_transform()
    warped = sitk.Resample(sitk.Cast(image, sitk.sitkFloat64), image, transform, sitk.sitkLinear, -1000.0)
    warped_labels = sitk.Resample(labels.to_sitk(), image, transform, sitk.sitkNearestNeighbor, 0)
    camera = Camera(np.array([[2000, 0, 3], [0, 2000, 2], [0, 0, 1.0]]), random_pose(rng), 4, 6)
    centre = ct.bounds_center
    result = Result(
        structures={
            "pelvis": StructureResult.from_pose(np.eye(4), centre),
            "femur_left": StructureResult.from_pose(random_pose(rng), centre),
        },
        cameras=[CameraResult(camera, 0.5, "X-ray 1")],
        history=[],
        seconds={"total": 1.0},
        device="cpu",
        versions={},
        warnings=[],
        warped_ct=Volume(sitk.GetArrayFromImage(warped).astype(np.float32), ct.affine),
        warped_labels=Volume(sitk.GetArrayFromImage(warped_labels), ct.affine),
        transform=field,
        renderings_after=[np.ones((4, 6), np.float32)],
        anchor="pelvis",
    )
    return result, formula
