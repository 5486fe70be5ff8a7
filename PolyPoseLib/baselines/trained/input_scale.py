"""The first layer of the trained networks: X-rays as their difference from the training set's mean X-ray."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor, nn

from PolyPoseLib.baselines.trained.training_set import TrainingSet

LEAST = 1e-3
"""Of the spread by which X-rays are divided."""


class InputScale(nn.Module):
    """Joins a CT and lifted X-rays, these less their mean and over their spread in the training set.

    Bones that move by millimetres change a standardised X-ray by a hundredth of its range: without this layer, an
    hour of training is spent on finding that hundredth.

    Parameters
    ----------
    mean : (V, k, j, i) tensor
        Of the lifted X-rays of the training set; kept in half precision.
    spread : () tensor
        Root of the mean square of what is left.

    """

    mean: Tensor
    spread: Tensor

    def __init__(self, mean: Tensor, spread: Tensor) -> None:
        super().__init__()
        self.register_buffer("mean", mean.half())
        self.register_buffer("spread", spread.float())

    @classmethod
    def of(cls, pairs: TrainingSet) -> InputScale:
        """That of a training set."""
        mean = torch.zeros_like(pairs.training[0].lifted, dtype=torch.float32)
        for pair in pairs.training:
            mean += pair.lifted.float() / len(pairs.training)
        squares = [float((pair.lifted.float() - mean).square().mean()) for pair in pairs.training]
        return cls(mean, torch.tensor(max(float(np.sqrt(np.mean(squares))), LEAST)))

    @classmethod
    def like(cls, state: dict[str, Tensor], views: int, side: int) -> InputScale:
        """That of a network's weights; raises KeyError or ValueError when they do not fit."""
        mean, spread = state["inputs.mean"], state["inputs.spread"]
        if mean.shape != (views, side, side, side) or spread.shape != () or not spread > 0:
            raise ValueError("The mean X-rays do not fit the grid.")
        return cls(mean, spread)

    def forward(self, moving: Tensor, xrays: Tensor) -> Tensor:
        """(B, 1 + V, k, j, i) of CTs (B, 1, ...) and lifted X-rays (B, V, ...)."""
        return torch.cat([moving, (xrays - self.mean.float()) / self.spread], dim=1)
