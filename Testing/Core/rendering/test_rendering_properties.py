"""What holds for every rendering: linear in the voxels, the same when all moves together, the same from either code."""

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter
from strategies import affines, motions

from PolyPoseLib.geometry.camera import Camera, intrinsics_matrix, look_at
from PolyPoseLib.geometry.rigid import rigid_inverse
from PolyPoseLib.rendering.backend import Backend
from PolyPoseLib.rendering.pose_images import footprints
from PolyPoseLib.rendering.projector import render
from PolyPoseLib.rendering.rigid import Body, footprint, project_body
from PolyPoseLib.rendering.select import select_backend
from PolyPoseLib.rendering.torch_backend import TorchBackend

SHAPE = (8, 9, 10)
STEP_MM = 1.0
REST = np.eye(4)


@pytest.fixture(scope="module", params=["numba", "torch"])
def backend(request: pytest.FixtureRequest) -> Backend:
    if request.param == "torch":
        return TorchBackend()
    pytest.importorskip("numba")
    return select_backend("numba", "cpu")


@st.composite
def bodies(draw: st.DrawFn) -> Body:
    """A smooth random body with a border of zeros on any grid."""
    rng = np.random.default_rng(draw(st.integers(0, 1 << 32)))
    voxels = np.pad(gaussian_filter(0.05 * rng.random(SHAPE), 1).astype(np.float32), 1)
    affine = draw(affines(1.0, 4.0))
    centre = affine[:3, :3] @ (np.array(voxels.shape[::-1]) / 2) + affine[:3, 3]
    return Body(voxels, affine, centre)


@st.composite
def views(draw: st.DrawFn, body: Body) -> Camera:
    """A camera that looks at the body from anywhere."""
    away = np.array([draw(st.floats(-1, 1)) for _ in range(3)]) + np.array([0.1, 1.5, 0.2])
    source = body.centre + 600 * away / np.linalg.norm(away)
    intrinsics = intrinsics_matrix(900, draw(st.floats(2, 6)), 12, 14)
    return Camera(intrinsics, look_at(source, body.centre), 12, 14)


def image_of(body: Body, camera: Camera, pose: np.ndarray, backend: Backend) -> np.ndarray:
    """(H, W) of the whole image."""
    image = np.zeros((camera.height, camera.width), np.float32)
    part = project_body(body, camera, pose, STEP_MM, backend)
    image[part.slices] = part.image
    return image


def close(found: np.ndarray, expected: np.ndarray, tolerance: float = 1e-3) -> None:
    assert np.abs(found - expected).max() <= tolerance * max(np.abs(expected).max(), 1e-3)


@given(st.data(), bodies(), st.floats(-2, 2), st.floats(-2, 2))
def test_an_image_is_linear_in_the_voxels(backend, data, body: Body, first: float, second: float) -> None:
    camera = data.draw(views(body))
    other = Body(body.voxels[::-1, ::-1, ::-1], body.affine, body.centre)
    mixed = Body(first * body.voxels + second * other.voxels, body.affine, body.centre)
    images = [image_of(each, camera, REST, backend) for each in (body, other, mixed)]
    scale = max(np.abs(images[0]).max(), np.abs(images[1]).max(), 1e-3)
    assert np.abs(images[2] - first * images[0] - second * images[1]).max() <= 1e-4 * scale


@given(st.data(), bodies(), motions())
def test_a_pose_is_a_motion_of_the_body(backend, data, body: Body, motion: np.ndarray) -> None:
    """Rendering under a pose (fixed to moving) is rendering the body moved back, or the camera moved with it."""
    camera = data.draw(views(body))
    pose = rigid_inverse(motion)
    there = camera.with_extrinsic(camera.extrinsic @ rigid_inverse(motion))
    expected = image_of(body, camera, REST, backend)
    close(image_of(body, there, pose, backend), expected)
    shifted = Body(body.voxels, motion @ body.affine, body.centre)
    close(image_of(shifted, there, REST, backend), expected)


@given(st.data(), bodies(), st.integers(0, 2))
def test_a_reversed_axis_changes_nothing(backend, data, body: Body, axis: int) -> None:
    camera = data.draw(views(body))
    affine = body.affine.copy()
    affine[:3, 3] += affine[:3, axis] * (body.voxels.shape[2 - axis] - 1)
    affine[:3, axis] *= -1
    reversed_body = Body(np.flip(body.voxels, 2 - axis), affine, body.centre)
    close(image_of(reversed_body, camera, REST, backend), image_of(body, camera, REST, backend))


@given(st.data(), bodies())
def test_the_differentiable_renderer_agrees(backend, data, body: Body) -> None:
    camera = data.draw(views(body))
    extrinsic = torch.from_numpy(camera.extrinsic.copy())[None]
    intrinsics = torch.from_numpy(camera.intrinsics.copy())
    affine = torch.from_numpy(body.affine)
    fine = render(torch.from_numpy(body.voxels), affine, intrinsics, extrinsic, 12, 14, 0.25)[0].numpy()
    part = project_body(body, camera, REST, 0.25, backend)
    image = np.zeros_like(fine)
    image[part.slices] = part.image
    close(image, fine, 0.02)


@given(st.data())
def test_a_footprint_holds_every_corner_inside_the_image(data: st.DataObject) -> None:
    body = data.draw(bodies())
    camera = data.draw(views(body))
    pose = data.draw(motions())
    window = footprint(body, camera, pose)
    assert window == tuple(footprints(body, camera, pose[None])[0])
    corners = body.corners @ rigid_inverse(pose)[:3, :3].T + rigid_inverse(pose)[:3, 3]
    if (camera.extrinsic[2, :3] @ corners.T + camera.extrinsic[2, 3]).min() > 1.0:
        columns, rows = camera.project(corners).T
        inside = (rows >= 0) & (rows <= camera.height - 1) & (columns >= 0) & (columns <= camera.width - 1)
        assert (rows[inside] >= window[0]).all() and (rows[inside] <= window[1] - 1).all()
        assert (columns[inside] >= window[2]).all() and (columns[inside] <= window[3] - 1).all()
    assert 0 <= window[0] <= window[1] <= camera.height and 0 <= window[2] <= window[3] <= camera.width
