"""First and second order ascent of a similarity, on small arrays of pose parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

ROTATION_RATE = 1e-2
TRANSLATION_RATE = 1.0
"""Step sizes of the paper: rad and mm per iteration."""

LARGEST_STEP = (0.15, 12.0)
"""Rotation (rad) and translation (mm) of one second-order step at most."""


class Adam:
    """Adaptive moments (D. Kingma and J. Ba, "Adam: a method for stochastic optimization", ICLR 2015), upwards.

    rates: step sizes, broadcast to the parameters; decay: of the first and second moments; floor: added to the
    root of the second moment. The moments live as long as the object: hand it from level to level to keep them.
    """

    def __init__(
        self, rates: np.ndarray | float, decay: tuple[float, float] = (0.9, 0.999), floor: float = 1e-8
    ) -> None:
        self.rates = np.asarray(rates, np.float64)
        self.decay, self.floor = decay, floor
        self.steps = 0
        self._mean: np.ndarray | float = 0.0
        self._square: np.ndarray | float = 0.0

    def ascend(self, parameters: np.ndarray, gradient: np.ndarray) -> np.ndarray:
        """Parameters after one step towards larger values; gradient: of their shape."""
        first, second = self.decay
        self.steps += 1
        self._mean = first * self._mean + (1 - first) * gradient
        self._square = second * self._square + (1 - second) * gradient**2
        mean = self._mean / (1 - first**self.steps)
        square = self._square / (1 - second**self.steps)
        return parameters + self.rates * mean / (np.sqrt(square) + self.floor)


def pose_rates() -> np.ndarray:
    """(6,) step sizes of the paper for [rotation (rad), translation (mm)]."""
    return np.array([ROTATION_RATE] * 3 + [TRANSLATION_RATE] * 3)


@dataclass(frozen=True)
class Expansion:
    """value: of the similarity; gradient: (P,); curvature: (P, P), of the similarity's fall, positive semidefinite."""

    value: float
    gradient: np.ndarray
    curvature: np.ndarray


def climb(
    expand: Callable[[np.ndarray], Expansion],
    value: Callable[[np.ndarray], float],
    parameters: np.ndarray,
    iterations: int,
    before_step: Callable[[int, np.ndarray, float], None],
    tolerance: float = 1e-5,
) -> np.ndarray:
    """Levenberg-Marquardt on a similarity whose curvature is known to first order (Gauss-Newton).

    Args:
        expand: value, gradient and curvature at parameters (P,).
        value: the value alone.
        parameters: (P,) six numbers [rotation (rad), translation (mm)] each, where to start.
        iterations: accepted steps at most.
        before_step: called with the iteration, the parameters and the value; may raise to cancel.
        tolerance: rise of the value that counts as none; two of them in a row end the climb.

    Returns:
        (P,) parameters.

    """
    damping, small = 1e-2, 0
    for iteration in range(iterations):
        here = expand(parameters)
        before_step(iteration, parameters, here.value)
        for _ in range(8):
            trial = parameters + _damped_step(here, damping)
            reached = value(trial)
            if reached > here.value:
                break
            damping = min(damping * 4, 1e6)
        else:
            return parameters
        parameters = trial
        damping = max(damping / 3, 1e-6)
        small = small + 1 if reached - here.value < tolerance else 0
        if small >= 2:
            break
    return parameters


def _damped_step(here: Expansion, damping: float) -> np.ndarray:
    """Step (P,), every body's part of it shortened to LARGEST_STEP."""
    diagonal = np.diag(here.curvature)
    floor = max(float(diagonal.max()), 1e-12) * 1e-9
    damped = here.curvature + np.diag(damping * np.maximum(diagonal, floor) + floor)
    step = np.linalg.solve(damped, here.gradient).reshape(-1, 2, 3)
    excess = (np.linalg.norm(step, axis=2) / LARGEST_STEP).max(axis=1)
    return (step / np.maximum(excess, 1)[:, None, None]).ravel()
