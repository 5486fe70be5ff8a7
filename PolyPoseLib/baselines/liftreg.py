"""LiftReg: X-rays lifted into the CT's volume, and an encoder that answers in a subspace of deformations.

References
----------
L. Tian, Y. Z. Lee, R. San Jose Estepar, M. Niethammer, "LiftReg: Limited Angle 2D/3D Deformable Registration", MICCAI
2022, and the authors' public code, whose layers, losses and learning rate these are; written anew here. What differs is
in docs/trained-systems.md.

"""

from __future__ import annotations

import numpy as np
import torch
import torch.nn.functional as F
from torch import Tensor, nn

from PolyPoseLib.baselines.trained.fitting import fit_trained
from PolyPoseLib.baselines.trained.input_scale import InputScale
from PolyPoseLib.baselines.trained.layers import convolution, dense, halved
from PolyPoseLib.baselines.trained.pca import principal_components
from PolyPoseLib.baselines.trained.trained_weights import TrainedWeights
from PolyPoseLib.baselines.trained.training import TrainingPlan
from PolyPoseLib.baselines.trained.training_pairs import PreparedPair
from PolyPoseLib.baselines.trained.training_set import TrainingSet
from PolyPoseLib.baselines.trained.warping import dissimilarity, gradient_penalty, inner, warped
from PolyPoseLib.data.benchmark.system import Motion, SystemSetting
from PolyPoseLib.data.study import Study

CHANNELS = (16, 32, 32, 32, 32, 32)
"""Of the encoder; every layer after the first halves the nodes."""

DENSE = (800, 256)
"""Widths of the dense layers between the encoder's values (4000 of a grid of 160 nodes) and the coefficients."""


class LiftRegNetwork(nn.Module):
    """From a CT and lifted X-rays to a displacement in the subspace.

    Parameters
    ----------
    inputs : InputScale
        Scales the X-rays.
    mean : (3 side^3,) tensor
        Of the training set's displacements.
    components : (K, 3 side^3) tensor
        Principal components, as long as the displacements' standard deviations along them.

    """

    mean: Tensor
    components: Tensor

    def __init__(self, inputs: InputScale, mean: Tensor, components: Tensor) -> None:
        super().__init__()
        views, self.side = inputs.mean.shape[:2]
        self.inputs = inputs
        before = (views + 1, *CHANNELS[:-1])
        self.encoder = nn.Sequential(
            *(
                convolution(a, b, 1 if n == 0 else 2)
                for n, (a, b) in enumerate(zip(before, CHANNELS, strict=True))
            )
        )
        flat = CHANNELS[-1] * halved(self.side, len(CHANNELS) - 1) ** 3
        self.dense = nn.Sequential(
            nn.Flatten(),
            dense(flat, DENSE[0]),
            dense(DENSE[0], DENSE[1]),
            nn.Linear(DENSE[1], len(components)),
        )
        self.register_buffer("mean", mean.half())
        self.register_buffer("components", components.half())

    def coefficients(self, moving: Tensor, xrays: Tensor) -> Tensor:
        """Of the components (B, K), in standard deviations of the training set."""
        return self.dense(self.encoder(self.inputs(moving, xrays)))

    def forward(self, moving: Tensor, xrays: Tensor) -> Tensor:
        """Displacement (B, 3, k, j, i) in normalised coordinates, of CTs (B, 1, ...) and lifted X-rays (B, V, ...)."""
        found = F.linear(self.coefficients(moving, xrays), self.components.float().T, self.mean.float())
        return found.reshape(-1, 3, self.side, self.side, self.side)


class LiftReg:
    """The system "liftreg" of the comparison, and what its training needs."""

    name = "liftreg"
    needs: tuple[str, ...] = ()

    def new_network(self, pairs: TrainingSet, plan: TrainingPlan) -> LiftRegNetwork:
        """An untrained network in the subspace of the training set's fields."""
        fields = np.stack([pair.displacement.numpy().reshape(-1) for pair in pairs.training])
        mean, components = principal_components(fields, plan.components)
        if not len(components):  # all pairs alike: the mean is the answer
            components = np.zeros((1, fields.shape[1]), np.float32)
        return LiftRegNetwork(InputScale.of(pairs), torch.from_numpy(mean), torch.from_numpy(components))

    def loss(self, displacement: Tensor, pair: PreparedPair, plan: TrainingPlan) -> Tensor:
        """Dissimilarity of the warped CT and the CT in the posture of the X-rays, and the gradient's penalty."""
        moving, fixed = (each[None].to(displacement.device).float() for each in (pair.moving, pair.fixed))
        unlike = dissimilarity(inner(warped(moving, displacement)), inner(fixed), 3)
        return unlike + plan.gradient_weight * gradient_penalty(displacement)

    def fit(self, study: Study, setting: SystemSetting) -> Motion:
        """The motion that the trained network sees; see :func:`PolyPoseLib.baselines.trained.fitting.fit_trained`."""
        return fit_trained(self.name, _network_of, study, setting)


def _network_of(weights: TrainedWeights) -> LiftRegNetwork:
    """The network with its weights; raises RuntimeError or KeyError when they do not fit."""
    mean, components = weights.state["mean"], weights.state["components"]
    if mean.shape != (3 * weights.side**3,) or components.ndim != 2:
        raise ValueError("The components do not fit the grid.")
    inputs = InputScale.like(weights.state, len(weights.directions), weights.side)
    network = LiftRegNetwork(inputs, mean, components)
    network.load_state_dict(weights.state)
    return network
