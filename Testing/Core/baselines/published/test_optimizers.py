"""Adam against torch's own, Gauss-Newton on functions whose top is known, and the curvature of gmNCC."""

import numpy as np
import pytest
import torch
from scipy.ndimage import gaussian_filter

from PolyPoseLib.baselines.published.optimizers import LARGEST_STEP, Adam, Expansion, climb, pose_rates
from PolyPoseLib.errors import CancelledError
from PolyPoseLib.similarity.gmncc_curvature import gmncc_curvature
from PolyPoseLib.similarity.ncc import gmncc


@pytest.mark.parametrize("seed", range(3))
def test_adam_is_torchs_adam_upwards(seed):
    rng = np.random.default_rng(seed)
    start, gradients = rng.normal(size=(4, 6)), rng.normal(size=(30, 4, 6)) * 10.0 ** rng.uniform(-6, 3)
    turn, shift = (torch.tensor(start[:, part]).requires_grad_() for part in (slice(0, 3), slice(3, 6)))
    groups = [{"params": [turn], "lr": 1e-2}, {"params": [shift], "lr": 1.0}]
    reference = torch.optim.Adam(groups, maximize=True)
    adam, parameters = Adam(pose_rates()), start
    for gradient in gradients:
        turn.grad, shift.grad = torch.tensor(gradient[:, :3]), torch.tensor(gradient[:, 3:])
        reference.step()
        parameters = adam.ascend(parameters, gradient)
        expected = np.concatenate([turn.detach().numpy(), shift.detach().numpy()], axis=1)
        np.testing.assert_allclose(parameters, expected, rtol=1e-12, atol=1e-12)


def test_the_first_step_has_the_size_of_the_rates():
    gradient = np.random.default_rng(0).normal(size=(5, 6))
    moved = Adam(pose_rates()).ascend(np.zeros((5, 6)), gradient)
    np.testing.assert_allclose(moved, pose_rates() * np.sign(gradient), rtol=1e-5)


def test_a_parameter_without_gradient_stays():
    adam, parameters = Adam(0.5), np.ones(3)
    for _ in range(20):
        parameters = adam.ascend(parameters, np.array([1.0, 0.0, -1.0]))
    assert parameters[1] == 1 and parameters[0] > 1 > parameters[2]


def test_moments_live_on_from_level_to_level():
    top = np.array([3.0, -2.0])

    def run(adams):
        parameters = np.zeros(2)
        for adam in adams:
            for _ in range(40):
                parameters = adam.ascend(parameters, -2 * (parameters - top))
        return parameters

    kept = Adam(0.3)
    once = run([kept, kept])
    fresh = run([Adam(0.3), Adam(0.3)])
    assert kept.steps == 80
    assert not np.array_equal(once, fresh)
    assert np.abs(once - top).max() < 0.1


def quadratic(seed, size=12):
    rng = np.random.default_rng(seed)
    factor = rng.normal(size=(size, size))
    curvature = factor @ factor.T + 0.1 * np.eye(size)
    top = rng.normal(size=size) * 0.02

    def value(x):
        return 1 - 0.5 * (x - top) @ curvature @ (x - top)

    return top, value, lambda x: Expansion(value(x), -curvature @ (x - top), curvature)


@pytest.mark.parametrize("seed", range(5))
def test_climb_reaches_the_top_of_a_quadratic_and_never_falls(seed):
    top, value, expand = quadratic(seed)
    seen = []
    found = climb(expand, value, np.zeros(12), 30, lambda n, x, v: seen.append((n, v)), tolerance=1e-12)
    np.testing.assert_allclose(found, top, atol=1e-4)
    assert [n for n, _ in seen] == list(range(len(seen)))
    assert (np.diff([v for _, v in seen]) > 0).all()


def test_a_step_is_limited_for_every_body_by_itself():
    curvature = np.eye(12) * 1e-6
    gradient = np.concatenate([np.full(6, 1.0), np.full(6, 1e-12)])
    places = []
    climb(
        lambda x: Expansion(gradient @ x, gradient, curvature),
        lambda x: gradient @ x,
        np.zeros(12),
        5,
        lambda n, x, v: places.append(x),
    )
    steps = np.diff(places, axis=0).reshape(-1, 2, 2, 3)
    sizes = np.linalg.norm(steps, axis=3)
    assert (sizes <= np.array(LARGEST_STEP) * (1 + 1e-9)).all()
    assert sizes[:, 0].max() > 0.1 and sizes[:, 1].max() < 1e-3


def test_climb_stops_when_its_caller_raises():
    _, value, expand = quadratic(0)

    def cancel(n, x, v):
        if n == 1:
            raise CancelledError("enough")

    with pytest.raises(CancelledError):
        climb(expand, value, np.zeros(12), 30, cancel)


def pictures(seed, unknowns=5, shape=(40, 44)):
    rng = np.random.default_rng(seed)
    images = gaussian_filter(rng.normal(size=(unknowns + 1, *shape)), (0, 2.5, 2.5))
    mask = np.ones(shape, bool)
    mask[:6, :9] = mask[25:31, 30:] = False
    return images[0], images[1:], mask


@pytest.mark.parametrize("seed", range(3))
def test_the_curvature_is_the_second_derivative_where_both_images_agree(seed):
    image, slopes, mask = pictures(seed)
    target, use, directions = (torch.as_tensor(x) for x in (image[None], mask, slopes))

    def fall(x):
        moved = target + torch.tensordot(x, directions, 1)[None]
        return 1 - gmncc(moved, target, use)[0]

    expected = torch.autograd.functional.hessian(fall, torch.zeros(5, dtype=torch.float64)).numpy()
    found = gmncc_curvature(image, mask, slopes)
    assert np.abs(found - expected).max() < 0.01 * np.abs(expected).max()


def test_the_curvature_is_positive_and_blind_to_gain_and_masked_pixels():
    image, slopes, mask = pictures(4)
    found = gmncc_curvature(image, mask, slopes)
    assert np.linalg.eigvalsh(found).min() > 0
    louder = gmncc_curvature(3 * image + 2, mask, 3 * slopes)
    np.testing.assert_allclose(louder, found, rtol=1e-6)
    spoilt, changed = image.copy(), slopes.copy()
    spoilt[~mask], changed[:, ~mask] = 1e3, -1e3
    np.testing.assert_allclose(gmncc_curvature(spoilt, mask, changed), found, rtol=1e-9)
    blind = gmncc_curvature(image, mask, np.concatenate([slopes, image[None]]))
    assert abs(blind[-1, -1]) < 1e-3 * found.max()  # a change of gain changes nothing
