"""The inverse of a displacement field, and its Jacobian determinants, in torch on a GPU."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.warp.torch_cells import Cells, transformed


class TorchField:
    """A displacement field on a device.

    Parameters
    ----------
    field : DisplacementField
        Fixed to moving.
    device : torch.device
        Where it is sampled.

    """

    def __init__(self, field: DisplacementField, device: torch.device) -> None:
        self.device, self.shape, self.affine = device, field.shape, field.affine
        self.vectors = torch.as_tensor(field.vectors, device=device).double()
        self._to_nodes = torch.as_tensor(np.linalg.inv(field.affine), dtype=torch.float64, device=device)

    def __call__(self, points: Tensor) -> Tensor:
        """Displacements (N, 3) float64 mm at points (N, 3) float64 LPS mm, clamped to the grid."""
        cells = Cells.holding(transformed(self._to_nodes, points), self.shape)
        return cells.interpolated(self.vectors.reshape(-1, 3))

    def inverse_at(
        self, points: Tensor, tolerance_mm: float, iterations: int, least_step: float
    ) -> tuple[Tensor, Tensor]:
        """As :func:`PolyPoseLib.warp.inverse.invert_without_kernel`, of points (N, 3) on the device.

        least_step: share of the error that is corrected at once, below which a point is given up.
        """
        inverse = -self(points)
        kept, error = inverse.clone(), torch.zeros_like(inverse)
        best = torch.full_like(inverse[:, 0], torch.inf)
        step = torch.ones_like(best)
        active = torch.arange(len(points), device=self.device)
        for _ in range(iterations):
            offset = inverse[active] + self(points[active] + inverse[active])
            size = torch.linalg.vector_norm(offset, dim=1)
            better = size < best[active]
            step[active[~better]] *= 0.5
            improved = active[better]
            best[improved], kept[improved] = size[better], inverse[improved]
            error[improved] = offset[better]
            active = active[(best[active] > tolerance_mm) & (step[active] > least_step)]
            if not len(active):
                break
            inverse[active] = kept[active] - step[active, None] * error[active]
        return kept, best

    def determinants(self) -> np.ndarray:
        """As :func:`PolyPoseLib.warp.dense.jacobian_determinant`."""
        axes = torch.as_tensor(self.affine[:3, :3], dtype=torch.float64, device=self.device)
        whole = float(np.linalg.det(self.affine[:3, :3]))
        slopes = torch.gradient(self.vectors, dim=(2, 1, 0))
        along_i, along_j, along_k = (slope + axes[:, n] for n, slope in enumerate(slopes))
        found = (along_i * torch.linalg.cross(along_j, along_k, dim=-1)).sum(-1) / whole
        return found.float().cpu().numpy()
