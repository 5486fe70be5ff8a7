"""The CT taken apart for rendering: one rigid body per structure, and the soft tissue with the bones filled in."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import find_objects

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.volume import AIR_HU, Volume, hounsfield_to_attenuation
from PolyPoseLib.geometry.grid import (
    Grid,
    block_centre_indices,
    block_centres,
    block_factors,
    block_mean,
    coarsened_affine,
)
from PolyPoseLib.registration.articulations import bone_clouds, find_articulations
from PolyPoseLib.registration.companions import find_companions
from PolyPoseLib.rendering.rigid import Body
from PolyPoseLib.warp.composition import fill_structures, grow_regions

WORKING_MM = 1.2
"""The CT is averaged to about this voxel before anything is rendered from it."""

SOFT_TISSUE_HU = 40.0
AIR_BELOW_HU, BONE_ABOVE_HU = -300.0, 150.0
"""Soft tissue is what lies between."""

CLIPPED_AIR_HU = (-500.0, -120.0)
"""Lowest value of a CT that was clipped to a window of soft tissue: above the lungs', and below fat's."""

CLIPPED_AIR_SHARE = 0.02
"""Of the voxels that have the lowest value, at least, where it was clipped."""

BARE_SHARE = 0.02
"""Of the voxels outside the structures that is soft tissue at most where a CT holds bones alone; of a whole CT it is a
tenth at least."""


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
    bare : bool
        Whether the CT holds bones in air; they are then rendered as if soft tissue were everywhere.

    """

    def __init__(
        self, ct: Volume, structures: Structures, anchor: str, working_mm: float = WORKING_MM
    ) -> None:
        self.names = structures.names
        self.anchor = structures.index(anchor)
        self.structures = structures
        self.centres = structures.centroids(ct.affine)
        self.ct_affine = ct.affine
        ct = with_air(ct)
        self.bare = holds_bones_alone(ct, structures)
        voxels, outside = ct.voxels, AIR_HU
        if self.bare:  # bones in air: what they add to soft tissue is rendered, as if it were everywhere
            voxels, outside = np.where(voxels < AIR_BELOW_HU, SOFT_TISSUE_HU, voxels), SOFT_TISSUE_HU
        self._factors = factors = block_factors(ct.affine, working_mm)
        affine = coarsened_affine(ct.affine, factors)
        hounsfield = block_mean(voxels, factors, outside=outside)
        labels = block_centres(structures.labels, factors)
        spacing = np.linalg.norm(affine[:3, :3], axis=0)
        self.owners = grow_regions(hounsfield, labels, spacing)
        self._boxes = find_objects(self.owners, max_label=len(self.names))
        filled = fill_structures(hounsfield, self.owners, spacing, grow=False)
        everywhere = hounsfield_to_attenuation(np.array(outside))
        self.whole = Grid((hounsfield_to_attenuation(hounsfield) - everywhere).astype(np.float32), affine)
        self.soft = Grid((hounsfield_to_attenuation(filled) - everywhere).astype(np.float32), affine)
        clouds = bone_clouds(structures, ct.affine)
        self.articulations = find_articulations(clouds, self.anchor)
        self.companions = find_companions(clouds, self.articulations)
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
            self._bodies[voxel_mm] = [
                self.body_of(n, self.box(n), self.owned(n), voxel_mm) for n in range(len(self.names))
            ]
        return self._bodies[voxel_mm]

    def volume(self, kind: str, voxel_mm: float) -> Body:
        """The "whole" CT or its "soft" tissue as one body that moves with the anchor."""
        if (kind, voxel_mm) not in self._volumes:
            grid = {"whole": self.whole, "soft": self.soft}[kind].coarsened(voxel_mm).padded()
            self._volumes[kind, voxel_mm] = Body(grid.voxels, grid.affine, self.anchor_centre)
        return self._volumes[kind, voxel_mm]

    def box(self, number: int) -> tuple[slice, ...]:
        """Slices (k, j, i) of the working voxels in which a structure lies."""
        return self._boxes[number] or (slice(0, 1),) * 3

    def owned(self, number: int) -> np.ndarray:
        """Which working voxels in a structure's box are the structure's, bool (k, j, i)."""
        return self.owners[self.box(number)] == number + 1

    def working_labels(self, labels: np.ndarray, number: int) -> np.ndarray:
        """Labels on the CT's grid at the working voxels (k, j, i) of a structure's box."""
        centres = block_centre_indices(labels.shape, self._factors)
        return labels[np.ix_(*(index[side] for index, side in zip(centres, self.box(number), strict=True)))]

    def body_of(self, number: int, box: tuple[slice, ...], voxels: np.ndarray, voxel_mm: float) -> Body:
        """Some voxels of a structure, bool in a box (k, j, i) of working voxels, as a body about its centre."""
        excess = (self.whole.voxels[box] - self.soft.voxels[box]) * voxels
        affine = self.whole.affine.copy()
        affine[:3, 3] += affine[:3, :3] @ np.array([s.start for s in reversed(box)], float)
        grid = Grid(excess.astype(np.float32), affine).coarsened(voxel_mm).padded()
        return Body(grid.voxels, grid.affine, self.centres[number])


def with_air(ct: Volume) -> Volume:
    """A CT that was clipped to a window of soft tissue with its air as air; any other as it is.

    Air at -160 HU attenuates like fat and would be everywhere: patient and direct beam would differ by a sixth of what
    they do in the X-ray.
    """
    lowest = float(ct.voxels.min())
    if not CLIPPED_AIR_HU[0] < lowest <= CLIPPED_AIR_HU[1]:
        return ct
    clipped = ct.voxels == lowest
    if clipped.mean() < CLIPPED_AIR_SHARE:
        return ct
    return Volume(np.where(clipped, np.float32(AIR_HU), ct.voxels), ct.affine)


def holds_bones_alone(ct: Volume, structures: Structures) -> bool:
    """Whether everything but bones was cut out of a CT, as models of bones are exported."""
    outside = soft = 0
    for values, labels in zip(ct.voxels, structures.labels, strict=True):  # slice by slice: CTs are large
        beside = labels == 0
        outside += int(beside.sum())
        soft += int((beside & (values > AIR_BELOW_HU) & (values < BONE_ABOVE_HU)).sum())
    return outside > 0 and soft / outside < BARE_SHARE


def body_points(body: Body, most: int = 1500) -> np.ndarray:
    """(N, 3) LPS mm, N at least 1, about ``most`` points spread over a body's voxels, or its centre where it has none.

    A body that is nowhere denser than what fills its place, such as an airway, is where it is thinner.
    """
    excess = body.voxels if body.voxels.max() > 0 else -body.voxels
    index = np.argwhere(excess > 0.1 * excess.max())[:, ::-1]
    if not len(index):
        return body.centre[None]
    index = index[:: max(1, len(index) // most)]
    return index @ body.affine[:3, :3].T + body.affine[:3, 3]
