"""Blocks of which the trained networks consist."""

from __future__ import annotations

from typing import TypeVar

from torch import nn

SLOPE = 0.2
"""Of the leaky rectifier for negative values, as in the published code."""


def convolution(inputs: int, outputs: int, stride: int = 1) -> nn.Sequential:
    """A 3 x 3 x 3 convolution and a leaky rectifier; a stride of 2 halves the nodes along every axis."""
    return nn.Sequential(
        started(nn.Conv3d(inputs, outputs, 3, stride=stride, padding=1)), nn.LeakyReLU(SLOPE)
    )


def dense(inputs: int, outputs: int) -> nn.Sequential:
    """A dense layer and a leaky rectifier."""
    return nn.Sequential(started(nn.Linear(inputs, outputs)), nn.LeakyReLU(SLOPE))


Layer = TypeVar("Layer", nn.Conv3d, nn.Linear)


def started(layer: Layer) -> Layer:
    """A layer with first weights that keep the spread of what passes through it.

    Torch's own shrink it: after nine layers nothing is left of the differences between X-rays.

    References
    ----------
    K. He et al., "Delving deep into rectifiers", ICCV 2015.

    """
    nn.init.kaiming_normal_(layer.weight, a=SLOPE)
    if layer.bias is not None:
        nn.init.zeros_(layer.bias)
    return layer


def halved(side: int, times: int) -> int:
    """Nodes along an axis after so many convolutions of stride 2."""
    for _ in range(times):
        side = -(-side // 2)
    return side
