"""The U-Net of anatomix, so that its published state dict loads: a list of layers with skip connections.

Written from the published description; the names of parameters are the positions of layers in that list, and so are
part of the file format.

References
----------
N. Dey et al., "Learning general-purpose biomedical volume representations using randomized synthesis", ICLR 2025; MIT.

"""

from __future__ import annotations

import torch
from torch import Tensor, nn

FEATURES = 16
LEVELS = 4

_WIDTH = 16
"""Channels at full resolution; each level below has twice as many."""


class AnatomixUNet(nn.Module):
    """16 features of every voxel of one volume, whose sides are multiples of 16."""

    def __init__(self) -> None:
        super().__init__()
        layers: list[nn.Module] = _convolution(1, _WIDTH)
        self._kept: list[int] = []
        """Layers whose output a decoder takes over."""
        self._joined: list[int] = []
        """Layers to whose output it is joined, in the decoder's order."""
        channels = _WIDTH
        for level in range(LEVELS):
            wider = channels * (1 if level == 0 else 2)
            layers += [*_convolution(channels, wider), *_convolution(wider, wider)]
            self._kept.append(len(layers) - 1)
            layers.append(nn.MaxPool3d(2))
            channels = wider
        layers += [*_convolution(channels, 2 * channels), *_convolution(2 * channels, 2 * channels)]
        channels *= 2
        for _ in range(LEVELS):
            self._joined.append(len(layers))
            layers.append(nn.Upsample(scale_factor=2, mode="nearest"))
            layers += _convolution(channels + channels // 2, channels // 2)
            layers += _convolution(channels // 2, channels // 2)
            channels //= 2
        layers.append(_filter(channels, FEATURES))
        self.model = nn.Sequential(*layers)

    def forward(self, volume: Tensor) -> Tensor:
        """(B, 16, k, j, i) of (B, 1, k, j, i) from 0 to 1."""
        kept: list[Tensor] = []
        value = volume
        for place, layer in enumerate(self.model):
            value = layer(value)
            if place in self._kept:
                kept.append(value)
            elif place in self._joined:
                value = torch.cat([kept.pop(), value], dim=1)
        return value


def _convolution(channels: int, wider: int) -> list[nn.Module]:
    """A filter, batch normalisation and a rectifier."""
    return [_filter(channels, wider), nn.BatchNorm3d(wider), nn.ReLU()]


def _filter(channels: int, wider: int) -> nn.Conv3d:
    """3 x 3 x 3 voxels, mirrored beyond the volume."""
    return nn.Conv3d(channels, wider, 3, padding="same", padding_mode="reflect", bias=False)
