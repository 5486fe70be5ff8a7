"""Dense displacements: a free vector per node."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor

from PolyPoseLib.baselines.dense import ITERATIONS, Nodes, fit_field
from PolyPoseLib.data.benchmark.system import Motion, SystemSetting
from PolyPoseLib.data.study import Study

RATE = 1e-2
"""Step size in voxels of the CT along each axis, whatever the nodes' distance."""

WEIGHT = 1e-2
"""Of the penalty."""


class DenseR3:
    """A displacement per node, smooth by a penalty on its divergence (DenseTranslationField in the published code).

    One Adam with a step size of 0.01 of the CT's voxels: in its 501 iterations no point moves farther than five voxels.

    The penalty is the published one, the mean over nodes and components c of (d_i u_c + d_j u_c + d_k u_c)^2 by forward
    differences, of the displacement u alone. There it is taken of x + u, which adds a constant 1 to every sum: the
    field's border is then pulled inwards even where no X-ray asks for it, and rest is not its minimum.
    """

    name = "dense-r3"
    needs: tuple[str, ...] = ()

    def __init__(self, iterations: int = ITERATIONS) -> None:
        self.iterations = iterations

    def fit(self, study: Study, setting: SystemSetting) -> Motion:
        """See :class:`PolyPoseLib.data.benchmark.system.System`."""
        return fit_field(study, setting, lambda nodes, seed: R3Model(nodes), self.iterations)


class R3Model:
    """See :class:`PolyPoseLib.baselines.dense.FieldModel`; displacements in voxels of the CT."""

    def __init__(self, nodes: Nodes) -> None:
        self.nodes = nodes
        self.voxel = torch.as_tensor(nodes.voxel_mm).to(nodes.volume)
        self.voxels = torch.zeros((*nodes.volume.shape, 3)).to(nodes.volume).requires_grad_()

    @property
    def groups(self) -> list[dict[str, Any]]:
        """The displacements with their step size."""
        return [{"params": [self.voxels], "lr": RATE}]

    def displacement(self) -> Tensor:
        """(D, H, W, 3) mm along the grid's axes."""
        return self.voxels * self.voxel

    def penalty(self, displacement: Tensor) -> Tensor:
        """Mean squared sum of the forward differences, per voxel of the CT as the published one."""
        i, j, k = self.nodes.differences(displacement / self.voxel)
        along = self.voxel[0] * i + self.voxel[1] * j + self.voxel[2] * k
        return WEIGHT * along.square().mean()
