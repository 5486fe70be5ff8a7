"""Blocks of which the trained networks consist."""

from __future__ import annotations

from torch import nn

SLOPE = 0.2
"""Of the leaky rectifier for negative values, as in the published code."""


def convolution(inputs: int, outputs: int, stride: int = 1) -> nn.Sequential:
    """A 3 x 3 x 3 convolution and a leaky rectifier; a stride of 2 halves the nodes along every axis."""
    return nn.Sequential(nn.Conv3d(inputs, outputs, 3, stride=stride, padding=1), nn.LeakyReLU(SLOPE))


def halved(side: int, times: int) -> int:
    """Nodes along an axis after so many convolutions of stride 2."""
    for _ in range(times):
        side = -(-side // 2)
    return side
