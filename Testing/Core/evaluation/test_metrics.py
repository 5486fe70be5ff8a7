"""Measures on shapes whose answers are known by hand or by a slow reference."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from PolyPoseLib.errors import InputError
from PolyPoseLib.evaluation.metrics import (
    dice,
    dice_per_label,
    fold_percentage,
    hausdorff95,
    mask_points,
    projection_error_mm,
    sd_log_jacobian,
    silhouette_dice,
    structure_errors,
    surface_points,
    target_registration_error,
)
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.grid import bounding_box


def rigid(seed, angle_deg=10.0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_rotvec(np.radians(angle_deg) * rng.normal(size=3)).as_matrix()
    matrix[:3, 3] = rng.normal(0, 10, 3)
    return matrix


def block(start, size, shape=(20, 22, 24)) -> np.ndarray:
    mask = np.zeros(shape, dtype=bool)
    mask[tuple(slice(s, s + n) for s, n in zip(start, size, strict=True))] = True
    return mask


def camera(extrinsic=None) -> Camera:
    placed = np.eye(4)
    placed[2, 3] = 800.0
    return Camera(
        np.array([[2000.0, 0, 99.5], [0, 2500.0, 79.5], [0, 0, 1]]),
        placed if extrinsic is None else extrinsic,
        160,
        200,
    )


def test_dice_of_known_overlaps():
    a, b = block((2, 2, 2), (6, 6, 6)), block((2, 2, 5), (6, 6, 6))
    assert dice(a, b) == pytest.approx(0.5)
    assert dice(a, a) == 1
    assert dice(a, ~a) == 0
    assert dice(a, b) == dice(b, a)
    assert np.isnan(dice(np.zeros(3, bool), np.zeros(3, bool)))
    assert dice_per_label(a * 3, b * 3, {3: "femur", 9: "rib"})["femur"] == pytest.approx(0.5)
    with pytest.raises(InputError, match="resample"):
        dice(a, b[1:])


def test_silhouettes_ignore_grazing_rays():
    lengths = np.zeros((8, 8))
    lengths[2:6, 2:6] = 12.0
    grazed = lengths.copy()
    grazed[1, 2:6] = 0.5
    assert silhouette_dice(lengths, grazed) == 1
    assert silhouette_dice(lengths, grazed, thickness_mm=0.1) == pytest.approx(32 / 36)


@pytest.mark.parametrize("handed", [1, -1])
def test_hausdorff_of_a_shift_is_the_shift_in_mm(handed):
    affine = np.diag([2.0 * handed, 1.0, 3.0, 1.0])
    a = block((4, 4, 4), (8, 8, 8))
    for axis, spacing in zip((2, 1, 0), (2.0, 1.0, 3.0), strict=True):
        # Two directed distances of a shifted box: the faces across the shift are `shift` away.
        assert hausdorff95(a, np.roll(a, 3, axis), affine) == pytest.approx(3 * spacing)
    assert hausdorff95(a, a, affine) == 0
    assert np.isnan(hausdorff95(a, np.zeros_like(a), affine))


def test_hausdorff_agrees_with_brute_force():
    rng = np.random.default_rng(0)
    affine = rigid(1) @ np.diag([1.0, 2.0, 1.5, 1.0])
    a, b = rng.random((2, 9, 10, 11)) > 0.7
    first, second = surface_points(a, affine), surface_points(b, affine)
    every = np.linalg.norm(first[:, None] - second[None], axis=2)
    expected = max(np.percentile(every.min(1), 95), np.percentile(every.min(0), 95))
    assert hausdorff95(a, b, affine) == pytest.approx(expected)


def test_surface_of_a_block():
    mask = block((0, 3, 3), (5, 5, 5))
    assert len(surface_points(mask, np.eye(4))) == 125 - 27
    assert bounding_box(mask) == (slice(0, 5), slice(3, 8), slice(3, 8))
    assert bounding_box(~mask & mask) is None


def test_points_of_a_mask_are_in_xyz_order():
    mask = np.zeros((3, 4, 5), dtype=bool)
    mask[2, 1, 4] = True
    assert np.array_equal(mask_points(mask, np.diag([1.0, 10, 100, 1])), [[4, 10, 200]])
    many = mask_points(~mask, np.eye(4), limit=10)
    assert len(np.unique(many, axis=0)) == 10
    assert np.array_equal(many, mask_points(~mask, np.eye(4), limit=10))


def test_target_registration_error_of_a_translation():
    shift = np.eye(4)
    shift[:3, 3] = (3, 4, 0)
    points = np.random.default_rng(0).normal(0, 100, (50, 3))
    truth = rigid(3)
    assert np.allclose(target_registration_error(points, truth, shift @ truth), 5)
    assert np.allclose(
        target_registration_error(points, truth, lambda p: p @ truth[:3, :3].T + truth[:3, 3]), 0
    )
    with pytest.raises(InputError, match="4x4"):
        target_registration_error(points, truth, np.eye(3))


def test_structure_errors_look_at_the_true_places():
    """A map that is right only where the structure really lies has no error."""
    labels = np.zeros((10, 10, 10), dtype=np.int16)
    labels[2:5, 2:5, 2:5] = 1
    labels[6:9, 6:9, 6:9] = 2
    truth = np.stack([np.eye(4), rigid(5)])
    found = structure_errors(labels, np.eye(4), ("a", "b"), truth, truth)
    assert max(found["a"]["max"], found["b"]["max"]) < 1e-9
    back = np.linalg.inv(truth[1])
    place = mask_points(labels == 2, np.eye(4)) @ back[:3, :3].T + back[:3, 3]

    def local(points):
        near = np.linalg.norm(points[:, None] - place[None], axis=2).min(axis=1) < 1e-6
        return np.where(near[:, None], points @ truth[1, :3, :3].T + truth[1, :3, 3], points)

    errors = structure_errors(labels, np.eye(4), ("a", "b"), truth, local)
    assert errors["b"]["max"] < 1e-6
    assert errors["a"]["mean"] == pytest.approx(0, abs=1e-9)
    still = structure_errors(labels, np.eye(4), ("a", "b"), truth, np.stack([np.eye(4)] * 2))
    assert still["b"]["mean"] > 1
    assert still["b"]["mean"] <= still["b"]["p95"] <= still["b"]["max"]
    assert np.isnan(structure_errors(labels * 0, np.eye(4), ("a", "b"), truth, truth)["a"]["mean"])
    with pytest.raises(InputError, match="3 structures"):
        structure_errors(labels, np.eye(4), ("a", "b", "c"), truth, truth)


def test_folds_and_spread_of_the_determinant():
    determinant = np.array([1.0, 1.0, -0.5, 0.0, np.nan, 2.0, 0.5, 1.0])
    assert fold_percentage(determinant) == pytest.approx(37.5)
    assert sd_log_jacobian(determinant) == pytest.approx(np.std([0, 0, np.log(2), -np.log(2), 0]))
    assert sd_log_jacobian(np.full((3, 3, 3), 1.0)) == 0
    assert np.isnan(sd_log_jacobian(np.array([-1.0])))


def test_projection_error_at_the_structures_scale():
    """A shift parallel to the detector has its own length there, at any depth and for unequal pixels."""
    points = np.random.default_rng(0).normal(0, 60, (40, 3))
    shift = np.array([3.0, -4.0, 0.0])
    assert np.allclose(projection_error_mm(points, camera(), found_points=points + shift), 5)
    on_detector = projection_error_mm(
        points, camera(), found_points=points + shift, scale="detector", pixel_spacing_mm=(0.4, 0.5)
    )
    assert np.allclose(on_detector, 5 * 1000 / camera().depth(points))
    assert projection_error_mm(points, camera()).max() == 0
    along = points * (1 + 20 / camera().depth(points))[:, None] * [1, 1, 0] + [0, 0, 1] * (points + 20)
    assert projection_error_mm(points, camera(), found_points=along).max() < 1e-6


def test_projection_error_of_a_wrong_camera():
    moved = np.eye(4)
    moved[:3, 3] = (2.0, 0, 800)
    points = np.zeros((1, 3))
    assert projection_error_mm(points, camera(), camera(moved))[0] == pytest.approx(2)
    behind = np.array([[0.0, 0, -900]])
    assert np.isnan(projection_error_mm(behind, camera())[0])
    with pytest.raises(InputError, match="pixel_spacing_mm"):
        projection_error_mm(points, camera(), scale="detector")
    with pytest.raises(InputError, match="structure"):
        projection_error_mm(points, camera(), scale="skin")
    with pytest.raises(InputError, match="one for each"):
        projection_error_mm(points, camera(), found_points=np.zeros((2, 3)))
