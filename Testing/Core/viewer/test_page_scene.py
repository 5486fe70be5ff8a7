"""The scene: where meshes that go to the browser really are."""

import base64

import numpy as np
import pytest
from result_case import random_pose

from PolyPoseLib.carrying.surfaces import Surface
from PolyPoseLib.data.carried import CHI2_95
from PolyPoseLib.data.result import CameraResult
from PolyPoseLib.geometry.camera import Camera, intrinsics_matrix, look_at
from PolyPoseLib.viewer import scene
from PolyPoseLib.viewer.content import Bone, View


def decoded(encoded):
    return np.frombuffer(base64.b64decode(encoded["bvals"]), encoded["dtype"])


def points_of(mesh):
    return decoded(mesh["mesh"]["points"]).reshape(-1, 3).astype(float)


def a_bone(seed=0):
    rng = np.random.default_rng(seed)
    surface = Surface(
        rng.normal(0, 40, (30, 3)).astype(np.float32), rng.integers(0, 30, (50, 3)).astype(np.int32)
    )
    return Bone("femur", "#e6c84f", surface, random_pose(rng, 60, 30))


@pytest.mark.parametrize("seed", range(4))
def test_a_bone_begins_where_the_ct_has_it_and_ends_as_x_rayed(seed):
    bone = a_bone(seed)
    poses = [np.array(scene.pose_between(bone, share)).reshape(4, 4).T for share in (0, 0.5, 1)]
    np.testing.assert_allclose(poses[0], np.eye(4), atol=1e-9)
    np.testing.assert_allclose(poses[2], bone.motion, atol=1e-6)
    assert np.linalg.det(poses[1][:3, :3]) == pytest.approx(1)
    middle = bone.surface.points.mean(axis=0, dtype=float)
    halfway = [pose[:3, :3] @ middle + pose[:3, 3] for pose in poses]
    np.testing.assert_allclose(halfway[1], (halfway[0] + halfway[2]) / 2, atol=1e-6)


def test_a_picture_lies_on_its_detector_pixel_by_pixel():
    height, width, distance = 50, 70, 1000.0
    camera = Camera(
        intrinsics_matrix(distance, 2.0, height, width), look_at((30, -700, 50), (0, 0, 0)), height, width
    )
    image = np.arange(height * width, dtype=np.float32).reshape(height, width)
    view = View(CameraResult(camera, 0.5), image, None, None, distance, (), ())
    mesh = scene.detector_mesh(view, distance, 1)
    points = points_of(mesh)
    np.testing.assert_allclose(camera.depth(points), distance, atol=1e-3)
    column, row = np.meshgrid(np.arange(width), np.arange(height))
    np.testing.assert_allclose(camera.project(points), np.stack([column, row], -1).reshape(-1, 2), atol=1e-3)
    gray = decoded(mesh["field"]["values"]).reshape(-1, 3)
    assert gray[0, 0] == 0
    assert gray[-1, 0] == 255
    assert (np.diff(gray[:, 0].astype(int)) >= 0).all()
    beam = points_of(scene.beam_mesh(view, distance))
    np.testing.assert_allclose(beam[0], camera.source, atol=1e-3)
    np.testing.assert_allclose(
        camera.project(beam[1:]), [(-0.5, -0.5), (69.5, -0.5), (69.5, 49.5), (-0.5, 49.5)], atol=1e-3
    )


def test_ellipsoids_lie_at_the_95_percent_level_and_unknown_ones_are_left_out():
    rng = np.random.default_rng(1)
    root = rng.normal(size=(3, 3))
    covariance = root @ root.T + np.eye(3)
    places = np.array([(1.0, 2, 3), (50, 60, 70)])
    mesh = scene.ellipsoids_mesh(places, np.stack([covariance, np.full((3, 3), np.nan)]))
    off = points_of(mesh) - places[0]
    np.testing.assert_allclose(
        np.einsum("ni,ij,nj->n", off, np.linalg.inv(covariance), off), CHI2_95, rtol=1e-4
    )
    triangles = decoded(mesh["mesh"]["polys"]).reshape(-1, 4)
    assert (triangles[:, 0] == 3).all()
    assert triangles[:, 1:].max() == len(off) - 1


def test_letters_lie_on_the_sides_that_they_name():
    pytest.importorskip("vtkmodules")
    low, high = np.array([-100.0, -50, -200]), np.array([120.0, 70, 10])
    points = points_of(scene.letters_mesh(low, high))
    for axis in range(3):
        assert (points[:, axis] < low[axis]).any(), "R, A and I"
        assert (points[:, axis] > high[axis]).any(), "L, P and S"


def test_normals_point_out_of_a_ball():
    points, triangles = scene._ball()
    bone = Bone("ball", "#ffffff", Surface(points.astype(np.float32), triangles.astype(np.int32)), np.eye(4))
    (normals,) = scene.bone_mesh(bone)["pointArrays"]
    outward = decoded(normals["values"]).reshape(-1, 3)
    assert ((outward * points).sum(axis=1) > 0.8).mean() > 0.9
