"""Surfaces and warped CTs of chosen frames lie where the poses put the bones."""

import numpy as np
import pytest
import SimpleITK as sitk
from result_case import random_pose
from track_case import NAMES, frame_at, make_track, write_sequence

import PolyPoseLib as pp
from PolyPoseLib.data.tracking.track import TrackedFrame
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.tracking.posed_files import relative_poses, require_frames, write_stl
from PolyPoseLib.io.tracking.sequences import load_sequence


@pytest.fixture
def sequence(tmp_path):
    return load_sequence(write_sequence(tmp_path / "walk"))


def tracked(sequence, poses):
    """A track of one frame with these poses (2, 4, 4)."""
    track = make_track(frames=3)
    frame = TrackedFrame(**{**frame_at(0).__dict__, "poses": np.stack(poses)})
    centroids = sequence.structures.centroids(sequence.ct.affine)
    return type(track)(**{**track.__dict__, "frames": (frame,), "centroids": centroids})


def read_stl(path):
    vtk = pytest.importorskip("vtkmodules.vtkIOGeometry")
    from vtkmodules.util.numpy_support import vtk_to_numpy

    reader = vtk.vtkSTLReader()
    reader.SetFileName(str(path))
    reader.Update()
    return vtk_to_numpy(reader.GetOutput().GetPoints().GetData()).astype(float)


def test_surfaces_are_where_the_bones_are(sequence, tmp_path):
    rng = np.random.default_rng(0)
    poses = [random_pose(rng, 40, 200) for _ in range(2)]
    folder = pp.save_track(tracked(sequence, poses), tmp_path / "out", sequence, surfaces_of=[0, 0])
    assert sorted(each.name for each in (folder / "surfaces/frame_000000").iterdir()) == [
        "talus.stl",
        "tibia.stl",
    ]
    for k, name in enumerate(NAMES):
        points = read_stl(folder / "surfaces/frame_000000" / f"{name}.stl")
        in_ct = points @ poses[k][:3, :3].T + poses[k][:3, 3]
        index = np.argwhere(sequence.structures.mask(name))[:, ::-1]
        bone = sequence.ct.to_world(index)
        for end in ("min", "max"):  # within a voxel of the bone's box
            off = getattr(in_ct, end)(axis=0) - getattr(bone, end)(axis=0)
            assert (np.abs(off) < sequence.ct.spacing).all()


def test_stl_is_what_vtk_reads(tmp_path):
    rng = np.random.default_rng(0)
    points = rng.normal(size=(30, 3)) * 50
    triangles = rng.integers(0, 30, (50, 3))
    write_stl(tmp_path / "x.stl", points, triangles)
    found = read_stl(tmp_path / "x.stl")
    used = points[np.unique(triangles)].astype(np.float32)
    assert {tuple(each) for each in found.astype(np.float32)} == {tuple(each) for each in used}


def test_the_ct_is_warped_about_the_reference(sequence, tmp_path):
    """Whatever the rig's world: with the reference's own motion taken out, bones that did not move stay."""
    moved = random_pose(np.random.default_rng(1), 90, 500)
    folder = pp.save_track(tracked(sequence, [moved, moved]), tmp_path / "out", sequence, warped=[0])
    ct = sitk.GetArrayFromImage(sitk.ReadImage(str(folder / "warped/frame_000000_ct.nii.gz")))
    labels = sitk.GetArrayFromImage(sitk.ReadImage(str(folder / "warped/frame_000000_labels.nii.gz")))
    assert np.array_equal(labels, sequence.structures.labels)
    assert np.abs(ct - sequence.ct.voxels).max() <= 1


def test_the_warped_bone_is_rigid_and_where_its_pose_puts_it(sequence, tmp_path):
    shift = np.eye(4)
    shift[2, 3] = -3.0  # from the frame to the CT: the talus lies one voxel higher in the frame
    world = random_pose(np.random.default_rng(2), 90, 500)
    folder = pp.save_track(tracked(sequence, [world, shift @ world]), tmp_path / "out", sequence, warped=[0])
    labels = sitk.GetArrayFromImage(sitk.ReadImage(str(folder / "warped/frame_000000_labels.nii.gz")))
    expected = np.zeros_like(labels)
    expected[1:][sequence.structures.labels[:-1] == 2] = 2
    assert np.array_equal(labels == 2, expected == 2)


def test_relative_poses_leave_the_reference_at_rest():
    track = make_track(7, frames=3)
    frame = track.frames[0]
    poses = relative_poses(track, frame, 0)
    assert poses[0] == pytest.approx(np.eye(4), abs=1e-12)
    point = np.array([3.0, -4, 5, 1])
    world = np.linalg.inv(frame.poses[0]) @ point
    assert poses[1] @ point == pytest.approx(frame.poses[1] @ world)
    with pytest.raises(InputError, match="was lost"):
        relative_poses(track, track.frames[1], 0)


def test_frames_that_are_not_tracked_are_refused():
    require_frames((2, 5), range(2, 6), "--warp-frames")
    for number in (1, 6, 10**9):
        with pytest.raises(
            InputError, match=f"--warp-frames: frame {number} is not tracked; give numbers from 2 to 5"
        ):
            require_frames((2, number), range(2, 6), "--warp-frames")


def test_vtp_has_the_same_surface_and_how_far_each_vertex_may_be_off(sequence, tmp_path):
    """By drawing poses from the covariance: 95 of 100 vertices lie within the half axis, or fewer where it is long."""
    vtk = pytest.importorskip("vtkmodules.vtkIOXML")
    from vtkmodules.util.numpy_support import vtk_to_numpy

    rng = np.random.default_rng(3)
    track = tracked(sequence, [random_pose(rng, 40, 200) for _ in range(2)])
    covariance = np.diag(np.r_[np.radians([2.0, 0.1, 0.1]), 0.2, 0.2, 1.5] ** 2)
    frame = TrackedFrame(**{**track.frames[0].__dict__, "covariances": np.stack([covariance] * 2)})
    track = type(track)(**{**track.__dict__, "frames": (frame,)})
    folder = pp.save_track(track, tmp_path / "out", sequence, surfaces_of=[0], surface_format="vtp")
    plain = pp.save_track(track, tmp_path / "plain", sequence, surfaces_of=[0])
    assert [each.name for each in sorted((folder / "surfaces/frame_000000").iterdir())] == [
        "talus.vtp",
        "tibia.vtp",
    ]
    for k, name in enumerate(NAMES):
        reader = vtk.vtkXMLPolyDataReader()
        reader.SetFileName(str(folder / "surfaces/frame_000000" / f"{name}.vtp"))
        reader.Update()
        mesh = reader.GetOutput()
        points = vtk_to_numpy(mesh.GetPoints().GetData()).astype(float)
        in_stl = read_stl(plain / "surfaces/frame_000000" / f"{name}.stl").astype(np.float32)
        assert {tuple(each) for each in points.astype(np.float32)} == {tuple(each) for each in in_stl}
        assert mesh.GetFieldData().GetAbstractArray("SPACE").GetValue(0) == "LPS"
        off = vtk_to_numpy(mesh.GetPointData().GetArray("uncertainty_mm"))
        in_ct = points @ frame.poses[k][:3, :3].T + frame.poses[k][:3, 3] - track.centroids[k]
        drawn = rng.multivariate_normal(np.zeros(6), covariance, 4000)
        moved = drawn[:, None, 3:] + np.cross(drawn[:, None, :3], in_ct)
        distances = np.linalg.norm(moved, axis=2)
        assert ((distances <= off).mean(axis=0) > 0.94).all()
        assert ((distances <= 0.65 * off).mean(axis=0) < 0.95).all()


def test_another_surface_format_is_refused(sequence, tmp_path):
    with pytest.raises(InputError, match="surface format"):
        pp.save_track(make_track(), tmp_path / "out", sequence, surfaces_of=[0], surface_format="obj")
    assert not (tmp_path / "out").exists()
