"""Dense rigid motions: a twist per node."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor

from PolyPoseLib.baselines.dense import ITERATIONS, Nodes, fit_field
from PolyPoseLib.data.benchmark.system import Motion, SystemSetting
from PolyPoseLib.data.study import Study
from PolyPoseLib.warp.polyrigid import apply_exp

ROTATION_RATE, TRANSLATION_RATE = 1e-2, 1.0
"""Step sizes, rad and mm."""

WEIGHT = 1e-3
"""Of the penalty."""

START = 1e-8
"""Standard deviation of the twists at first, as published: exactly at rest the penalty has no slope."""

FLOOR = 1e-6
"""Added to singular values."""


class DenseSE3:
    """A twist per node, kept rigid by a penalty on its Jacobian (DenseSE3Field in the published code).

    A node's twist turns it about the middle of the CT (there too, where the CT's centre is the origin) and moves it;
    one Adam with step sizes of 0.01 rad and 1 mm. The penalty is the mean over nodes of the Euclidean norm of the
    logarithms of the singular values of the map's Jacobian, by forward differences. They are taken per mm; there per
    voxel, which is the same for cubic voxels.
    """

    name = "dense-se3"
    needs: tuple[str, ...] = ()

    def __init__(self, iterations: int = ITERATIONS) -> None:
        self.iterations = iterations

    def fit(self, study: Study, setting: SystemSetting) -> Motion:
        """See :class:`PolyPoseLib.data.benchmark.system.System`."""
        return fit_field(study, setting, SE3Model, self.iterations)


class SE3Model:
    """See :class:`PolyPoseLib.baselines.dense.FieldModel`; twists about the middle of the grid."""

    def __init__(self, nodes: Nodes, seed: int = 0) -> None:
        self.nodes, self.points = nodes, nodes.points.reshape(-1, 3)
        random = torch.Generator().manual_seed(seed)
        start = torch.randn((2, len(self.points), 3), generator=random, dtype=torch.float64) * START
        self.rotation, self.translation = (part.clone().to(nodes.volume).requires_grad_() for part in start)

    @property
    def groups(self) -> list[dict[str, Any]]:
        """Rotations and translations with their step sizes."""
        return [
            {"params": [self.rotation], "lr": ROTATION_RATE},
            {"params": [self.translation], "lr": TRANSLATION_RATE},
        ]

    def displacement(self) -> Tensor:
        """(D, H, W, 3) mm along the grid's axes."""
        moved = apply_exp(torch.cat([self.rotation, self.translation], dim=1), self.points) - self.points
        return (moved @ self.nodes.axes).reshape(*self.nodes.volume.shape, 3)

    def penalty(self, displacement: Tensor) -> Tensor:
        """Mean norm of the logarithms of the singular values of I + du/dx."""
        jacobian = torch.stack(self.nodes.differences(displacement), dim=-1).reshape(-1, 3, 3)
        identity = torch.eye(3, dtype=jacobian.dtype, device=jacobian.device)
        return WEIGHT * log_singular_norm(jacobian + identity).mean()


def log_singular_norm(matrices: Tensor) -> Tensor:
    """Euclidean norm (N,) of the logarithms of the singular values of (N, 3, 3), FLOOR added to each of these."""
    return _LogSingularNorm.apply(matrices)


class _LogSingularNorm(torch.autograd.Function):
    """The derivative by a singular value goes along its pair of singular vectors, whether or not another is equal."""

    @staticmethod
    def forward(ctx, matrices):
        """Norms, and what the derivative needs."""
        left, values, right = torch.linalg.svd(matrices)
        logs = (values + FLOOR).log()
        norms = logs.norm(dim=1)
        slopes = logs / ((values + FLOOR) * norms.clamp(min=1e-30)[:, None])
        ctx.save_for_backward(left * slopes[:, None] @ right)
        return norms

    @staticmethod
    def backward(ctx, *gradients):  # pyright: ignore[reportIncompatibleMethodOverride]
        """Derivative by the matrices."""
        (slopes,) = ctx.saved_tensors
        return gradients[0][:, None, None] * slopes
