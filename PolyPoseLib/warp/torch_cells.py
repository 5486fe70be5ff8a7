"""Nodes of grids, and the cells between them in which points lie, in torch on a CPU or a GPU."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor


@dataclass(frozen=True)
class Cells:
    """The cells of a grid that hold N points.

    Attributes
    ----------
    corners : (8, N) tensor of int64
        Flat numbers of their corners; bit 0 of the first index says which end along i, bit 1 along j, bit 2 along k.
    fractions : (N, 3) tensor
        Where in its cell each point lies, 0 to 1 along (i, j, k).

    """

    corners: Tensor
    fractions: Tensor

    @classmethod
    def holding(cls, places: Tensor, shape: tuple[int, int, int]) -> Cells:
        """Cells of a grid of nodes (k, j, i) that hold places (N, 3) in the order (i, j, k), clamped to the grid."""
        numbers, fractions, stride = torch.zeros_like(places[None, :, 0], dtype=torch.int64), [], 1
        for axis, size in enumerate(shape[::-1]):
            place = places[:, axis].clamp(0, size - 1)
            low = place.long().clamp(max=max(size - 2, 0))
            ends = torch.stack([low, (low + 1).clamp(max=size - 1)]) * stride
            numbers = (ends[:, None] + numbers).flatten(0, 1)
            fractions.append(place - low)
            stride *= size
        return cls(numbers, torch.stack(fractions, dim=1))

    def shares(self) -> Tensor:
        """(8, N) weights of the corners, which sum to 1."""
        shares = torch.ones_like(self.fractions[None, :, 0])
        for part in self.fractions.unbind(1):
            shares = (torch.stack([1 - part, part])[:, None] * shares).flatten(0, 1)
        return shares

    def interpolated(self, values: Tensor) -> Tensor:
        """Trilinear values (N, ...) of (V, ...) at the nodes in one row."""
        found = values[self.corners]
        for part in self.fractions.unbind(1):
            part = part.reshape(-1, *[1] * (found.ndim - 2))
            found = found[0::2] + part * (found[1::2] - found[0::2])
        return found[0]


def nodes_on_device(
    affine: np.ndarray, shape: tuple[int, int, int], numbers: range, device: torch.device | None
) -> Tensor:
    """Points (N, 3) float64 of some nodes of a grid, in the order in which numpy lays out (k, j, i).

    affine: (3, 4) or (4, 4), index (i, j, k) to what the points are in; shape: nodes (k, j, i); numbers: which of them.
    """
    flat = torch.arange(numbers.start, numbers.stop, device=device)
    row = flat // shape[2]
    index = torch.stack([flat % shape[2], row % shape[1], row // shape[1]], dim=1).double()
    return transformed(torch.as_tensor(affine, dtype=torch.float64, device=device), index)


def transformed(affine: Tensor, points: Tensor) -> Tensor:
    """Points (N, 3) under an affine map (3, 4) or (4, 4) of their type."""
    return torch.addmm(affine[:3, 3], points, affine[:3, :3].T)
