"""The grid on which a network sees a CT: a cube of nodes over its box, axes nearest to left, posterior, superior.

Displacements live there in normalised coordinates, as torch.nn.functional.grid_sample counts them: -1 and 1 are the
first and the last node of an axis, x along i first. A network thus knows no millimetres; this file turns them back.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations

import numpy as np
from scipy.ndimage import map_coordinates

from PolyPoseLib.data.displacement_field import DisplacementField, trilinear
from PolyPoseLib.data.volume import AIR_HU, Volume
from PolyPoseLib.geometry.grid import block_mean, coarsened_affine, covering_grid, require_grid

FIELD_MM = 4.0
"""Nodes of the field that a system answers with are no farther apart."""


@dataclass(frozen=True, eq=False)
class NetworkGrid:
    """A cube of nodes over a CT.

    Attributes
    ----------
    affine : (4, 4) array
        Index (i, j, k, 1) to LPS mm; whatever the CT's storage order, i is nearest to left, j to posterior and k to
        superior, so that a network trained on one order reads another alike.
    side : int
        Nodes along every axis.

    """

    affine: np.ndarray
    side: int

    @classmethod
    def of(cls, ct: Volume, side: int) -> NetworkGrid:
        """The grid from the first to the last voxel's centre of a CT along each axis; raises InputError when bent."""
        require_grid(ct.affine, "the CT")
        directions = ct.affine[:3, :3] / ct.spacing
        order = max(
            permutations(range(3)), key=lambda axes: sum(abs(directions[n, axes[n]]) for n in range(3))
        )
        sizes = np.array(ct.shape[::-1])
        affine, first = np.eye(4), np.zeros(3)
        for world, axis in enumerate(order):
            column = ct.affine[:3, axis]
            if column[world] < 0:
                first[axis] = sizes[axis] - 1
                column = -column
            # A CT of one slice still needs nodes that are apart.
            affine[:3, world] = column * (max(sizes[axis] - 1, 1) / (side - 1))
        affine[:3, 3] = ct.to_world(first)
        return cls(affine, side)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Nodes along (k, j, i)."""
        return self.side, self.side, self.side

    @property
    def spacing(self) -> np.ndarray:
        """Distance between nodes along (i, j, k) in mm, shape (3,)."""
        return np.linalg.norm(self.affine[:3, :3], axis=0)

    @property
    def extent_mm(self) -> np.ndarray:
        """From the first to the last node along (i, j, k), shape (3,)."""
        return self.spacing * (self.side - 1)

    @property
    def middle(self) -> np.ndarray:
        """(3,) LPS mm."""
        return self.affine[:3, 3] + self.half_axes.sum(axis=1)

    @property
    def half_axes(self) -> np.ndarray:
        """(3, 3): a displacement in normalised coordinates to LPS mm."""
        return self.affine[:3, :3] * ((self.side - 1) / 2)

    def points(self) -> np.ndarray:
        """The nodes in LPS mm, (k, j, i, 3)."""
        index = np.stack(
            np.meshgrid(*(np.arange(self.side, dtype=np.float64),) * 3, indexing="ij")[::-1], axis=-1
        )
        return index @ self.affine[:3, :3].T + self.affine[:3, 3]

    def normalised(self, points: np.ndarray) -> np.ndarray:
        """LPS mm (..., 3) to normalised coordinates (..., 3)."""
        return (np.asarray(points, dtype=np.float64) - self.middle) @ np.linalg.inv(self.half_axes).T

    def resampled(self, volume: Volume, outside: float = AIR_HU) -> np.ndarray:
        """A volume on the nodes, (k, j, i) float32, averaged first over the voxels that fall between two nodes."""
        coarse = self.coarsened(volume, outside)
        out = np.empty(self.shape, np.float32)
        for k, plane in enumerate(self.points()):
            index = np.moveaxis(coarse.to_index(plane)[..., ::-1], -1, 0)
            # Half a block beyond the outermost block's centre is still the volume.
            inside = np.all(
                [(row > -0.5) & (row < n - 0.5) for row, n in zip(index, coarse.shape, strict=True)], axis=0
            )
            values = map_coordinates(coarse.voxels, index, order=1, mode="nearest")
            out[k] = np.where(inside, values, outside)
        return out

    def coarsened(self, volume: Volume, outside: float = AIR_HU) -> Volume:
        """A volume averaged over blocks of as many whole voxels as there are between two nodes, float32."""
        factors = self.factors(volume)
        return Volume(block_mean(volume.voxels, factors, outside), coarsened_affine(volume.affine, factors))

    def factors(self, volume: Volume) -> tuple[int, int, int]:
        """Whole voxels of a volume along its (i, j, k) between two nodes, 1 at least."""
        wanted = np.maximum(np.floor(self._along(volume) / volume.spacing + 1e-6).astype(int), 1)
        i, j, k = (int(factor) for factor in np.minimum(wanted, np.array(volume.shape[::-1])))
        return i, j, k

    def _along(self, volume: Volume) -> np.ndarray:
        """Distance of the nodes along each axis (i, j, k) of a volume, mm."""
        cosines = np.abs((volume.affine[:3, :3] / volume.spacing).T @ (self.affine[:3, :3] / self.spacing))
        return self.spacing[cosines.argmax(axis=1)]

    def displacement(self, field: DisplacementField) -> np.ndarray:
        """A field on the nodes in normalised coordinates, (3, k, j, i) float32."""
        vectors = field.sample(self.points()) @ np.linalg.inv(self.half_axes).T
        return np.ascontiguousarray(np.moveaxis(vectors, -1, 0), dtype=np.float32)

    def field(self, displacement: np.ndarray, ct: Volume) -> DisplacementField:
        """A displacement (3, k, j, i) of the network as a field in mm that covers a CT at FIELD_MM or finer."""
        vectors = np.ascontiguousarray(np.moveaxis(displacement, 0, -1)) @ self.half_axes.T
        affine, shape = covering_grid(ct.affine, ct.shape, FIELD_MM, keep_coarser=False)
        inverse = np.linalg.inv(self.affine)
        fine = np.empty((*shape, 3), np.float32)
        index = np.stack(
            np.meshgrid(*(np.arange(n, dtype=np.float64) for n in shape[:0:-1]), indexing="xy"), axis=-1
        )
        for k in range(shape[0]):
            nodes = np.concatenate([index, np.full((*index.shape[:2], 1), float(k))], axis=-1).reshape(-1, 3)
            points = nodes @ affine[:3, :3].T + affine[:3, 3]
            fine[k] = trilinear(vectors, points @ inverse[:3, :3].T + inverse[:3, 3]).reshape(
                *index.shape[:2], 3
            )
        return DisplacementField(fine, affine)
