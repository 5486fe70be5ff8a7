"""Distances to the structures, at any point, and the weights of the structures' motions made from them.

A distance map holds the signed Euclidean distance to one structure in mm: 0 at voxels on its border, negative
deeper inside, positive outside. The sign exists only so that interpolation keeps the border in place; whoever
looks a distance up gets 0 inside. Between nodes the signed map is interpolated trilinearly and then clamped
at 0, so that the distance is exactly 0 wherever all surrounding nodes belong to the structure.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol, get_args

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import grid_sample

from PolyPoseLib.data.options import USUAL_EPSILON
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.grid import covering_grid, require_grid
from PolyPoseLib.warp.distances import distance_at_nodes, distance_at_voxels

WeightForm = Literal["mass", "epsilon", "rigid"]
"""Weight of a structure of volume share m at distance d: m/(1+d^2), 1/(1+epsilon d^2), m/(delta^2+d^2)."""

RIGID_DELTA_MM = 1e-4
"""Distance below which a structure owns a point altogether ("rigid" weights)."""

MEMORY_BUDGET_BYTES = 1 << 30
"""Memory that all distance maps together may take before their grid is made coarser."""

COARSE_SPACING_MM = 1.5
"""Maps that do not fit on the labels' grid are not made finer than this."""

MARGIN_MM = 10.0
"""Distances are exact this far beyond the CT's voxels, because motions carry points out of the CT."""


class LabelMap(Protocol):
    """What distance_maps needs of PolyPoseLib.data.structures.Structures."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the K structures."""
        ...

    @property
    def labels(self) -> np.ndarray:
        """(k, j, i); n belongs to names[n - 1]."""
        ...


@dataclass(frozen=True)
class DistanceMaps:
    """Signed distances to K structures on one grid.

    Attributes
    ----------
    signed : (K, k, j, i) Tensor
        mm, floating point, positive outside.
    affine : (4, 4) array of float64
        Index (i, j, k) to moving LPS mm, orthogonal axes, any handedness.

    """

    signed: Tensor
    affine: np.ndarray

    @property
    def count(self) -> int:
        """Number of structures K."""
        return self.signed.shape[0]

    def to(self, device: torch.device | str | None = None, dtype: torch.dtype | None = None) -> DistanceMaps:
        """The same maps on another device or in another floating-point type."""
        return DistanceMaps(self.signed.to(device=device, dtype=dtype), self.affine)

    def __call__(self, points: Tensor) -> Tensor:
        """Distances (K, N) mm of moving points (N, 3) LPS mm to every structure."""
        return self.under(points, torch.eye(4, dtype=torch.float64)[None])

    def under(self, points: Tensor, poses: Tensor) -> Tensor:
        """Distances of points to the structures, each taken after the structure's own pose: d_k(T_k x).

        Parameters
        ----------
        points : (N, 3) Tensor
            Fixed LPS mm.
        poses : (K, 4, 4) or (1, 4, 4) Tensor
            Fixed to moving, LPS mm.

        Returns
        -------
        (K, N) Tensor
            mm, 0 inside, of the points' type and on their device; differentiable in points and poses. A point
            beyond the grid gets the distance at the nearest point of the grid's box plus the distance to the box.

        """
        matrix = self._to_unit_box(poses).to(points)
        place = points @ matrix[:, :3, :3].transpose(1, 2) + matrix[:, None, :3, 3]
        lookup = place.to(self.signed).expand(self.count, -1, -1)
        inside = grid_sample(
            self.signed[:, None],
            lookup[:, None, None],
            mode="bilinear",
            padding_mode="border",
            align_corners=True,
        )
        distance = inside[:, 0, 0, 0].to(points).clamp_min(0)
        excess = place - place.detach().clamp(-1, 1)
        beyond = (place.detach().abs() > 1).any(-1)
        if beyond.any():
            outside = torch.where(beyond[..., None], excess, torch.zeros_like(excess)) * self._half_extent(
                points
            )
            distance = distance + torch.linalg.vector_norm(outside, dim=-1)
        return distance

    def _to_unit_box(self, poses: Tensor) -> Tensor:
        """(K, 4, 4) float64 matrices from fixed mm to the grid's box, whose node centres span [-1, 1]."""
        last = np.maximum(np.array(self.signed.shape[:0:-1]) - 1, 1)
        scale = np.diag([*(2.0 / last), 1.0])
        scale[:3, 3] = -1.0
        matrix = torch.as_tensor(scale @ np.linalg.inv(self.affine), dtype=torch.float64, device=poses.device)
        return matrix @ poses.to(torch.float64)

    def _half_extent(self, like: Tensor) -> Tensor:
        """Half the size (3,) of the box in mm along (i, j, k)."""
        last = np.maximum(np.array(self.signed.shape[:0:-1]) - 1, 1)
        return torch.as_tensor(last * np.linalg.norm(self.affine[:3, :3], axis=0) / 2).to(like)


def distance_maps(
    structures: LabelMap,
    affine: np.ndarray,
    spacing_mm: float | None = None,
    margin_mm: float = MARGIN_MM,
    budget_bytes: int = MEMORY_BUDGET_BYTES,
) -> DistanceMaps:
    """Exact signed Euclidean distances to every structure, one after another, on the labels' own grid.

    Parameters
    ----------
    structures : LabelMap
        Names (K) and labels (k, j, i), n belonging to names[n-1].
    affine : (4, 4) array
        Index (i, j, k) of the labels to moving LPS mm.
    spacing_mm : float, optional
        Distance between the maps' nodes. None keeps the labels' grid while all maps fit into budget_bytes, and
        the finest coarser grid that fits otherwise. Bones are exactly rigid on the labels' grid only; on a
        coarser one their edges can be off by a fraction of its spacing.
    margin_mm : float
        How far the maps reach beyond the labels' grid.
    budget_bytes : int
        See spacing_mm.

    Returns
    -------
    DistanceMaps
        In float32. Memory while computing: the maps, and about 12 bytes per voxel.

    Raises
    ------
    InputError
        A structure without voxels, or an affine that is not a grid.

    """
    require_grid(affine, "the structures' labels")
    labels = np.asarray(structures.labels)
    count = len(structures.names)
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    pad = np.ceil(margin_mm / spacing).astype(int)
    shape = tuple(int(n) for n in np.array(labels.shape) + 2 * pad[::-1])
    if spacing_mm is None and 4 * count * np.prod(shape, dtype=float) > budget_bytes:
        spacing_mm = _fitting_spacing(affine, labels.shape, count, margin_mm, budget_bytes)
    native = spacing_mm is None or spacing_mm <= spacing.min()
    if spacing_mm is None or native:
        grid = affine.copy()
        grid[:3, 3] -= affine[:3, :3] @ pad
    else:
        grid, shape = covering_grid(affine, labels.shape, spacing_mm, margin_mm)
    index = _node_positions(affine, grid, shape)
    signed = torch.empty((count, *shape), dtype=torch.float32)
    for n, (name, box) in enumerate(zip(structures.names, _boxes(labels, count), strict=True)):
        if box is None:
            raise InputError(f"The structure '{name}' has no voxel: check its labels in the study.")
        if native:
            distance = distance_at_voxels(labels == n + 1, spacing, pad)
        else:
            distance = distance_at_nodes(labels[box] == n + 1, box, spacing, index)
        signed[n] = torch.from_numpy(distance)
    return DistanceMaps(signed, grid)


def weights(
    distance: Tensor, share: Tensor, form: WeightForm = "rigid", epsilon: float = USUAL_EPSILON
) -> Tensor:
    """Weights of the structures' motions, which sum to 1 at every point.

    Parameters
    ----------
    distance : (K, N) Tensor
        mm, 0 inside.
    share : (K,) Tensor
        Share m of each structure in the structures' volume, above 0 (no unit).
    form : WeightForm
        "mass" m/(1+d^2) (the paper's), "epsilon" 1/(1+epsilon d^2) (its predecessor; ignores share), or "rigid"
        m/(delta^2+d^2) with delta = RIGID_DELTA_MM: inverse-distance interpolation (D. Shepard, ACM 1968), which
        leaves every structure its whole weight inside itself.
    epsilon : float
        1/mm^2, for "epsilon".

    Returns
    -------
    (K, N) Tensor

    Raises
    ------
    InputError
        A form that is not one of the three.

    """
    squared = distance * distance
    mass = share.to(distance)[:, None]
    if form == "mass":
        raw = mass / (1 + squared)
    elif form == "epsilon":
        raw = 1 / (1 + epsilon * squared)
    elif form == "rigid":
        raw = mass / (RIGID_DELTA_MM**2 + squared)
    else:
        raise InputError(
            f"The weight form {form!r} is not known; choose one of {', '.join(get_args(WeightForm))}."
        )
    return raw / raw.sum(0, keepdim=True)


def _boxes(labels: np.ndarray, count: int) -> list[tuple[slice, ...] | None]:
    """The box of each label 1..count, None where it has no voxel."""
    from scipy.ndimage import find_objects

    return find_objects(labels, max_label=count)


def _node_positions(affine: np.ndarray, grid: np.ndarray, shape: tuple[int, ...]) -> list[np.ndarray]:
    """Positions of a parallel grid's nodes along i, j and k, in voxels of affine."""
    to_voxel = np.linalg.inv(affine) @ grid
    return [to_voxel[n, n] * np.arange(shape[2 - n]) + to_voxel[n, 3] for n in range(3)]


def _fitting_spacing(
    affine: np.ndarray, shape: tuple[int, int, int], count: int, margin_mm: float, budget_bytes: int
) -> float:
    """The finest spacing in mm, in steps of 5 percent, at which count maps fit into budget_bytes."""
    spacing = max(float(np.linalg.norm(affine[:3, :3], axis=0).min()), COARSE_SPACING_MM)
    while (
        4 * count * np.prod(covering_grid(affine, shape, spacing, margin_mm)[1], dtype=float) > budget_bytes
    ):
        spacing *= 1.05
    return spacing
