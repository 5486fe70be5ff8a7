"""CTs of a tilted gantry, against a sphere whose place and size are known in millimetres: nothing here reads a grid."""

import json

import numpy as np
import pytest
import SimpleITK as sitk
from dicom_stack import write_stack
from small_study import write_small_study

from PolyPoseLib.data.straight_grid import straight_grid
from PolyPoseLib.data.volume import Volume, resample_labels_onto
from PolyPoseLib.io.studies import load_study
from PolyPoseLib.io.volumes import read_ct_with_warnings, read_volume

CENTRE, RADIUS = np.array([31.0, 12.0, 80.0]), 21.0
SHAPE = (22, 84, 72)
"""Slices of 3 mm with pixels of 0.7 mm along columns and 0.9 mm along rows."""


def sheared_affine(degrees: float, side: int) -> np.ndarray:
    """Slices that drift down their columns (side 1) or along their rows (0) by a tilt; the middle is the sphere's."""
    affine = np.diag([0.9, 0.7, 3.0, 1.0])
    affine[side, 2] = 3.0 * np.tan(np.radians(degrees))
    affine[:3, 3] = CENTRE - affine[:3, :3] @ ((np.array(SHAPE[::-1]) - 1) / 2)
    return affine


def sphere(affine: np.ndarray, shape=SHAPE) -> np.ndarray:
    """Bone of 600 HU with an edge of 3 mm in fat, at the places that the affine gives the voxels."""
    kji = np.indices(shape).reshape(3, -1)
    points = affine[:3, :3] @ kji[::-1] + affine[:3, 3:]
    depth = RADIUS - np.linalg.norm(points - CENTRE[:, None], axis=0)
    return np.round(-80 + 680 * np.clip(depth / 3 + 0.5, 0, 1)).reshape(shape)


def check_sphere(ct: Volume, tolerance: float = 0.15) -> None:
    """Its centre and its extent along each world axis, by SimpleITK alone."""
    image = ct.to_sitk()
    found = sitk.LabelShapeStatisticsImageFilter()
    found.Execute(sitk.BinaryThreshold(image, 260, 5000, 1, 0))
    assert np.abs(np.array(found.GetCentroid(1)) - CENTRE).max() < tolerance
    assert abs(found.GetEquivalentSphericalRadius(1) - RADIUS) < tolerance
    for direction in np.vstack([np.eye(3), [[0, 0.6, 0.8], [0, -0.6, 0.8], [0.8, 0, 0.6]]]):
        for sign in (-1, 1):
            at = [CENTRE + sign * mm * direction for mm in np.arange(RADIUS - 2, RADIUS + 2, 0.1)]
            values = [image.EvaluateAtPhysicalPoint(p.tolist(), sitk.sitkLinear) for p in at]
            edge = RADIUS - 2 + 0.1 * int(np.argmax(np.array(values) < 260))
            assert abs(edge - RADIUS) < 4 * tolerance


@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("degrees", [-25.0, -6.0, 12.0, 30.0])
def test_a_sphere_in_tilted_dicom_slices_stays_a_sphere(tmp_path, degrees, side):
    affine = sheared_affine(degrees, side)
    positions = [affine[:3, :3] @ [0, 0, k] + affine[:3, 3] for k in range(SHAPE[0])]
    write_stack(tmp_path / "ct", sphere(affine).astype(int), positions=positions)
    ct, warnings = read_ct_with_warnings(tmp_path / "ct")
    check_sphere(ct)
    assert np.allclose(ct.affine[:3, :3], np.diag([0.9, 0.7, 3.0]), atol=1e-6)
    assert any(f"tilted by {abs(degrees):.1f} degrees" in each for each in warnings)


@pytest.mark.parametrize("left_handed", [False, True])
@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1), (1, 2, 0)])
def test_a_sphere_stays_a_sphere_in_any_order_of_axes(tmp_path, order, left_handed):
    affine = sheared_affine(15.0, 1)
    values = sphere(affine).astype(np.int16)
    if left_handed:
        affine[:3, 3] += affine[:3, 0] * (SHAPE[2] - 1)
        affine[:3, 0] *= -1
        values = values[:, :, ::-1]
    affine[:3, :3] = affine[:3, :3][:, order]
    values = np.transpose(values, [2 - order[2 - axis] for axis in range(3)])
    image = Volume(np.ascontiguousarray(values), affine).to_sitk()
    sitk.WriteImage(image, str(tmp_path / "ct.nrrd"))
    ct, warnings = read_ct_with_warnings(tmp_path / "ct.nrrd")
    check_sphere(ct)
    assert any("gantry tilt" in each for each in warnings)


@pytest.mark.parametrize("seed", range(8))
def test_the_straight_grid_holds_every_voxel_and_keeps_the_planes(seed):
    rng = np.random.default_rng(seed)
    affine = sheared_affine(rng.uniform(-30, 30), int(rng.integers(2)))
    volume = Volume(np.zeros(SHAPE, np.int8), affine)
    straight, shape = straight_grid(volume)
    index = (volume.corners() - straight[:3, 3]) @ np.linalg.inv(straight[:3, :3]).T
    assert (index > -1e-5).all() and (index < np.array(shape[::-1]) - 1 + 1e-5).all()
    assert shape[0] == SHAPE[0] and np.allclose(straight[2], affine[2])


def test_labels_of_the_tilted_grid_follow_and_the_study_says_so(tmp_path):
    affine = sheared_affine(14.0, 1)
    inside = sphere(affine) > 260
    write_small_study(tmp_path)
    for name, values in (
        ("ct", sphere(affine).astype(np.int16)),
        ("labels", np.where(inside, 25, 75).astype(np.uint8)),
    ):
        sitk.WriteImage(Volume(values, affine).to_sitk(), str(tmp_path / f"{name}.nrrd"))
    fields = json.loads((tmp_path / "study.json").read_text())
    (tmp_path / "study.json").write_text(
        json.dumps({**fields, "ct": "ct.nrrd", "segmentation": "labels.nrrd"})
    )
    study = load_study(tmp_path / "study.json")
    assert [each for each in study.warnings if "tilted by 14.0 degrees" in each]
    bone = study.structures.mask("pelvis")
    check_sphere(study.ct.with_voxels(np.where(bone, 600.0, -80.0)), tolerance=0.3)
    resampled = resample_labels_onto(read_volume(tmp_path / "labels.nrrd"), study.ct)
    assert np.array_equal(resampled.voxels == 25, bone)
