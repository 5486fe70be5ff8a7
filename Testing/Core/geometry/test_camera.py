"""The camera's conventions, stated as properties over random cameras."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import (
    Camera,
    focal_length_px,
    intrinsics_matrix,
    look_at,
    require_intrinsics,
    review_camera,
)
from PolyPoseLib.geometry.rigid import is_real_number, real_array, require_rigid, rigid_inverse

SEEDS = range(5)


def random_extrinsic(rng):
    extrinsic = np.eye(4)
    extrinsic[:3, :3] = Rotation.random(random_state=int(rng.integers(1 << 30))).as_matrix()
    extrinsic[:3, 3] = rng.normal(size=3) * 50 + (0, 0, 700)
    return extrinsic


def random_camera(rng, height=24, width=36):
    intrinsics = intrinsics_matrix(rng.uniform(900, 1200), rng.uniform(0.2, 2, size=2), height, width)
    intrinsics[:2, 2] += rng.normal(size=2) * 3
    return Camera(intrinsics, random_extrinsic(rng), height, width)


@pytest.mark.parametrize("seed", SEEDS)
def test_points_along_a_pixel_direction_project_to_that_pixel(seed):
    rng = np.random.default_rng(seed)
    camera = random_camera(rng)
    depth = rng.uniform(100, 1000, size=(camera.height, camera.width))
    points = camera.source + depth[..., None] * camera.pixel_directions()
    row, column = np.indices((camera.height, camera.width))
    np.testing.assert_allclose(camera.project(points), np.stack([column, row], -1), atol=1e-9)
    np.testing.assert_allclose(camera.depth(points), depth, rtol=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
def test_projection_is_k_times_rx_plus_t(seed):
    rng = np.random.default_rng(seed)
    camera = random_camera(rng)
    point = camera.source + 500 * camera.axis + rng.normal(size=3) * 20
    expected = camera.intrinsics @ (camera.extrinsic[:3, :3] @ point + camera.extrinsic[:3, 3])
    np.testing.assert_allclose(camera.project(point[None])[0], expected[:2] / expected[2], rtol=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
def test_source_is_the_camera_frames_origin(seed):
    camera = random_camera(np.random.default_rng(seed))
    np.testing.assert_allclose(camera.extrinsic @ np.append(camera.source, 1), (0, 0, 0, 1), atol=1e-9)
    assert abs(camera.depth(camera.source)) < 1e-9


def test_points_at_or_behind_the_source_are_nan():
    camera = random_camera(np.random.default_rng(0))
    assert np.isnan(camera.project(camera.source - 10 * camera.axis)).all()


@pytest.mark.parametrize("factor", [1, 2, 3, 5])
def test_binned_camera_sees_the_mean_of_each_blocks_pixels(factor):
    rng = np.random.default_rng(factor)
    camera = random_camera(rng)
    binned = camera.binned(factor)
    rows, columns = camera.height // factor, camera.width // factor
    assert (binned.height, binned.width) == (rows, columns)
    blocks = camera.pixel_directions()[: rows * factor, : columns * factor]
    blocks = blocks.reshape(rows, factor, columns, factor, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(binned.pixel_directions(), blocks, atol=1e-12)
    np.testing.assert_allclose(binned.source, camera.source)


def test_cropped_camera_keeps_the_rays():
    camera = random_camera(np.random.default_rng(1))
    crop = camera.cropped(3, 20, 5, 31)
    np.testing.assert_allclose(crop.pixel_directions(), camera.pixel_directions()[3:20, 5:31], atol=1e-12)


def test_review_camera_is_small_and_sees_the_same():
    big = Camera([[5000, 0, 500], [0, 5000, 400], [0, 0, 1]], np.eye(4), 801, 1001)
    small, factor = review_camera(big, 200)
    assert max(small.height, small.width) <= 200
    point = np.array([10.0, 5.0, 700.0])
    np.testing.assert_allclose((small.project(point) + 0.5) * factor - 0.5, big.project(point))
    with pytest.raises(InputError):
        review_camera(big, 0)


@pytest.mark.parametrize("seed", SEEDS)
def test_an_image_on_a_plane_projects_onto_its_own_pixels(seed):
    rng = np.random.default_rng(seed)
    camera, depth = random_camera(rng), rng.uniform(100, 1500)
    pixels = np.column_stack([rng.uniform(0, 50, (7, 2)), np.zeros(7), np.ones(7)])
    points = (pixels @ camera.plane_at(depth).T)[:, :3]
    np.testing.assert_allclose(camera.project(points), pixels[:, :2], atol=1e-6)
    np.testing.assert_allclose(camera.depth(points), depth, rtol=1e-9)
    plane = camera.plane_at(depth)
    np.testing.assert_allclose(plane[:3, 2], camera.axis * np.linalg.norm(plane[:3, 0]), atol=1e-9)


def test_focal_length_pairs_columns_with_x():
    assert focal_length_px(1000, (0.5, 0.25)) == (4000, 2000)
    assert focal_length_px(1000, 0.5) == (2000, 2000)


def test_centred_principal_point_is_between_the_first_and_last_pixel():
    assert intrinsics_matrix(1000, 1, 11, 20)[:2, 2].tolist() == [9.5, 5]


def test_look_at_puts_the_target_at_the_principal_point_and_up_upward():
    extrinsic = look_at((0, -800, 30), (5, 10, 20))
    camera = Camera(intrinsics_matrix(1000, 1, 101, 101), extrinsic, 101, 101)
    np.testing.assert_allclose(camera.project((5, 10, 20)), (50, 50), atol=1e-9)
    np.testing.assert_allclose(camera.source, (0, -800, 30), atol=1e-9)
    assert camera.project((5, 10, 40))[1] < 50


@pytest.mark.parametrize("seed", SEEDS)
def test_rigid_inverse(seed):
    extrinsic = random_extrinsic(np.random.default_rng(seed))
    np.testing.assert_allclose(rigid_inverse(extrinsic) @ extrinsic, np.eye(4), atol=1e-12)


def test_a_rounded_rotation_is_made_exact():
    rounded = np.round(random_extrinsic(np.random.default_rng(3)), 5)
    exact = require_rigid(rounded)
    np.testing.assert_allclose(exact[:3, :3] @ exact[:3, :3].T, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(exact, rounded, atol=1e-4)


def scaled():
    return np.diag([1.1, 1, 1, 1.0])


@pytest.mark.parametrize(
    ("matrix", "word"),
    [
        (np.eye(3), "4x4"),
        (scaled(), "not rigid"),
        (np.diag([1, 1, -1, 1]), "reflection"),
        (np.full((4, 4), np.nan), "NaN"),
        (np.eye(4) + np.eye(4)[[3, 0, 1, 2]] * 0.5, "last row"),
        ("identity", "numbers"),
    ],
)
def test_a_matrix_that_is_not_rigid_is_refused_by_name(matrix, word):
    with pytest.raises(InputError, match=word) as error:
        require_rigid(matrix, "xrays[0].extrinsic")
    assert "xrays[0].extrinsic" in str(error.value)


@pytest.mark.parametrize(
    "change",
    [
        {"height": 0},
        {"width": 2.5},
        {"width": "4"},
        {"intrinsics": np.diag([-1.0, 1, 1])},
        {"intrinsics": np.eye(4)},
        {"intrinsics": np.diag([1.0, 1, 2])},
        {"extrinsic": scaled()},
    ],
)
def test_an_invalid_camera_cannot_exist(change):
    valid = {"intrinsics": np.eye(3), "extrinsic": np.eye(4), "height": 4, "width": 4}
    Camera(**valid | {"height": np.int64(4)})
    with pytest.raises(InputError):
        Camera(**(valid | change))


@pytest.mark.parametrize("bad", [(0, 0.4), 0, -1, "x", (1, 2, 3), float("nan")])
def test_a_bad_spacing_is_refused(bad):
    with pytest.raises(InputError, match="pixel_spacing_mm"):
        focal_length_px(1000, bad)


@pytest.mark.parametrize("bad", [0, -5, float("nan")])
def test_a_bad_distance_is_refused(bad):
    with pytest.raises(InputError, match="source_to_detector_mm"):
        focal_length_px(bad, 0.5)


@pytest.mark.parametrize("factor", [0, 25, 1.5])
def test_a_bad_binning_factor_is_refused(factor):
    with pytest.raises(InputError, match="binning"):
        random_camera(np.random.default_rng(0)).binned(factor)


def test_a_crop_outside_the_image_is_refused():
    with pytest.raises(InputError, match="crop"):
        random_camera(np.random.default_rng(0)).cropped(0, 25, 0, 3)


def test_a_camera_cannot_be_changed():
    camera = random_camera(np.random.default_rng(0))
    with pytest.raises(ValueError, match="read-only"):
        camera.intrinsics[0, 0] = 5


BIG = 10**400
K = [[400.0, 0, 31], [0, 400, 31], [0, 0, 1]]


@pytest.mark.parametrize(
    "value", [BIG, -BIG, True, np.True_, "3", b"3", None, 1j, [3], {}, float("nan"), float("inf")]
)
def test_what_is_no_number_never_enters_a_camera(value):
    assert not is_real_number(value)
    for row in range(2):
        matrix = np.eye(4).tolist()
        matrix[row][3] = value
        with pytest.raises(InputError, match="the pose"):
            require_rigid(matrix, "the pose")
        intrinsics = [list(each) for each in K]
        intrinsics[row][2] = value
        with pytest.raises(InputError, match="the K"):
            require_intrinsics(intrinsics, "the K")
    for spacing in ([value, 1], [1, value], value):
        if spacing == [3]:
            continue
        with pytest.raises(InputError, match="pixel_spacing_mm") as error:
            focal_length_px(1000, spacing)
        assert len(str(error.value)) < 200
    with pytest.raises(InputError, match="source_to_detector_mm"):
        focal_length_px(value, 1.0)


def test_numbers_of_thousands_of_digits_can_be_refused():
    with pytest.raises(InputError, match="very many digits"):
        focal_length_px(10**5000, 1.0)


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.int64, np.uint8, object])
def test_arrays_and_lists_of_numbers_are_copied(dtype):
    values = np.arange(12).reshape(3, 4).astype(dtype)
    for given in (values, values.tolist(), tuple(values), [list(row) for row in values]):
        found = real_array(given)
        assert found.dtype == np.float64 and np.array_equal(found, np.arange(12).reshape(3, 4))
        found[:] = -1
    assert values[0, 1] == 1


@pytest.mark.parametrize("distance", [1e8, 1e300])
def test_a_pose_beyond_all_distances_is_refused(distance):
    matrix = np.eye(4)
    matrix[1, 3] = -distance
    with pytest.raises(InputError, match="millimetres"):
        require_rigid(matrix)
