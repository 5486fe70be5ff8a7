"""The size of the soft tissue's own motion, and the motion that is likeliest with it."""

import numpy as np
import pytest

from PolyPoseLib.registration.fit.soft_size import LEAST_SIZE, MotionEquations

SEEDS = range(6)
MODES = 40


def equations(seed, size_mm, noise=0.01):
    """Of linear observations of coefficients that have this standard deviation along LPS x, y, z, with noise."""
    rng = np.random.default_rng(seed)
    variances = np.full(MODES, 64.0)
    truth = rng.normal(size=(MODES, 3)) * size_mm
    jacobian = rng.normal(size=(400, 3 * MODES)) * 0.05
    seen = jacobian @ truth.reshape(-1) + rng.normal(0, np.sqrt(noise), 400)
    return MotionEquations(jacobian.T @ jacobian, jacobian.T @ seen, variances, noise), truth, jacobian, seen


@pytest.mark.parametrize("seed", SEEDS)
def test_the_likeliest_motion_is_ridge_regression_of_that_size(seed):
    found, _, jacobian, seen = equations(seed, [4.0, 1.0, 2.0])
    deviations = np.sqrt(64.0 * np.tile(found.sizes, MODES))
    # Whitened, and solved by another formula: as many unknown residuals as observations.
    scaled = jacobian * deviations
    oracle = deviations * (
        scaled.T @ np.linalg.solve(scaled @ scaled.T + found.noise * np.eye(len(seen)), seen)
    )
    np.testing.assert_allclose(found.likeliest.reshape(-1), oracle, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_it_is_nearer_to_the_truth_than_with_the_wide_prior(seed):
    found, truth, _, _ = equations(seed, [0.5, 0.5, 0.5], noise=1.0)
    wide = np.linalg.solve(found.matrix + np.diag(found.prior(np.ones(3))), found.right).reshape(-1, 3)
    assert np.linalg.norm(found.likeliest - truth) < 0.8 * np.linalg.norm(wide - truth)


@pytest.mark.parametrize("seed", SEEDS)
def test_little_moves_where_the_observations_are_noise(seed):
    found, _, _, _ = equations(seed, [0.0, 0.0, 0.0], noise=1.0)
    wide = np.linalg.solve(found.matrix + np.diag(found.prior(np.ones(3))), found.right).reshape(-1, 3)
    assert (found.sizes == LEAST_SIZE).all()
    assert np.linalg.norm(found.likeliest) < 0.4 * np.linalg.norm(wide)
