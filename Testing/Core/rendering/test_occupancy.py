"""Occupied blocks cover all that is not zero, and as a hint they change no rendering."""

import numpy as np
import pytest
from backend_cases import STEP, assert_close, random_body, random_view
from scipy.ndimage import map_coordinates

from PolyPoseLib.geometry.camera import Camera, look_at
from PolyPoseLib.rendering import occupancy
from PolyPoseLib.rendering.backend import IndexField
from PolyPoseLib.rendering.numba_backend import NumbaBackend
from PolyPoseLib.rendering.occupancy import occupied_blocks
from PolyPoseLib.rendering.rigid import Body, index_rays


def sparse_voxels(seed):
    """A few lumps and single voxels in emptiness, with a border of zeros."""
    rng = np.random.default_rng(seed)
    voxels = np.zeros(rng.integers(9, 34, 3), np.float32)
    for _ in range(rng.integers(1, 5)):
        first = [rng.integers(1, size - 2) for size in voxels.shape]
        part = tuple(slice(a, a + rng.integers(1, 5)) for a in first)
        voxels[part] = 0.05
    voxels[[0, -1]] = voxels[:, [0, -1]] = voxels[:, :, [0, -1]] = 0
    return voxels


def sparse_body(seed):
    body = random_body(seed)
    voxels = sparse_voxels(seed)
    centre = body.affine[:3, :3] @ (np.array(voxels.shape[::-1]) / 2) + body.affine[:3, 3]
    return Body(voxels, body.affine, centre)


def numba_backend():
    pytest.importorskip("numba")
    return NumbaBackend()


@pytest.mark.parametrize("seed", range(12))
def test_the_interpolant_is_zero_outside_the_blocks(seed, monkeypatch):
    if seed % 3 == 0:
        monkeypatch.setattr(occupancy, "MOST_BLOCKS", 2)
    voxels = sparse_voxels(seed)
    blocks = occupied_blocks(voxels)
    points = np.random.default_rng(seed).uniform(0, np.array(voxels.shape[::-1]) - 1, (20000, 3))
    inside = (np.abs(points[:, None] - blocks.centres) <= blocks.half_edge).all(axis=2).any(axis=1)
    values = map_coordinates(voxels, points[:, ::-1].T, order=1)
    assert (values[~inside] == 0).all()
    assert (values > 0).any()
    assert (~inside).any() or blocks.half_edge > occupancy.SMALLEST_EDGE / 2


def test_a_volume_of_zeros_has_no_blocks():
    assert len(occupied_blocks(np.zeros((5, 6, 7), np.float32)).centres) == 0


@pytest.mark.parametrize("seed", range(12))
def test_the_hint_changes_no_line_integral(seed):
    body, backend = sparse_body(seed), numba_backend()
    camera, pose = random_view(seed, body, 23, 26)
    rays = index_rays(body, camera, pose, (0, camera.height, 0, camera.width), STEP)
    for moments in (False, True):
        hinted = backend.project(body.voxels, rays, moments, body.occupied)
        plain = backend.project(body.voxels, rays, moments)
        assert plain[0].max() > 0
        assert_close(hinted[0], plain[0], 1e-5)
        if moments:
            assert_close(hinted[1], plain[1], 1e-3)


@pytest.mark.parametrize("seed", range(4))
def test_the_hint_holds_with_the_source_among_the_blocks(seed):
    body, backend = sparse_body(seed), numba_backend()
    camera, _ = random_view(seed, body, 23, 26)
    rng = np.random.default_rng(seed)
    near = body.affine[:3, :3] @ (body.occupied.centres[0] + rng.normal(0, 2, 3)) + body.affine[:3, 3]
    inside = Camera(camera.intrinsics, look_at(near, body.centre + 0.1), camera.height, camera.width)
    rays = index_rays(body, inside, np.eye(4), (0, camera.height, 0, camera.width), 0.5)
    hinted, _ = backend.project(body.voxels, rays, False, body.occupied)
    plain, _ = backend.project(body.voxels, rays, False)
    assert np.abs(hinted - plain).max() <= 1e-5 * max(plain.max(), 1e-3)


@pytest.mark.parametrize("seed", range(8))
def test_the_hint_reaches_as_far_as_the_field_displaces(seed):
    body, backend = sparse_body(seed), numba_backend()
    camera, pose = random_view(seed, body, 23, 26)
    size = np.array(body.voxels.shape[::-1])
    rng = np.random.default_rng(seed)
    vectors = rng.normal(0, 3, (4, 5, 6, 3)).astype(np.float32)
    span = (size + 7) / np.array((5, 4, 3))
    field = IndexField(vectors, 1 / span, 4 / span, np.full(3, -4.0), size + 3.0)
    rays = index_rays(body, camera, pose, (0, camera.height, 0, camera.width), STEP)
    hinted = backend.project_warped(body.voxels, field, rays, body.occupied)
    plain = backend.project_warped(body.voxels, field, rays)
    assert plain.max() > 0
    assert_close(hinted, plain, 1e-5)


def test_a_volume_that_no_index_reaches_is_refused():
    backend = numba_backend()
    body = sparse_body(0)
    camera, pose = random_view(0, body)
    rays = index_rays(body, camera, pose, (0, 2, 0, 2), STEP)
    huge = np.broadcast_to(np.float32(0), (2048, 2048, 512))
    with pytest.raises(ValueError, match="2147483648 values"):
        backend.project(huge, rays, False)


@pytest.mark.parametrize("ulps", [0, 1, 2, 100])
def test_a_block_that_the_source_touches_is_seen_everywhere(ulps):
    pytest.importorskip("numba")
    from PolyPoseLib.rendering import kernels

    source = np.array([2.0, 0.0, 0.0])
    for _ in range(ulps):
        source[0] = np.nextafter(source[0], 3.0)
    directions = tuple(np.array([[0.0, 1e-4, 0.0], [0.0, 0.0, 1e-4], [-1.0, 0.0, 0.0]]))
    near, far = np.zeros((16, 16)), np.zeros((16, 16))
    kernels.depth_ranges(np.zeros((1, 3)), np.full(3, 2.0), source, directions, near, far)
    assert (near <= 1e-9).all() and (far >= 4).all()


def test_a_grid_without_a_cell_is_refused():
    body, backend = sparse_body(1), numba_backend()
    camera, pose = random_view(1, body)
    rays = index_rays(body, camera, pose, (0, 2, 0, 2), STEP)
    field = IndexField(np.zeros((1, 2, 2, 3), np.float32), np.ones(3), np.zeros(3), np.zeros(3), np.ones(3))
    with pytest.raises(ValueError, match="no cell"):
        backend.project_warped(body.voxels, field, rays)


def test_what_is_not_a_number_is_not_hidden_by_the_hint():
    body, backend = sparse_body(2), numba_backend()
    camera, pose = random_view(2, body)
    rays = index_rays(body, camera, pose, (0, 4, 0, 4), STEP)
    rays.source[0] = np.nan
    hinted, _ = backend.project(body.voxels, rays, False, body.occupied)
    plain, _ = backend.project(body.voxels, rays, False)
    np.testing.assert_array_equal(hinted, plain)


@pytest.mark.parametrize("order", ["C", "F"])
def test_a_body_lays_its_voxels_out_for_the_kernels(order):
    body = sparse_body(3)
    other = Body(np.array(body.voxels, np.float64, order=order), body.affine, body.centre)
    assert other.voxels.flags.c_contiguous and other.voxels.dtype == np.float32
    np.testing.assert_array_equal(other.voxels, body.voxels)
