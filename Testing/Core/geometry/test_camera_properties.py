"""What holds for every camera: back-projection, parts and blocks of the image, changes of the world frame, C-arms."""

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st
from strategies import cameras, motions

from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.carm import PATIENT_POSITIONS, carm_angles, carm_extrinsic, with_isocenter
from PolyPoseLib.geometry.rigid import rigid_inverse


def assert_same(found: Camera, expected: Camera) -> None:
    np.testing.assert_allclose(found.intrinsics, expected.intrinsics, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(found.extrinsic, expected.extrinsic, atol=1e-9)
    assert (found.height, found.width) == (expected.height, expected.width)


@given(cameras(), st.floats(10, 5000))
def test_points_on_the_ray_of_a_pixel_project_to_it_and_have_their_depth(
    camera: Camera, depth: float
) -> None:
    points = camera.source + depth * camera.pixel_directions()
    row, column = np.indices((camera.height, camera.width))
    np.testing.assert_allclose(camera.project(points), np.stack([column, row], -1), atol=1e-6)
    np.testing.assert_allclose(camera.depth(points), depth, rtol=1e-9)


@given(cameras(), motions())
def test_moving_world_and_camera_together_changes_no_projection(camera: Camera, motion: np.ndarray) -> None:
    points = camera.source + 700 * camera.pixel_directions().reshape(-1, 3)[:20]
    moved = camera.with_extrinsic(camera.extrinsic @ rigid_inverse(motion))
    there = points @ motion[:3, :3].T + motion[:3, 3]
    np.testing.assert_allclose(moved.project(there), camera.project(points), atol=1e-5)


@given(cameras(smallest=6), st.integers(1, 3), st.integers(1, 2))
def test_binning_twice_is_binning_by_the_product(camera: Camera, first: int, second: int) -> None:
    assert_same(camera.binned(first).binned(second), camera.binned(first * second))


@given(cameras(smallest=6), st.integers(1, 3))
def test_a_block_of_pixels_looks_where_its_pixels_look_on_average(camera: Camera, factor: int) -> None:
    binned = camera.binned(factor)
    rays = camera.pixel_directions()[: binned.height * factor, : binned.width * factor]
    blocks = rays.reshape(binned.height, factor, binned.width, factor, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(binned.pixel_directions(), blocks, atol=1e-9)


@given(cameras(smallest=8), st.data())
def test_cropping_keeps_rays_and_crops_compose(camera: Camera, data: st.DataObject) -> None:
    row, column = data.draw(st.integers(0, camera.height - 4)), data.draw(st.integers(0, camera.width - 4))
    part = camera.cropped(row, camera.height, column, camera.width)
    np.testing.assert_allclose(part.pixel_directions(), camera.pixel_directions()[row:, column:], atol=1e-9)
    again = part.cropped(1, part.height, 2, part.width)
    assert_same(again, camera.cropped(row + 1, camera.height, column + 2, camera.width))


@given(cameras(smallest=12), st.integers(2, 3), st.integers(0, 2), st.integers(0, 2))
def test_cropping_whole_blocks_and_binning_commute(
    camera: Camera, factor: int, row: int, column: int
) -> None:
    rows, columns = camera.height // factor, camera.width // factor
    assume(row < rows and column < columns)
    cropped = camera.cropped(row * factor, rows * factor, column * factor, columns * factor).binned(factor)
    assert_same(cropped, camera.binned(factor).cropped(row, rows, column, columns))


@given(
    st.floats(-179, 179),
    st.floats(-89, 89),
    st.floats(-179, 179),
    st.sampled_from(PATIENT_POSITIONS),
    st.tuples(*[st.floats(-300, 300)] * 3),
)
def test_the_angles_of_a_carm_come_back(
    primary: float, secondary: float, rotation: float, position: str, isocenter: tuple[float, ...]
) -> None:
    extrinsic = carm_extrinsic(primary, secondary, 750, isocenter, position, detector_rotation_deg=rotation)
    found = carm_angles(extrinsic, position)
    wanted = (primary, secondary, rotation)
    difference = np.subtract((found.primary_deg, found.secondary_deg, found.detector_rotation_deg), wanted)
    np.testing.assert_allclose((difference + 180) % 360 - 180, 0, atol=1e-6)
    seen = extrinsic[:3, :3] @ isocenter + extrinsic[:3, 3]
    np.testing.assert_allclose(seen, (0, 0, 750), atol=1e-9)
    moved = with_isocenter(extrinsic, isocenter, (1, 2, 3))
    np.testing.assert_allclose(moved[:3, :3] @ (1, 2, 3) + moved[:3, 3], (0, 0, 750), atol=1e-9)
