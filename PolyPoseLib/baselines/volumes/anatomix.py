"""ConvexAdam on the features of anatomix and MIND descriptors.

References
----------
N. Dey et al., "Learning general-purpose biomedical volume representations using randomized synthesis", ICLR 2025; MIT.
ConvexAdam is the package's of :mod:`PolyPoseLib.baselines.volumes.convexadam`.

"""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from typing import Any

import numpy as np
import torch
import torch.nn.functional as F

from PolyPoseLib.baselines.volumes.anatomix_network import LEVELS, AnatomixUNet
from PolyPoseLib.baselines.volumes.fdk_system import FdkSystem, quiet_package, stop_if_cancelled
from PolyPoseLib.baselines.volumes.feature_convexadam import FeatureSettings, register_features
from PolyPoseLib.baselines.volumes.pair import VolumePair
from PolyPoseLib.baselines.weights import load_weights, weights_file
from PolyPoseLib.data.benchmark.system import SystemSetting
from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.study import Study
from PolyPoseLib.errors import NotFiniteError

SOURCE = "anatomix.pth of the folder model-weights at https://github.com/neel-dey/anatomix"

CLIP_HU = (-450.0, 450.0)
"""Of CT in the published registrations; becomes 0 to 1."""

FEATURE_SCALE = 0.1
"""Brings the network's features to the size of MIND's, as published."""

WINDOW = 128
"""Voxels along a side of what the network sees at once, as published."""

OVERLAP = 0.5
"""Of neighbouring windows. Published is 0.8, which takes up to fifteen times as long and matters at seams alone."""


class FdkAnatomix(FdkSystem):
    """FDK, then ConvexAdam on anatomix and MIND with the published settings and masks, the same for both volumes."""

    name = "fdk-anatomix"
    needs = ("itk-rtk", "convexadam")
    modules = ("itk.RTKPython", "convexAdam")

    def require(self, setting: SystemSetting) -> None:
        """Packages, and the file of weights, before anything is computed."""
        super().require(setting)
        weights_file(setting, self.name, SOURCE)

    def register(self, pair: VolumePair, setting: SystemSetting) -> DisplacementField:
        """See :meth:`FdkSystem.register`."""
        device = torch.device(setting.device)
        with quiet_package(setting):
            network = AnatomixUNet()
            load_weights(network, weights_file(setting, self.name, SOURCE), self.name)
            network.to(device).eval()
            fixed, moving, seen = (
                torch.from_numpy(each).float().to(device)
                for each in pair.padded_to(FeatureSettings().spacing)
            )
            first, second = (
                torch.cat([mind, seen * self._features(network, hu, setting)], dim=1)
                for mind, hu in zip(_masked_mind(fixed, moving, seen), (fixed, moving), strict=True)
            )
            kji = register_features(first, second, FeatureSettings(), setting)
        if not np.isfinite(kji).all():
            raise NotFiniteError(f"{self.name} diverged: its displacements are not finite.")
        return pair.field_of_voxels(kji)

    def notes(self, study: Study) -> tuple[str, ...]:
        """The overlap differs from the published one."""
        return (*super().notes(study), f"windows overlap by {OVERLAP:g}, published is 0.8")

    @staticmethod
    def _features(network: AnatomixUNet, hu: torch.Tensor, setting: SystemSetting) -> torch.Tensor:
        """(1, 16, k, j, i): the network's features of a volume (k, j, i) in HU."""
        low, high = CLIP_HU
        clipped = hu[None, None].clamp(low, high)
        span = float(clipped.max() - clipped.min())
        scaled = (clipped - clipped.min()) / (span or 1.0)
        with torch.no_grad():
            return FEATURE_SCALE * features_in_windows(network, scaled, setting)


def _masked_mind(
    fixed: torch.Tensor, moving: torch.Tensor, seen: torch.Tensor
) -> tuple[torch.Tensor, torch.Tensor]:
    """MIND (1, 12, k, j, i) of both volumes; the package continues them beyond the mask by their nearest voxel."""
    package: Any = importlib.import_module("convexAdam.convex_adam_MIND")
    with torch.no_grad():
        return package.extract_features(fixed, moving, 1, 2, True, seen, seen, fixed.device, torch.float32)


def features_in_windows(
    network: torch.nn.Module, volume: torch.Tensor, setting: SystemSetting
) -> torch.Tensor:
    """Features of a volume (1, 1, k, j, i) of any size, window by window, blended by Gaussian weights."""
    shape = volume.shape[2:]
    multiple = 2**LEVELS
    # Two voxels are left at the lowest level: one cannot be mirrored.
    window = [min(WINDOW, max(-(-n // multiple), 2) * multiple) for n in shape]
    padding = [max(w - n, 0) for w, n in zip(window, shape, strict=True)]
    padded = F.pad(volume, [0, padding[2], 0, padding[1], 0, padding[0]], mode="replicate")
    weight = _blending(window).to(volume)
    total, weights = None, torch.zeros_like(padded)
    for place in _windows(padded.shape[2:], window):
        stop_if_cancelled(setting)
        box = (..., *place)
        found = network(padded[box])
        if total is None:
            total = found.new_zeros((1, found.shape[1], *padded.shape[2:]))
        total[box] += weight * found
        weights[box] += weight
    assert total is not None
    return (total / weights)[..., : shape[0], : shape[1], : shape[2]]


def _windows(shape: torch.Size, window: list[int]) -> Iterator[tuple[slice, ...]]:
    """Boxes that cover a volume, overlapping by at least OVERLAP."""
    starts = []
    for n, w in zip(shape, window, strict=True):
        count = int(np.ceil((n - w) / (w * (1 - OVERLAP)))) + 1
        starts.append(np.rint(np.linspace(0, n - w, count)).astype(int))
    for k in starts[0]:
        for j in starts[1]:
            for i in starts[2]:
                yield tuple(slice(int(s), int(s) + w) for s, w in zip((k, j, i), window, strict=True))


def _blending(window: list[int]) -> torch.Tensor:
    """Weights of a window's voxels, a Gaussian with a quarter of its side as standard deviation."""
    sides = [torch.exp(-0.5 * ((torch.arange(w) - (w - 1) / 2) / (0.25 * w)) ** 2) for w in window]
    return sides[0][:, None, None] * sides[1][:, None] * sides[2]
