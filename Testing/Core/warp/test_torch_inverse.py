"""The inverse of a displacement field and its determinants by torch on a device: those of the compiled loops."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.warp.dense import jacobian_determinant
from PolyPoseLib.warp.inverse import invert_field
from PolyPoseLib.warp.on_bones import fitted_to_bones
from PolyPoseLib.warp.unfold import unfolded


def field_of(seed: int, size: float = 60.0, shape: tuple[int, int, int] = (14, 17, 15)) -> DisplacementField:
    """Smooth displacements on an oblique grid of either handedness."""
    rng = np.random.default_rng(seed)
    affine = np.eye(4)
    turn = Rotation.random(random_state=seed).as_matrix()
    affine[:3, :3] = turn @ np.diag([3.0, -3.0 if seed % 2 else 3.0, 4.0])
    affine[:3, 3] = rng.normal(0, 50, 3)
    vectors = np.stack([gaussian_filter(rng.normal(size=shape), 3) for _ in range(3)], axis=-1)
    return DisplacementField((vectors * size).astype(np.float32), affine)


@pytest.mark.parametrize("seed", range(4))
def test_the_inverse_is_that_of_the_loops(seed, gpu):
    field = field_of(seed)
    loops, found = invert_field(field, tolerance_mm=1e-5), invert_field(field, tolerance_mm=1e-5, device=gpu)
    sure = loops.residual_mm < 1e-5
    assert sure.mean() > 0.8 and np.linalg.norm(loops.field.vectors, axis=-1).max() > 2
    np.testing.assert_allclose(found.field.vectors[sure], loops.field.vectors[sure], atol=1e-4)
    np.testing.assert_allclose(found.residual_mm, loops.residual_mm, atol=1e-4)


def test_points_without_an_inverse_keep_the_least_residual(gpu):
    folds = field_of(0, size=900.0)
    loops, found = invert_field(folds), invert_field(folds, device=gpu)
    assert loops.largest_residual_mm > 1
    close = np.isclose(found.residual_mm, loops.residual_mm, atol=1e-3)
    assert close.mean() > 0.98  # rounding may choose another branch where a field folds
    aside = field_of(1)
    affine = aside.affine.copy()
    affine[:3, 3] += 7.0
    wanted = {"affine": affine, "shape": (4, 3, 5), "iterations": 7}
    loops, found = invert_field(aside, **wanted), invert_field(aside, **wanted, device=gpu)
    np.testing.assert_allclose(found.field.vectors, loops.field.vectors, atol=1e-3)


@pytest.mark.parametrize("shape", [(14, 17, 15), (2, 3, 2), (5, 2, 9)])
@pytest.mark.parametrize("seed", range(3))
def test_determinants_are_those_of_the_loops(seed, shape, gpu):
    field = field_of(seed, shape=shape)
    np.testing.assert_allclose(
        jacobian_determinant(field, gpu), jacobian_determinant(field), rtol=1e-5, atol=1e-5
    )


def test_folds_are_found_on_the_device(gpu):
    folds = field_of(2, size=200.0, shape=(26, 26, 26))
    assert (jacobian_determinant(folds) <= 0).any()

    def nothing(points: np.ndarray) -> np.ndarray:
        return np.zeros(len(points), bool)

    np.testing.assert_allclose(
        unfolded(folds, nothing, gpu).vectors, unfolded(folds, nothing).vectors, atol=1e-4
    )
    labels = np.zeros((20, 20, 20), np.int16)
    labels[4:16, 4:16, 4:16] = 1
    bones = Volume(labels, np.diag([2.0, 2.0, 2.0, 1.0]))
    poses = np.eye(4)[None].copy()
    poses[0, :3, 3] = (2.0, -1.0, 1.5)
    still = DisplacementField(np.zeros((18, 18, 18, 3), np.float32), np.diag([3.0, 3.0, 3.0, 1.0]))
    found = fitted_to_bones(still, bones, poses, gpu)
    np.testing.assert_allclose(found.vectors, fitted_to_bones(still, bones, poses).vectors, atol=1e-5)
    assert np.abs(found.vectors).max() > 1
