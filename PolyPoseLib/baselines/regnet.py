"""2D3D-RegNet: a U-Net from lifted X-rays and a CT to a dense displacement, compared in the X-rays.

References
----------
The network that L. Tian et al. compare with LiftReg (MICCAI 2022; in their public code RegNet2D3D), a U-Net after G.
Balakrishnan et al., "An Unsupervised Learning Model for Deformable Medical Image Registration", CVPR 2018; written anew
here. What differs is in docs/trained-systems.md.

"""

from __future__ import annotations

import torch
import torch.nn.functional as F
from torch import Tensor, nn

from PolyPoseLib.baselines.trained.fitting import fit_trained
from PolyPoseLib.baselines.trained.input_scale import InputScale
from PolyPoseLib.baselines.trained.layers import convolution
from PolyPoseLib.baselines.trained.trained_weights import TrainedWeights
from PolyPoseLib.baselines.trained.training import TrainingPlan
from PolyPoseLib.baselines.trained.training_pairs import PreparedPair
from PolyPoseLib.baselines.trained.training_set import TrainingSet
from PolyPoseLib.baselines.trained.warping import dissimilarity, gradient_penalty, inner, inverse, warped
from PolyPoseLib.data.benchmark.system import Motion, SystemSetting
from PolyPoseLib.data.study import Study

ENCODER = (16, 32, 32, 32, 32)
"""Channels; every layer after the first halves the nodes."""

DECODER = (32, 32, 32, 32, 16, 16)
"""Channels; the nodes are doubled after each of the first four."""

FLOW_DEVIATION = 1e-3
"""Of the last layer's first weights: an untrained network answers with nearly no motion."""

FLOW_SCALE = 0.02
"""Of the last layer's values, in normalised coordinates: one step of Adam moves nodes by a millimetre, not by ten."""

VOLUME_WEIGHT = 1.0
"""Of the similarity in 3D, which a training on CTs in both postures can use (the published loss has none)."""


class RegNetwork(nn.Module):
    """From a CT and lifted X-rays to a dense displacement.

    Parameters
    ----------
    inputs : InputScale
        Scales the X-rays.

    """

    def __init__(self, inputs: InputScale) -> None:
        super().__init__()
        self.inputs = inputs
        before = (inputs.mean.shape[0] + 1, *ENCODER[:-1])
        self.encoder = nn.ModuleList(
            convolution(a, b, 1 if n == 0 else 2)
            for n, (a, b) in enumerate(zip(before, ENCODER, strict=True))
        )
        skips = (0, *ENCODER[-2::-1], 0)
        before = (ENCODER[-1], *DECODER[:-1])
        self.decoder = nn.ModuleList(
            convolution(a + skip, b) for a, skip, b in zip(before, skips, DECODER, strict=True)
        )
        self.flow = nn.Conv3d(DECODER[-1], 3, 3, padding=1)
        nn.init.normal_(self.flow.weight, std=FLOW_DEVIATION)
        if self.flow.bias is not None:
            nn.init.zeros_(self.flow.bias)

    def forward(self, moving: Tensor, xrays: Tensor) -> Tensor:
        """Displacement (B, 3, k, j, i) in normalised coordinates, of CTs (B, 1, ...) and lifted X-rays (B, V, ...)."""
        values = self.inputs(moving, xrays)
        kept = []
        for layer in self.encoder:
            values = layer(values)
            kept.append(values)
        for number, layer in enumerate(self.decoder):
            if 0 < number < len(kept):
                skip = kept[-1 - number]
                values = F.interpolate(values, skip.shape[2:], mode="trilinear", align_corners=True)
                values = torch.cat([values, skip], dim=1)
            values = layer(values)
        return FLOW_SCALE * self.flow(values)


class RegNet:
    """The system "2d3d-regnet" of the comparison, and what its training needs."""

    name = "2d3d-regnet"
    needs: tuple[str, ...] = ()

    def new_network(self, pairs: TrainingSet, plan: TrainingPlan) -> RegNetwork:
        """An untrained network."""
        return RegNetwork(InputScale.of(pairs))

    def loss(self, displacement: Tensor, pair: PreparedPair, plan: TrainingPlan) -> Tensor:
        """Dissimilarity both ways in the X-rays, one way in 3D, and the gradient's penalty of both displacements.

        Forth: renderings of the warped CT against the X-rays. Back: the warped CT, warped by the inverse displacement,
        must look like the CT in the same views.
        """
        moving, fixed = (each[None].to(displacement.device).float() for each in (pair.moving, pair.fixed))
        back = inverse(displacement)
        forth_ct = warped(moving, displacement)
        unlike = displacement.new_zeros(())
        ways = (
            (pair.projector(forth_ct), [image.to(displacement.device)[None] for image in pair.images]),
            (pair.projector(warped(forth_ct, back)), pair.projector(moving)),
        )
        for rendered, wanted in ways:
            parts = [dissimilarity(a, b, 2) for a, b in zip(rendered, wanted, strict=True)]
            unlike = unlike + torch.stack(parts).mean()
        penalty = gradient_penalty(displacement) + gradient_penalty(back)
        return (
            unlike
            + VOLUME_WEIGHT * dissimilarity(inner(forth_ct), inner(fixed), 3)
            + plan.gradient_weight * penalty
        )

    def fit(self, study: Study, setting: SystemSetting) -> Motion:
        """The motion that the trained network sees; see :func:`PolyPoseLib.baselines.trained.fitting.fit_trained`."""
        return fit_trained(self.name, _network_of, study, setting)


def _network_of(weights: TrainedWeights) -> RegNetwork:
    """The network with its weights; raises RuntimeError when they do not fit."""
    network = RegNetwork(InputScale.like(weights.state, len(weights.directions), weights.side))
    network.load_state_dict(weights.state)
    return network
