"""One pair of a training set: a CT, the same patient in another posture, and X-rays of that posture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import torch
from torch import Tensor

from PolyPoseLib.baselines.trained.grid_projector import GridProjector
from PolyPoseLib.baselines.trained.network_grid import NetworkGrid
from PolyPoseLib.baselines.trained.network_inputs import View, lifted, scaled_ct
from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError

LOSS_PIXELS = 48
"""Rows and columns, at most, of the images that the loss in 2D compares."""


@dataclass(frozen=True, eq=False)
class TrainingPair:
    """One pair; whoever trains gives an iterator of them.

    Attributes
    ----------
    moving : Volume
        The CT, HU.
    fixed : Volume
        The same patient in the posture of the X-rays, HU, in the same world, on any grid.
    views : tuple[View, ...]
        X-rays of the fixed posture with their true cameras; as many of every pair, from nearly the same directions.
    field : DisplacementField
        From fixed to moving points: the truth of a simulation, or what a 3D/3D registration found.
    points : (M, 3) array
        Fixed points, LPS mm, at which the error of held-out pairs is measured: of bones, say.
    moved : (M, 3) array
        Their displacement in mm.
    simulated : bool
        Whether the CT in the other posture was computed and is no scan of a patient.

    """

    moving: Volume
    fixed: Volume
    views: tuple[View, ...]
    field: DisplacementField
    points: np.ndarray
    moved: np.ndarray
    simulated: bool = False

    def __post_init__(self) -> None:
        """Check that the parts fit together; raises InputError."""
        if not self.views:
            raise InputError("A training pair has no X-ray: give one or more.")
        if np.ndim(self.points) != 2 or np.shape(self.points)[1] != 3 or not len(self.points):
            raise InputError("A training pair needs points (M, 3) in mm at which its error is measured.")
        if np.shape(self.moved) != np.shape(self.points):
            raise InputError("A training pair needs one displacement for each of its points.")


@dataclass(frozen=True, eq=False)
class PreparedPair:
    """A pair on the network's grid; half precision, since a training set has many.

    Attributes
    ----------
    moving, fixed : (1, k, j, i) tensors of float16
        CTs from -1 to 1.
    lifted : (V, k, j, i) tensor of float16
        Back-projected X-rays.
    images : tuple of (H, W) tensors
        The X-rays that the loss in 2D compares.
    displacement : (3, k, j, i) tensor of float16
        In normalised coordinates.
    points, moved : (M, 3) tensors
        Normalised coordinates of the points, and their true displacement in mm.
    half_axes : (3, 3) tensor
        From normalised displacements to mm.
    projector : GridProjector
        Renders volumes as `images`; shared by pairs of one geometry.

    """

    moving: Tensor
    fixed: Tensor
    lifted: Tensor
    images: tuple[Tensor, ...]
    displacement: Tensor
    points: Tensor
    moved: Tensor
    half_axes: Tensor
    projector: GridProjector

    @property
    def rest_mm(self) -> float:
        """Mean distance at the points between doing nothing and the truth."""
        return float(self.moved.norm(dim=1).mean())

    def error_mm(self, displacement: Tensor) -> float:
        """Mean distance at the points between a displacement (3, k, j, i) and the truth."""
        at = self.points[None, None, None]
        found = torch.nn.functional.grid_sample(
            displacement[None].float(), at, padding_mode="border", align_corners=True
        )[0, :, 0, 0].T
        return float((found @ self.half_axes.T - self.moved).norm(dim=1).mean())


@dataclass
class Preparation:
    """Puts pairs on the network's grid; pairs of one CT and the same cameras share what takes long to compute.

    Attributes
    ----------
    side : int
        Nodes along every axis.

    """

    side: int
    _projectors: dict[bytes, GridProjector] = field(default_factory=dict, repr=False)
    _volumes: dict[int, tuple[Volume, Tensor]] = field(default_factory=dict, repr=False)

    def __call__(self, pair: TrainingPair) -> PreparedPair:
        """The pair on the grid of its moving CT."""
        grid = NetworkGrid.of(pair.moving, self.side)
        small = [view.binned(LOSS_PIXELS) for view in pair.views]
        return PreparedPair(
            moving=self._moving(pair.moving, grid),
            fixed=_half(scaled_ct(pair.fixed, grid)[None]),
            lifted=_half(lifted(pair.views, grid)),
            images=tuple(torch.from_numpy(view.image) for view in small),
            displacement=_half(grid.displacement(pair.field)),
            points=torch.from_numpy(grid.normalised(pair.points)).float(),
            moved=torch.from_numpy(np.asarray(pair.moved)).float(),
            half_axes=torch.from_numpy(grid.half_axes).float(),
            projector=self._projector(grid, small),
        )

    def _moving(self, ct: Volume, grid: NetworkGrid) -> Tensor:
        """The moving CT on the grid, computed once while it is the same object."""
        known = self._volumes.get(id(ct))
        if known is None or known[0] is not ct:
            known = self._volumes[id(ct)] = (ct, _half(scaled_ct(ct, grid)[None]))
        return known[1]

    def _projector(self, grid: NetworkGrid, views: Sequence[View]) -> GridProjector:
        """The renderer of a geometry, made once."""
        parts = [
            grid.affine,
            *(part for view in views for part in (view.camera.intrinsics, view.camera.extrinsic)),
        ]
        key = b"".join(np.ascontiguousarray(part).tobytes() for part in parts)
        if key not in self._projectors:
            self._projectors[key] = GridProjector(grid, [view.camera for view in views])
        return self._projectors[key]


def _half(values: np.ndarray) -> Tensor:
    """As a tensor of half precision."""
    return torch.from_numpy(values).half()
