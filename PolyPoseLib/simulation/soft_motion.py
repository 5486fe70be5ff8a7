"""Soft organs that are moved on purpose, beyond what bones do to them, and lungs whose density follows their volume."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.data.volume import AIR_HU
from PolyPoseLib.simulation.harmonic import interpolate_axis
from PolyPoseLib.simulation.motion import apply

if TYPE_CHECKING:
    from PolyPoseLib.simulation.fixed_grid import FixedGrid


@dataclass(frozen=True)
class SoftMotion:
    """Displacements that soft tissue is given, and the lungs.

    Attributes
    ----------
    points : (N, 3) array
        LPS mm in the moving frame.
    displacements : (N, 3) array
        Where they go in the fixed frame, relative to where they are, mm.
    lungs : (k, j, i) array of bool, optional
        On the CT's grid: where density follows volume, so that no mass is lost.

    """

    points: np.ndarray
    displacements: np.ndarray
    lungs: np.ndarray | None = None

    def mapped(self, matrix: np.ndarray) -> SoftMotion:
        """The same motion in a world that a (4, 4) matrix maps this one to."""
        moved = self.displacements @ matrix[:3, :3].T
        return SoftMotion(apply(matrix, self.points), moved, self.lungs)

    def add_to(self, values: np.ndarray, known: np.ndarray, grid: FixedGrid) -> tuple[np.ndarray, np.ndarray]:
        """Give these displacements to the nodes that no bone holds.

        Parameters
        ----------
        values : (3, k, j, i) array of float32
            Displacement fixed to moving in mm on the grid's nodes, read where known.
        known : (k, j, i) array of bool
            Nodes of bones.
        grid : FixedGrid
            Of the nodes.

        Returns
        -------
        values, known
            With the mean over the points that come to lie at a node.

        """
        values, held = values.copy(), known.copy()
        index = apply(np.linalg.inv(grid.node_affine), self.points + self.displacements)[:, ::-1]
        nearest = np.rint(index).astype(np.int64)
        inside = np.all((nearest >= 0) & (nearest < known.shape), axis=1)
        cells = np.ravel_multi_index(nearest[inside].T, known.shape)
        count = np.bincount(cells, minlength=known.size).reshape(known.shape)
        free = (count > 0) & ~known
        for axis in range(3):
            total = np.bincount(cells, -self.displacements[inside, axis], known.size).reshape(known.shape)
            values[axis][free] = total[free] / count[free]
        return values, held | free


def keep_mass(hu: np.ndarray, lungs: np.ndarray, determinants: np.ndarray, grid: FixedGrid) -> None:
    """Scale the density of lungs by how much tissue comes to lie in their place.

    A volume element of the fixed frame holds the matter of J elements of the moving frame, J being the determinant of
    the map from fixed to moving points.

    Parameters
    ----------
    hu : (k, j, i) array
        Hounsfield units on the fixed grid, changed in place.
    lungs : (k, j, i) array of bool
        Which of it is lung.
    determinants : (k, j, i) array
        J on the grid's nodes.
    grid : FixedGrid
        Of both.

    """
    for k in np.flatnonzero(lungs.any(axis=(1, 2))):
        ratio = np.maximum(node_slice(determinants[None], int(k), grid)[0][lungs[k]], 0)
        hu[k][lungs[k]] = AIR_HU + (hu[k][lungs[k]] - AIR_HU) * ratio


def node_slice(nodes: np.ndarray, k: int, grid: FixedGrid) -> np.ndarray:
    """Values (C, j, i) on slice k of the fixed grid from those (C, k, j, i) on its nodes."""
    field = interpolate_axis(nodes, np.array([k / grid.factor[0]]), 1)[:, 0]
    field = interpolate_axis(field, np.arange(grid.shape[1]) / grid.factor[1], 1)
    return interpolate_axis(field, np.arange(grid.shape[2]) / grid.factor[2], 2)
