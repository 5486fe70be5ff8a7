"""How large the soft tissue's own motion is, as the X-rays suggest it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

LEAST_SIZE, ROUNDS = 0.01, 12
"""Least share of the variances a priori, and rounds of the estimate."""


@dataclass(frozen=True, eq=False)
class MotionEquations:
    """Normal equations of the modes' coefficients (M, 3): ``matrix`` times them = ``right``, but for their prior.

    Parameters
    ----------
    matrix : (3 M, 3 M) ndarray
        Second derivative of half the images' cost.
    right : (3 M,) ndarray
        The matrix times the present coefficients, less the gradient.
    variances : (M,) ndarray
        Of the coefficients a priori, mm^2.
    noise : float
        Variance of the residual, as the images' cost counts it.

    """

    matrix: np.ndarray
    right: np.ndarray
    variances: np.ndarray
    noise: float

    def prior(self, sizes: np.ndarray) -> np.ndarray:
        """(3 M,) what the square of each coefficient costs, where its variance a priori has these shares (3,)."""
        return self.noise / (self.variances[:, None] * sizes).reshape(-1)

    @cached_property
    def sizes(self) -> np.ndarray:
        """(3,) shares of the variances a priori, along LPS x, y, z, under which the X-rays are the likeliest.

        From the largest downwards, by the fixed point of D. MacKay ("Bayesian interpolation", Neural Computation 4,
        1992). Computed when it is asked for first: each round inverts the matrix.
        """
        sizes = np.ones(3)
        for _ in range(ROUNDS):
            prior = self.prior(sizes)
            inverse = np.linalg.inv(self.matrix + np.diag(prior))
            determined = (1 - np.diag(inverse) * prior).reshape(-1, 3).sum(axis=0)
            squares = ((inverse @ self.right).reshape(-1, 3) ** 2 / self.variances[:, None]).sum(axis=0)
            sizes = np.clip(squares / np.maximum(determined, 1e-3), LEAST_SIZE, 1.0)
        return sizes

    @property
    def likeliest(self) -> np.ndarray:
        """(M, 3) mm, the coefficients where the variances a priori have the shares :attr:`sizes`."""
        return np.linalg.solve(self.matrix + np.diag(self.prior(self.sizes)), self.right).reshape(-1, 3)
