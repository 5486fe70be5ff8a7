"""ConvexAdam on given features: the package's coupled convex optimisation, then Adam on a smooth grid.

The package's own function computes MIND descriptors and nothing else, hence its two stages are put together here; the
first is its code, called.

References
----------
H. Siebert, L. Hansen, M. P. Heinrich, "Fast 3D registration with accurate optimisation and little learning for
Learn2Reg 2021", MICCAI workshops 2021.

"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
import torch.nn.functional as F

from PolyPoseLib.baselines.volumes.fdk_system import stop_if_cancelled
from PolyPoseLib.data.benchmark.system import SystemSetting


@dataclass(frozen=True)
class FeatureSettings:
    """As published for anatomix.

    Attributes
    ----------
    spacing
        Voxels between the nodes of the search, and of Adam's grid.
    reach
        Steps of the search to each side.
    iterations
        Of Adam.
    rate
        Of Adam, in nodes.
    smoothness
        Weight of the squared differences of neighbouring nodes.

    """

    spacing: int = 2
    reach: int = 1
    iterations: int = 80
    rate: float = 1.0
    smoothness: float = 0.75


def register_features(
    fixed: torch.Tensor, moving: torch.Tensor, settings: FeatureSettings, setting: SystemSetting
) -> np.ndarray:
    """Displacements in voxels (k, j, i, 3), along k, j, i, from a fixed voxel to where moving looks like it.

    Parameters
    ----------
    fixed, moving
        (1, C, k, j, i) features.
    settings
        Of the optimisation.
    setting
        Asked whether to stop; told how far it is.

    """
    shape = fixed.shape[2:]
    with torch.no_grad():
        start = _searched(fixed, moving, settings)
        small_fixed, small_moving = (
            F.avg_pool3d(each, settings.spacing, stride=settings.spacing) for each in (fixed, moving)
        )
        start = F.interpolate(start, size=small_fixed.shape[2:], mode="trilinear", align_corners=False)
    nodes = (start / settings.spacing).requires_grad_()
    optimiser = torch.optim.Adam([nodes], lr=settings.rate)
    for iteration in range(settings.iterations):
        stop_if_cancelled(setting)
        optimiser.zero_grad()
        smooth = _smoothed(nodes)
        difference = ((_sampled(small_moving, smooth) - small_fixed) ** 2).mean(1) * 12
        loss = difference.mean() + settings.smoothness * _roughness(smooth)
        loss.backward()
        optimiser.step()
        setting.progress(iteration + 1, settings.iterations, -float(loss.detach()))
    with torch.no_grad():
        found = F.interpolate(
            _smoothed(nodes) * settings.spacing, size=shape, mode="trilinear", align_corners=False
        )
    return found[0].permute(1, 2, 3, 0).cpu().numpy()


def _searched(fixed: torch.Tensor, moving: torch.Tensor, settings: FeatureSettings) -> torch.Tensor:
    """The package's search both ways, made inverse consistent: (1, 3, k', j', i') voxels."""
    package: Any = importlib.import_module("convexAdam.convex_adam_utils")
    shape, step, reach = tuple(fixed.shape[2:]), settings.spacing, settings.reach
    pooled = [F.avg_pool3d(each, step, stride=step) for each in (fixed, moving)]
    channels = pooled[0].shape[1]
    side = 2 * reach + 1
    mesh = F.affine_grid(
        reach * torch.eye(3, 4, device=fixed.device)[None], [1, 1, side, side, side], align_corners=True
    )
    mesh = mesh.permute(0, 4, 1, 2, 3).reshape(3, -1, 1)
    ways = []
    for first, second in (pooled, pooled[::-1]):
        costs, best = package.correlate(first, second, reach, step, shape, channels)
        ways.append(package.coupled_convex(costs, best, mesh, step, shape))
    # Its inverse consistency works in grid_sample's units: (x, y, z), the volume from -1 to 1.
    half = (torch.tensor([n // step - 1 for n in shape], device=fixed.device).float() / 2).view(1, 3, 1, 1, 1)
    consistent, _ = package.inverse_consistency((ways[0] / half).flip(1), (ways[1] / half).flip(1), iter=15)
    return consistent.flip(1) * half * step


def _smoothed(nodes: torch.Tensor) -> torch.Tensor:
    """Three means over 3 x 3 x 3 nodes, nearly a cubic B-spline."""
    for _ in range(3):
        nodes = F.avg_pool3d(nodes, 3, stride=1, padding=1)
    return nodes


def _roughness(nodes: torch.Tensor) -> torch.Tensor:
    """Mean squared difference of neighbours along each axis, summed."""
    return sum(((nodes.diff(dim=axis)) ** 2).mean() for axis in (2, 3, 4))  # type: ignore[return-value]


def _sampled(features: torch.Tensor, displacement: torch.Tensor) -> torch.Tensor:
    """Features at voxels displaced by (1, 3, k, j, i) voxels along k, j, i."""
    shape = features.shape[2:]
    identity = F.affine_grid(
        torch.eye(3, 4, device=features.device)[None], [1, 1, *shape], align_corners=False
    )
    # With voxels' edges at -1 and 1, a voxel is 2/n wide.
    scale = 2.0 / torch.tensor(shape, device=features.device).float()
    grid = identity + (displacement.permute(0, 2, 3, 4, 1) * scale).flip(-1)
    return F.grid_sample(features, grid, align_corners=False)
