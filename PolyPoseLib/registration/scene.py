"""The CT taken apart for rendering: one rigid body per structure, and the soft tissue with the bones filled in."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import find_objects

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.volume import Volume, hounsfield_to_attenuation
from PolyPoseLib.geometry.grid import Grid, block_centres, block_factors, block_mean, coarsened_affine
from PolyPoseLib.registration.articulations import find_articulations
from PolyPoseLib.rendering.rigid import Body
from PolyPoseLib.warp.composition import fill_structures, grow_regions

WORKING_MM = 1.2
"""The CT is averaged to about this voxel before anything is rendered from it."""


class Scene:
    """Everything that is rendered, at any resolution.

    Parameters
    ----------
    ct : Volume
        In HU.
    structures : Structures
        On the CT's grid.
    anchor : str
        Name of the structure that defines the cameras.
    working_mm : float
        The CT is averaged to about this voxel first.

    Attributes
    ----------
    names : tuple of str
        Of the K structures, in the order of all poses.
    anchor : int
        Index of the structure that defines the cameras.
    centres : (K, 3) ndarray
        Centroids, LPS mm.

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
        hounsfield = block_mean(ct.voxels, factors, outside=-1000.0)
        labels = block_centres(structures.labels, factors)
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

    @property
    def moving(self) -> list[int]:
        """Indices of all structures but the anchor."""
        return [k for k in range(len(self.names)) if k != self.anchor]

    @property
    def rest_poses(self) -> np.ndarray:
        """(K, 4, 4) identities: every structure where the CT has it."""
        return np.stack([np.eye(4)] * len(self.names))

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


def body_points(body: Body, most: int = 1500) -> np.ndarray:
    """(N, 3) LPS mm, about ``most`` points spread over a body's voxels."""
    index = np.argwhere(body.voxels > 0.1 * body.voxels.max())[:, ::-1]
    index = index[:: max(1, len(index) // most)]
    return index @ body.affine[:3, :3].T + body.affine[:3, 3]
