"""The CT taken apart for rendering: one rigid body per structure, and the soft tissue with the bones filled in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import find_objects

from PolyPoseLib.imaging.structures import Structures
from PolyPoseLib.imaging.volume import Volume, hounsfield_to_attenuation
from PolyPoseLib.registration.articulations import find_articulations
from PolyPoseLib.rendering.rigid import Body
from PolyPoseLib.warp.composition import fill_structures, grow_regions

WORKING_MM = 1.2
"""The CT is averaged to about this voxel before anything is rendered from it."""


@dataclass(frozen=True)
class Grid:
    """Voxels (k, j, i) float32 with their affine (4, 4), index (i, j, k) to LPS mm."""

    voxels: np.ndarray
    affine: np.ndarray

    def coarsened(self, target_mm: float) -> Grid:
        """Block means, whole factors per axis, voxels of about ``target_mm``; edges are padded with zeros."""
        factors = block_factors(self.affine, target_mm)
        if max(factors) == 1:
            return self
        return Grid(_block_mean(self.voxels, factors), coarsened_affine(self.affine, factors))

    def padded(self) -> Grid:
        """The same with a border of zeros, one voxel wide."""
        affine = self.affine.copy()
        affine[:3, 3] -= affine[:3, :3] @ np.ones(3)
        return Grid(np.pad(self.voxels, 1), affine)


class Scene:
    """Everything that is rendered, at any resolution.

    names: of the K structures, in the order of all poses; anchor: index of the one that defines the cameras;
    centres: (K, 3) centroids, LPS mm.
    """

    def __init__(
        self, ct: Volume, structures: Structures, anchor: str, working_mm: float = WORKING_MM
    ) -> None:
        self.names = structures.names
        self.anchor = structures.index(anchor)
        self.structures = structures
        self.centres = structures.centroids(ct.affine)
        self.ct_affine = ct.affine
        factors = block_factors(ct.affine, working_mm)
        affine = coarsened_affine(ct.affine, factors)
        hounsfield = _block_mean(ct.voxels, factors, outside=-1000.0)
        labels = _block_centres(structures.labels, factors)
        spacing = np.linalg.norm(affine[:3, :3], axis=0)
        self.owners = grow_regions(hounsfield, labels, spacing)
        self._boxes = find_objects(self.owners, max_label=len(self.names))
        filled = fill_structures(hounsfield, self.owners, spacing, grow=False)
        self.whole = Grid(hounsfield_to_attenuation(hounsfield).astype(np.float32), affine)
        self.soft = Grid(hounsfield_to_attenuation(filled).astype(np.float32), affine)
        self.articulations = find_articulations(structures, ct.affine, self.anchor)
        self._bodies: dict[float, list[Body]] = {}
        self._volumes: dict[tuple[str, float], Body] = {}

    @property
    def anchor_centre(self) -> np.ndarray:
        """(3,) LPS mm; cameras are perturbed about it."""
        return self.centres[self.anchor]

    def bodies(self, voxel_mm: float) -> list[Body]:
        """One body per structure: what its bone adds to the soft tissue that fills its place."""
        if voxel_mm not in self._bodies:
            self._bodies[voxel_mm] = [self._body(n, voxel_mm) for n in range(len(self.names))]
        return self._bodies[voxel_mm]

    def volume(self, kind: str, voxel_mm: float) -> Body:
        """The "whole" CT or its "soft" tissue as one body that moves with the anchor."""
        if (kind, voxel_mm) not in self._volumes:
            grid = {"whole": self.whole, "soft": self.soft}[kind].coarsened(voxel_mm).padded()
            self._volumes[kind, voxel_mm] = Body(grid.voxels, grid.affine, self.anchor_centre)
        return self._volumes[kind, voxel_mm]

    def _body(self, number: int, voxel_mm: float) -> Body:
        box = self._boxes[number] or (slice(0, 1),) * 3
        excess = (self.whole.voxels[box] - self.soft.voxels[box]) * (self.owners[box] == number + 1)
        affine = self.whole.affine.copy()
        affine[:3, 3] += affine[:3, :3] @ np.array([s.start for s in reversed(box)], float)
        grid = Grid(excess.astype(np.float32), affine).coarsened(voxel_mm).padded()
        return Body(grid.voxels, grid.affine, self.centres[number])


def block_factors(affine: np.ndarray, target_mm: float) -> tuple[int, int, int]:
    """How many voxels along (i, j, k) make up about ``target_mm``."""
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    i, j, k = (max(1, round(target_mm / s)) for s in spacing)
    return i, j, k


def coarsened_affine(affine: np.ndarray, factors: tuple[int, int, int]) -> np.ndarray:
    """Affine of block means: a block's centre lies half a block less half a voxel from its first voxel's."""
    scale = np.array(factors, float)
    coarse = affine.copy()
    coarse[:3, :3] = affine[:3, :3] * scale
    coarse[:3, 3] = affine[:3, 3] + affine[:3, :3] @ ((scale - 1) / 2)
    return coarse


def _block_mean(voxels: np.ndarray, factors: tuple[int, int, int], outside: float = 0.0) -> np.ndarray:
    """Block means in slabs, so that no second copy of a large volume is made."""
    fi, fj, fk = factors
    if max(factors) == 1:
        return voxels.astype(np.float32)
    depth, height, width = (-(-n // f) for n, f in zip(voxels.shape, (fk, fj, fi), strict=True))
    means = np.empty((depth, height, width), np.float32)
    for k in range(depth):
        slab = voxels[k * fk : (k + 1) * fk].astype(np.float32)
        missing = ((0, fk - len(slab)), (0, height * fj - slab.shape[1]), (0, width * fi - slab.shape[2]))
        slab = np.pad(slab, missing, constant_values=outside)
        means[k] = slab.reshape(fk, height, fj, width, fi).mean(axis=(0, 2, 4))
    return means


def _block_centres(labels: np.ndarray, factors: tuple[int, int, int]) -> np.ndarray:
    """The label of the voxel in each block's middle."""
    fi, fj, fk = factors
    depth, height, width = (-(-n // f) for n, f in zip(labels.shape, (fk, fj, fi), strict=True))
    index = [
        np.minimum(np.arange(n) * f + f // 2, size - 1)
        for n, f, size in zip((depth, height, width), (fk, fj, fi), labels.shape, strict=True)
    ]
    return labels[np.ix_(*index)]
