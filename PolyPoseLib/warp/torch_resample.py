"""Volumes and label maps seen through a displacement field, in torch on a CPU or a GPU.

The same values as the compiled loops of ``resample_kernel``. The output is made slab by slab, and a slab brings along
only those layers of the field and of the moving volume that it looks at.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from PolyPoseLib.warp.torch_cells import Cells, nodes_on_device
from PolyPoseLib.warp.vote import winner

VOXELS_PER_SLAB = 1 << 23
"""Voxels of the output whose part of the moving volume is on the device at once."""

VOXELS_AT_ONCE = {"cpu": 1 << 16, "cuda": 1 << 20}
"""Voxels of the output that are made at once on a device; about 600 bytes each."""

_SIGNED = {"b1": np.uint8, "u2": np.int32, "u4": np.int64, "u8": np.int64}
"""Types that torch does not index, and what they are turned into."""


@dataclass(frozen=True)
class _Look:
    """Where output voxels look, as the loops of ``resample_kernel`` take it: see there."""

    vectors: np.ndarray
    to_field: np.ndarray
    to_moving: np.ndarray
    turn: np.ndarray


@dataclass(frozen=True)
class _Block:
    """Layers of an array on the device.

    Attributes
    ----------
    values : (V, ...) tensor
        Their values in one row.
    shape : (int, int, int)
        Layers, rows and columns.
    first : int
        Number of the first layer in the whole array.

    """

    values: Tensor
    shape: tuple[int, int, int]
    first: int

    def cells(self, places: Tensor, depth: int) -> Cells:
        """Cells that hold places (N, 3) in indices of the whole array of so many layers, clamped to it."""
        layer = places[:, 2].clamp(0, depth - 1) - self.first
        return Cells.holding(torch.cat([places[:, :2], layer[:, None]], dim=1), self.shape)


class TorchResampling:
    """The functions of ``resample_kernel``, with the same arguments.

    Parameters
    ----------
    device : torch.device
        Where they compute; arrays are numpy's.

    """

    def __init__(self, device: torch.device) -> None:
        self.device = device

    def warp_linear(
        self,
        volume: np.ndarray,
        vectors: np.ndarray,
        to_field: np.ndarray,
        to_moving: np.ndarray,
        turn: np.ndarray,
        outside: float | np.floating,
        out: np.ndarray,
    ) -> None:
        """Fill out (K, J, I) float32 from volume (D, H, W) float32, trilinear."""
        beyond = self._beyond(volume.shape)

        def value(block: _Block, places: Tensor) -> Tensor:
            found = block.cells(places, len(volume)).interpolated(block.values)
            inside = ((places >= -0.5) & (places < beyond)).all(dim=1)
            return torch.where(inside, found, float(outside)).float()

        self._fill(volume, _Look(vectors, to_field, to_moving, turn), value, out)

    def warp_votes(
        self,
        labels: np.ndarray,
        vectors: np.ndarray,
        to_field: np.ndarray,
        to_moving: np.ndarray,
        turn: np.ndarray,
        out: np.ndarray,
    ) -> None:
        """Fill out (K, J, I) with the labels of largest trilinear weight."""
        beyond = self._beyond(labels.shape)

        def value(block: _Block, places: Tensor) -> Tensor:
            cells = block.cells(places, len(labels))
            found = block.values[cells.corners]
            label = found[0].clone()
            mixed = torch.nonzero((found != found[0]).any(dim=0))[:, 0]
            shares = Cells(cells.corners[:, mixed], cells.fractions[mixed]).shares()
            label[mixed] = winner(found[:, mixed], shares)
            inside = ((places > -0.5) & (places < beyond)).all(dim=1)
            return torch.where(inside, label, 0)

        self._fill(labels, _Look(vectors, to_field, to_moving, turn), value, out)

    def _fill(
        self, moving: np.ndarray, look: _Look, value: Callable[[_Block, Tensor], Tensor], out: np.ndarray
    ) -> None:
        """Fill out with values at places (N, 3) of layers of what is moving."""
        layer = out.shape[1] * out.shape[2]
        thickness, at_once = max(VOXELS_PER_SLAB // layer, 1), VOXELS_AT_ONCE[self.device.type]
        turn = torch.as_tensor(look.turn, dtype=torch.float64, device=self.device)
        for start in range(0, len(out), thickness):
            slab = range(start, min(start + thickness, len(out)))
            field = self._block(look.vectors, _layers(look.to_field, slab, out.shape))
            low, high = (field.values @ turn[2].float()).aminmax()
            reach = float(low), float(high)
            block = self._block(moving, _layers(look.to_moving, slab, out.shape, reach))
            made = []
            for first in range(slab.start * layer, slab.stop * layer, at_once):
                numbers = range(first, min(first + at_once, slab.stop * layer))
                nodes = nodes_on_device(look.to_field, out.shape, numbers, self.device)
                shift = field.cells(nodes, len(look.vectors)).interpolated(field.values)
                places = nodes_on_device(look.to_moving, out.shape, numbers, self.device) + shift @ turn.T
                made.append(value(block, places))
            out[slab.start : slab.stop] = torch.cat(made).cpu().numpy().reshape(-1, *out.shape[1:])

    def _block(self, values: np.ndarray, layers: tuple[float, float]) -> _Block:
        """The layers of an array between two places along its first axis, and those beside them."""
        end = len(values) - 1
        first = int(np.clip(np.floor(layers[0]) - 1, 0, max(end - 1, 0)))
        last = int(np.clip(np.ceil(layers[1]) + 1, min(first + 1, end), end))
        part = values[first : last + 1]
        kind = _SIGNED.get(part.dtype.str[1:])
        part = torch.tensor(part if kind is None else part.astype(kind), device=self.device)
        depth, height, width = part.shape[:3]
        return _Block(part.flatten(0, 2), (depth, height, width), first)

    def _beyond(self, shape: tuple[int, ...]) -> Tensor:
        """(3,) indices (i, j, k) half a voxel past the last voxels."""
        return torch.tensor(shape[::-1], dtype=torch.float64, device=self.device) - 0.5


def _layers(
    matrix: np.ndarray, slab: range, shape: tuple[int, ...], reach: tuple[float, float] = (0.0, 0.0)
) -> tuple[float, float]:
    """Least and largest third coordinate of a slab's voxels under a map (3, 4), and of what lies in reach of them."""
    ends = np.array([[0, shape[2] - 1], [0, shape[1] - 1], [slab.start, slab.stop - 1]])
    along = matrix[2, :3, None] * ends
    return (
        float(matrix[2, 3] + along.min(axis=1).sum() + reach[0]),
        float(matrix[2, 3] + along.max(axis=1).sum() + reach[1]),
    )
