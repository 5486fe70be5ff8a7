"""Adam, the optimiser of the published method, on small arrays of pose parameters."""

from __future__ import annotations

import numpy as np

ROTATION_RATE = 1e-2
TRANSLATION_RATE = 1.0
"""Step sizes of the paper: rad and mm per iteration."""


class Adam:
    """Adaptive moments, upwards; they live as long as the object: hand it from level to level to keep them.

    Parameters
    ----------
    rates : float or ndarray
        Step sizes, broadcast to the parameters.
    decay : tuple of float
        Of the first and second moments.
    floor : float
        Added to the root of the second moment.

    References
    ----------
    D. Kingma and J. Ba, "Adam: a method for stochastic optimization", ICLR 2015.

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
