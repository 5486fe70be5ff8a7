"""The regressor: a residual network of MONAI with a head that keeps some of the position in the image."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from PolyPoseLib.errors import InputError
from PolyPoseLib.learned.network_input import CHANNELS
from PolyPoseLib.learned.pose_code import LENGTH

GRID = 3
"""The last feature map is averaged to GRID x GRID cells, so that the place in the image is not lost."""


@dataclass(frozen=True)
class Architecture:
    """Size of the network.

    Attributes
    ----------
    views : int
        Standard views, each with its own pose.
    blocks, channels : tuple[int, int, int, int]
        Residual blocks and feature maps of each of the four stages.

    """

    views: int
    blocks: tuple[int, int, int, int] = (1, 1, 1, 1)
    channels: tuple[int, int, int, int] = (32, 64, 128, 256)

    def __post_init__(self) -> None:
        """Check the sizes; raises InputError."""
        limits = ((self.views,), 64), (self.blocks, 64), (self.channels, 2048)
        for sizes, most in limits:
            if not all(isinstance(n, int) and 1 <= n <= most for n in sizes):
                raise InputError(f"A network of the sizes {sizes} cannot be built.")
        if len(self.blocks) != 4 or len(self.channels) != 4:
            raise InputError("A network has four stages: give four numbers of blocks and of channels.")


class CameraNetwork(nn.Module):
    """Images (B, CHANNELS, S, S) to logits (B, V) of the standard views and codes (B, V, 9) for each of them."""

    def __init__(self, architecture: Architecture) -> None:
        super().__init__()
        self.views = architecture.views
        self.backbone = _backbone(architecture)
        self.backbone.avgpool = nn.Sequential(nn.AdaptiveAvgPool2d(GRID), nn.Flatten())
        width = architecture.channels[-1]
        first = nn.Linear(width * GRID**2, width)
        last = nn.Linear(width, self.views * (1 + LENGTH))
        self.backbone.fc = nn.Sequential(first, nn.ReLU(), last)
        nn.init.normal_(last.weight, std=1e-3)
        nn.init.zeros_(last.bias)
        # Untrained, it answers with the standard view itself.
        rest = torch.zeros(LENGTH)
        rest[[0, 4]] = 1.0
        self.register_buffer("rest", rest, persistent=False)

    def forward(self, images: Tensor) -> tuple[Tensor, Tensor]:
        """Logits (B, V) and codes (B, V, 9) of images (B, CHANNELS, S, S)."""
        answer = self.backbone(_with_coordinates(images)).float()
        logits, codes = answer.split([self.views, self.views * LENGTH], dim=1)
        return logits, codes.reshape(-1, self.views, LENGTH) + self.rest


def _backbone(architecture: Architecture) -> nn.Module:
    """MONAI's ResNet; raises InputError when MONAI is not installed."""
    try:
        from monai.networks.nets.resnet import ResNet
    except ImportError as error:
        raise InputError(
            "Learned cameras need the package MONAI, which is not installed: pip install monai."
        ) from error
    return ResNet(
        "basic",
        list(architecture.blocks),
        list(architecture.channels),
        spatial_dims=2,
        n_input_channels=CHANNELS + 2,
        conv1_t_size=7,
        conv1_t_stride=2,
        num_classes=1,
    )


def _with_coordinates(images: Tensor) -> Tensor:
    """Two more channels: the pixel's column and row from -1 to 1 (R. Liu et al., "CoordConv", NeurIPS 2018)."""
    height, width = images.shape[-2:]
    rows = torch.linspace(-1, 1, height, dtype=images.dtype, device=images.device)
    columns = torch.linspace(-1, 1, width, dtype=images.dtype, device=images.device)
    plane = torch.stack([columns.expand(height, width), rows[:, None].expand(height, width)])
    joined = torch.cat([images, plane.expand(len(images), 2, height, width)], dim=1)
    return joined.contiguous(memory_format=torch.channels_last)
