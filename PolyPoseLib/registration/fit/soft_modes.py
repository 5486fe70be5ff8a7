"""Smooth displacements of the soft tissue beside those that follow from the bones, as few numbers with a prior.

Breathing, a full bladder or a body that lies otherwise move organs and skin whatever the bones do. Such a displacement
is smooth and of limited size: a Gaussian process with a squared exponential covariance, in the reduced rank of cosines
on a box (A. Solin and S. Sarkka, "Hilbert space methods for reduced-rank Gaussian process regression", Statistics and
Computing 30, 2020).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

DEVIATION_MM = 8.0
"""Standard deviation of each component of the displacement, in the mean over the box; two thirds of it inside."""

LENGTH_MM = 80.0
"""Length scale of its covariance: displacements this far apart are correlated by 0.6."""

LEAST_VARIANCE = 0.02
"""Modes with a smaller share of the largest variance are left out."""


@dataclass(frozen=True)
class SoftModes:
    """M cosines on the box of a grid, which it exceeds by half a length scale on every side.

    Parameters
    ----------
    affine : (4, 4) ndarray
        Index (i, j, k) of the grid to LPS mm, orthogonal axes.
    shape : (int, int, int)
        Nodes (k, j, i).
    numbers : (M, 3) ndarray
        Half periods along the axes i, j, k.
    variances : (M,) ndarray
        Of the coefficients a priori, mm^2.

    """

    affine: np.ndarray
    shape: tuple[int, int, int]
    numbers: np.ndarray
    variances: np.ndarray

    @classmethod
    def covering(cls, affine: np.ndarray, shape: tuple[int, int, int]) -> SoftModes:
        """The modes that a grid needs."""
        edges = _edges(affine, shape)
        along = [np.arange(int(3.2 * edge / (np.pi * LENGTH_MM)) + 2) for edge in edges]
        density = [
            np.exp(-0.5 * (LENGTH_MM * np.pi * number / edge) ** 2) * np.where(number == 0, 1, 2)
            for number, edge in zip(along, edges, strict=True)
        ]
        variances = np.einsum("i,j,k->ijk", *density)
        numbers = np.argwhere(variances > LEAST_VARIANCE * variances.max())
        variances = variances[tuple(numbers.T)]
        squares = np.where(numbers == 0, 1.0, 0.5).prod(axis=1)  # mean squares of the cosines
        return cls(affine, shape, numbers, variances * DEVIATION_MM**2 / (variances @ squares))

    @property
    def count(self) -> int:
        """M."""
        return len(self.numbers)

    @property
    def to_angles(self) -> np.ndarray:
        """(3, 4) takes LPS mm to the angles (rad) along i, j, k of which a mode's cosines take multiples."""
        spacing, edges = np.linalg.norm(self.affine[:3, :3], axis=0), _edges(self.affine, self.shape)
        to_angles = np.linalg.inv(self.affine)[:3] * (np.pi * spacing / edges)[:, None]
        to_angles[:, 3] += np.pi * LENGTH_MM / 2 / edges
        return to_angles

    def at(self, points: np.ndarray) -> np.ndarray:
        """Values (N, M) float32 of the modes at points (N, 3) LPS mm."""
        inverse = np.linalg.inv(self.affine)
        index = points @ inverse[:3, :3].T + inverse[:3, 3]
        along = [self._cosines(axis, index[:, axis]) for axis in range(3)]
        first, second, third = (table[:, self.numbers[:, axis]] for axis, table in enumerate(along))
        return first * second * third

    def on_grid(
        self,
        coefficients: np.ndarray,
        affine: np.ndarray,
        shape: tuple[int, int, int],
        device: torch.device | None = None,
    ) -> np.ndarray:
        """Sum of the modes at the nodes of a grid with the same axes.

        Parameters
        ----------
        coefficients : (M, 3) ndarray
            mm along LPS x, y, z.
        affine : (4, 4) ndarray
            Index (i, j, k) of the grid to LPS mm.
        shape : (int, int, int)
            Its nodes (k, j, i).
        device : torch.device, optional
            Where torch sums; None for numpy.

        Returns
        -------
        (k, j, i, 3) ndarray
            float32, mm.

        """
        full = np.zeros((*(self.numbers.max(axis=0) + 1), 3), np.float32)
        full[tuple(self.numbers.T)] = coefficients
        to_own = np.linalg.inv(self.affine) @ affine
        i, j, k = (
            self._cosines(axis, to_own[axis, axis] * np.arange(shape[2 - axis]) + to_own[axis, 3])
            for axis in range(3)
        )
        if device is None:
            return _summed(np.einsum, (i, j, k), full)
        i, j, k, full = (torch.as_tensor(each, device=device) for each in (i, j, k, full))
        return _summed(torch.einsum, (i, j, k), full).cpu().numpy()

    def _cosines(self, axis: int, index: np.ndarray) -> np.ndarray:
        """(N, numbers along the axis) float32 at indices (N,) along it."""
        spacing = np.linalg.norm(self.affine[:3, axis])
        edge = _edges(self.affine, self.shape)[axis]
        place = (index * spacing + LENGTH_MM / 2) / edge
        frequencies = np.pi * np.arange(self.numbers[:, axis].max() + 1)
        return np.cos(place[:, None] * frequencies).astype(np.float32)


def _summed(einsum: Callable, cosines: Sequence, full: Any) -> Any:
    """Sum over all numbers along i, j and k, by numpy's or torch's einsum and their arrays; see on_grid."""
    partly = einsum("xa,abcd->xbcd", cosines[0], full)
    partly = einsum("yb,xbcd->yxcd", cosines[1], partly)
    return einsum("zc,yxcd->zyxd", cosines[2], partly)


def _edges(affine: np.ndarray, shape: tuple[int, int, int]) -> np.ndarray:
    """(3,) mm, edges of the cosines' box."""
    return (np.array(shape[::-1]) - 1) * np.linalg.norm(affine[:3, :3], axis=0) + LENGTH_MM
