"""Meshes and images carried from file to file; VTK and SimpleITK are the oracles."""

import numpy as np
import pytest
import SimpleITK as sitk
from carried_case import carried_result

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.carried import meshes
from PolyPoseLib.io.carried.files import carry_file
from PolyPoseLib.io.carried.meshes import MESH_ENDINGS

vtk = pytest.importorskip("vtkmodules.vtkCommonCore")
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy  # noqa: E402
from vtkmodules.vtkFiltersCore import vtkCleanPolyData, vtkTriangleFilter  # noqa: E402
from vtkmodules.vtkFiltersModeling import vtkLinearSubdivisionFilter  # noqa: E402
from vtkmodules.vtkFiltersSources import vtkCubeSource, vtkSphereSource  # noqa: E402
from vtkmodules.vtkIOGeometry import vtkOBJReader, vtkOBJWriter, vtkSTLReader, vtkSTLWriter  # noqa: E402
from vtkmodules.vtkIOLegacy import vtkPolyDataReader, vtkPolyDataWriter  # noqa: E402
from vtkmodules.vtkIOPLY import vtkPLYReader, vtkPLYWriter  # noqa: E402
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader, vtkXMLPolyDataWriter  # noqa: E402

TOOLS = {
    ".stl": (vtkSTLReader, vtkSTLWriter),
    ".ply": (vtkPLYReader, vtkPLYWriter),
    ".obj": (vtkOBJReader, vtkOBJWriter),
    ".vtk": (vtkPolyDataReader, vtkPolyDataWriter),
    ".vtp": (vtkXMLPolyDataReader, vtkXMLPolyDataWriter),
}


def write_sphere(path, centre, remark=""):
    sphere = vtkSphereSource()
    sphere.SetCenter(*centre)
    sphere.SetRadius(25)
    sphere.SetThetaResolution(20)
    sphere.SetPhiResolution(20)
    sphere.Update()
    writer = TOOLS[path.suffix][1]()
    writer.SetFileName(str(path))
    writer.SetInputData(sphere.GetOutput())
    if remark and path.suffix == ".ply":
        writer.AddComment(remark)
    elif remark:
        writer.SetHeader(remark)
    assert writer.Write()


def read(path):
    reader = TOOLS[path.suffix][0]()
    reader.SetFileName(str(path))
    reader.Update()
    return reader.GetOutput()


def vertices(path) -> np.ndarray:
    return vtk_to_numpy(read(path).GetPoints().GetData()).astype(float)


@pytest.mark.parametrize("ending", MESH_ENDINGS)
def test_vertices_of_every_format_are_carried(tmp_path, ending):
    result = carried_result()
    source, target = tmp_path / f"in{ending}", tmp_path / f"out{ending}"
    write_sphere(source, result.structures["femur"].centroid)
    said = carry_file(result, source, target, "xray")
    before, after = vertices(source), vertices(target)
    expected = result.transform_points(before)
    assert "femur" in said and "displacement field" in said
    np.testing.assert_allclose(after, expected.points, atol=1e-3)
    assert read(target).GetNumberOfCells() == read(source).GetNumberOfCells()
    assert read(target).GetPointData().GetNormals() is None
    if ending in (".vtk", ".vtp"):
        data = read(target).GetPointData()
        by = vtk_to_numpy(data.GetArray("moved_by"))
        names = np.array(["displacement field", "pelvis", "femur"])
        assert names[by].tolist() == list(expected.moved_by)
        longest = vtk_to_numpy(data.GetArray("uncertainty_mm"))
        np.testing.assert_allclose(longest, expected.semi_axes_mm[:, 2], rtol=1e-3)


@pytest.mark.parametrize("ending", [".stl", ".ply", ".vtk"])
def test_a_mesh_in_ras_is_carried_there(tmp_path, ending):
    result = carried_result()
    source, target = tmp_path / f"in{ending}", tmp_path / f"out{ending}"
    centre = result.structures["femur"].centroid * [-1, -1, 1]
    write_sphere(source, centre, "3D Slicer output. SPACE=RAS")
    carry_file(result, source, target, "xray")
    flip = np.array([-1, -1, 1])
    expected = result.transform_points(vertices(source) * flip).points * flip
    np.testing.assert_allclose(vertices(target), expected, atol=1e-3)
    assert b"SPACE=RAS" in target.read_bytes()[:600]


@pytest.mark.parametrize("ending", MESH_ENDINGS)
def test_a_damaged_mesh_is_refused_in_a_sentence(tmp_path, ending):
    source = tmp_path / f"in{ending}"
    for content in (
        b"",
        b"solid\n" + b"\xff" * 500,
        b"<VTKFile",
        b"ply\nformat ascii 1.0\nelement vertex 9999999999\n",
    ):
        source.write_bytes(content)
        with pytest.raises(InputError, match=rf"in\{ending}.*damaged"):
            carry_file(carried_result(), source, tmp_path / f"out{ending}", "xray")
    assert not (tmp_path / f"out{ending}").exists()


def test_without_vtk_the_extra_is_named(tmp_path, monkeypatch):
    (tmp_path / "in.stl").write_bytes(b"x")
    monkeypatch.setattr(meshes, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"polypose\[mesh\]"):
        carry_file(carried_result(), tmp_path / "in.stl", tmp_path / "out.stl", "xray")


def image_of(result, voxels) -> sitk.Image:
    return result.structure_labels.with_voxels(voxels).to_sitk()


@pytest.mark.parametrize("ending", [".nii.gz", ".nrrd", ".mha"])
def test_an_image_is_resampled_as_simpleitk_does(tmp_path, ending):
    result, rng = carried_result(), np.random.default_rng(0)
    smooth = sitk.SmoothingRecursiveGaussian(
        image_of(result, rng.normal(size=result.structure_labels.shape).astype(np.float32) * 500), 4
    )
    source, target = tmp_path / f"in{ending}", tmp_path / f"out{ending}"
    sitk.WriteImage(smooth, str(source))
    said = carry_file(result, source, target, "xray")
    found = sitk.ReadImage(str(target))
    expected = sitk.Resample(
        smooth, smooth, result.transform.to_sitk_transform(), sitk.sitkLinear, float(found[0, 0, 0])
    )
    inner = (slice(6, -6),) * 3
    difference = sitk.GetArrayFromImage(found)[inner] - sitk.GetArrayFromImage(expected)[inner]
    assert "image of 60 x 50 x 40" in said
    assert np.abs(difference).max() < 0.01 * np.abs(sitk.GetArrayFromImage(smooth)).max()
    carry_file(result, target, tmp_path / f"back{ending}", "ct")
    back = sitk.GetArrayFromImage(sitk.ReadImage(str(tmp_path / f"back{ending}")))[inner]
    there = sitk.GetArrayFromImage(smooth)[inner]
    assert np.corrcoef(back.ravel(), there.ravel())[0, 1] > 0.98


def test_labels_are_not_mixed_and_segments_keep_their_names(tmp_path):
    result = carried_result()
    voxels = np.zeros(result.structure_labels.shape, np.uint8)
    voxels[10:30, 10:40, 20:40] = 7
    voxels[10:30, 10:40, 40:50] = 200
    image = image_of(result, voxels)
    image.SetMetaData("Segment0_Name", "tumour")
    image.SetMetaData("Segment0_LabelValue", "7")
    image.SetMetaData("Segment0_Extent", "20 39 10 39 10 29")
    source, target = tmp_path / "in.seg.nrrd", tmp_path / "out.seg.nrrd"
    sitk.WriteImage(image, str(source))
    assert "label map" in carry_file(result, source, target, "xray")
    found = sitk.ReadImage(str(target))
    assert set(np.unique(sitk.GetArrayFromImage(found))) == {0, 7, 200}
    assert found.GetMetaData("Segment0_Name") == "tumour"
    assert found.GetMetaData("Segment0_Extent") == "0 59 0 49 0 39"


def test_a_result_without_inverse_carries_images_back_all_the_same(tmp_path):
    result = carried_result()
    result.inverse_transform = None
    voxels = (result.structure_labels.voxels == 1).astype(np.uint8)
    carried = result.transform_image(result.structure_labels.with_voxels(voxels), to="ct", labels=True)
    assert 0.5 < carried.voxels.sum() / voxels.sum() < 2


def test_fractions_are_no_labels(tmp_path):
    result = carried_result()
    source = tmp_path / "in.nii.gz"
    sitk.WriteImage(image_of(result, np.full(result.structure_labels.shape, 0.5, np.float32)), str(source))
    with pytest.raises(InputError, match="no whole numbers"):
        carry_file(result, source, tmp_path / "out.nii.gz", "xray", labels=True)


def write_bones_own_surface(path, result, label):
    """The outline of a bone's voxels, with their corners: half a voxel off the voxels' centres."""
    volume = result.structure_labels
    index = np.argwhere(volume.voxels == label)[:, ::-1]
    low, high = index.min(axis=0) - 0.5, index.max(axis=0) + 0.5
    box = vtkCubeSource()
    box.SetBounds(0, 1, 0, 1, 0, 1)
    split = vtkTriangleFilter()
    split.SetInputConnection(box.GetOutputPort())
    finer = vtkLinearSubdivisionFilter()
    clean = vtkCleanPolyData()
    clean.SetInputConnection(split.GetOutputPort())
    finer.SetInputConnection(clean.GetOutputPort())
    finer.SetNumberOfSubdivisions(4)
    finer.Update()
    mesh = finer.GetOutput()
    unit = vtk_to_numpy(mesh.GetPoints().GetData()).astype(float)
    points = vtk.vtkPoints()
    points.SetData(numpy_to_vtk(volume.to_world(low + unit * (high - low)), deep=True))
    mesh.SetPoints(points)
    mesh.GetPointData().SetNormals(None)
    writer = TOOLS[path.suffix][1]()
    writer.SetFileName(str(path))
    writer.SetInputData(mesh)
    assert writer.Write()


@pytest.mark.parametrize("ending", MESH_ENDINGS)
def test_a_bones_own_surface_moves_as_one_piece_there_and_back(tmp_path, ending):
    result = carried_result()
    source, target, back = (tmp_path / f"{name}{ending}" for name in ("in", "out", "back"))
    write_bones_own_surface(source, result, 2)
    before = vertices(source)
    assert len(set(result.transform_points(before).moved_by)) == 2  # vertex by vertex it would be torn
    said = carry_file(result, source, target, "xray")
    pose = np.linalg.inv(result.structures["femur"].fixed_to_moving)
    np.testing.assert_allclose(vertices(target), before @ pose[:3, :3].T + pose[:3, 3], atol=1e-3)
    assert "1 connected piece moved as a whole by femur" in said and "displacement field" not in said
    assert "as a whole by femur" in carry_file(result, target, back, "ct")
    np.testing.assert_allclose(vertices(back), before, atol=2e-3)


def test_a_surface_of_soft_tissue_moves_vertex_by_vertex(tmp_path):
    result = carried_result()
    write_sphere(tmp_path / "in.ply", (20.0, 20.0, 10.0))
    said = carry_file(result, tmp_path / "in.ply", tmp_path / "out.ply", "xray")
    assert "as a whole" not in said and "displacement field" in said
