"""Adam against torch's own."""

import numpy as np
import pytest
import torch

from PolyPoseLib.baselines.published.adam import Adam, pose_rates


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
