"""A patient in motion, one posture after another: bones are rigid exactly, soft tissue is a picture behind them.

Line integrals add up. So the CT is taken apart once: what every bone has beyond soft tissue, on the CT's own voxels,
and the soft tissue without bones, on coarser ones. A posture moves each bone by moving the camera the other way, which
resamples nothing, and moves the soft tissue by a field that is solved on nodes some millimetres apart. At rest the sum
is the CT's own line integral but for the coarser soft tissue.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import distance_transform_edt, find_objects, map_coordinates
from scipy.spatial import KDTree

from PolyPoseLib.data.volume import AIR_HU, Volume, hounsfield_to_attenuation
from PolyPoseLib.geometry.grid import grown_box
from PolyPoseLib.simulation import independent_projector
from PolyPoseLib.simulation.fixed_grid import FixedGrid
from PolyPoseLib.simulation.harmonic import jacobian_determinants, solve_laplace
from PolyPoseLib.simulation.motion import apply, structure_points
from PolyPoseLib.simulation.nearest import nearest_known
from PolyPoseLib.simulation.posed_ct import BODY_HU
from PolyPoseLib.simulation.soft_motion import SoftMotion, keep_mass, node_slice

if TYPE_CHECKING:
    from PolyPoseLib.data.structures import Structures
    from PolyPoseLib.geometry.camera import Camera

SOFT_HU = 50.0
"""Of soft tissue where a bone has none around it; at most three times as much fills the place of bones."""

_SHELL_MM = 2.5
"""What lies so near to a bone goes with it: voxels that the bone fills in part."""

_MARGIN_MM = 8.0
"""Around a bone, where soft tissue is looked for to fill its place."""

_ALONE = 0.3
"""Soft tissue goes rigidly with a bone that is nearer by this factor than any other: flesh around a shaft. Between
bones its displacement is harmonic."""

_FAR_MM = 60.0
"""Room around the CT within which distances from bones are known."""

_ROUGHLY = 0.1
"""Relative error of distances from bones, which only say whose flesh is whose."""

_SPARE_MM = 8.0
"""Of that room: flesh between bones bulges."""

_POINTS = 4000
"""Of a bone or of the body that stand for all, where distances and extents are measured."""


@dataclass(frozen=True)
class MovingScene:
    """A CT taken apart so that postures are cheap.

    Attributes
    ----------
    names : tuple of str
        Of the K bones.
    reference : int
        The bone in whose place in the CT soft tissue is posed.
    bones : tuple of Volume
        What each has beyond soft tissue, 1/mm, on the CT's voxels.
    soft : Volume
        The CT without bones, Hounsfield units, on coarser voxels.
    grid : FixedGrid
        Of posed soft tissue: wide enough for every posture.
    distances : (K, k, j, i) array of float32
        From each bone in the CT, mm, on the nodes of `near`.
    near : FixedGrid
        The CT's surroundings.
    projector : str
        See :func:`PolyPoseLib.simulation.independent_projector.project`.

    """

    names: tuple[str, ...]
    reference: int
    bones: tuple[Volume, ...]
    soft: Volume
    grid: FixedGrid
    distances: np.ndarray
    near: FixedGrid
    projector: str = "auto"

    @classmethod
    def of(
        cls,
        ct: Volume,
        structures: Structures,
        reference: str,
        poses: np.ndarray,
        soft_mm: float = 2.0,
        node_mm: float = 8.0,
        projector: str = "auto",
    ) -> MovingScene:
        """Take a CT apart.

        Parameters
        ----------
        ct : Volume
            Hounsfield units.
        structures : Structures
            On its grid.
        reference : str
            One of them.
        poses : (F, K, 4, 4) array
            Postures that there must be room for, rig to CT, LPS mm.
        soft_mm : float
            Size of the voxels of soft tissue, at least the CT's own.
        node_mm : float
            Distance of the nodes on which its field is solved.
        projector : str
            "auto", "rtk" or "sum".

        """
        number = structures.index(reference)
        bones, filled = bones_apart(ct, structures)
        soft = coarser(filled, soft_mm)
        points = structure_points(structures, ct.affine)
        trees = [KDTree(_few(points[name])) for name in structures.names]
        room = _room(soft, trees, relative_to(poses, number))
        grid = FixedGrid.around(soft, 0.0, node_mm, room)
        near = FixedGrid.around(soft, _FAR_MM, node_mm)
        nodes = _node_points(near)
        distances = np.stack([tree.query(nodes, eps=_ROUGHLY)[0].reshape(near.node_shape) for tree in trees])
        return cls(structures.names, number, bones, soft, grid, distances.astype(np.float32), near, projector)

    def soft_tissue(self, poses: np.ndarray, moved: SoftMotion | None = None) -> Volume:
        """Attenuation of soft tissue in 1/mm in a posture, where the reference lies as in the CT.

        Parameters
        ----------
        poses : (K, 4, 4) array
            Rig to CT, LPS mm.
        moved : SoftMotion, optional
            What soft organs do by themselves; its lungs are those of `soft`'s grid.

        """
        nodes = self._field(relative_to(poses, self.reference), moved)
        to_index = np.linalg.inv(self.soft.affine)
        # The grid is the soft tissue's own, widened: a shift of whole voxels.
        k, j, i = (np.arange(n) - p for n, p in zip(self.grid.shape, self.grid.pad, strict=True))
        hu = np.empty(self.grid.shape, np.float32)
        lungs = None if moved is None or moved.lungs is None else moved.lungs.astype(np.uint8)
        breathing = np.zeros(self.grid.shape, dtype=bool)
        for slab in range(self.grid.shape[0]):
            index = np.tensordot(
                to_index[:3, :3].astype(np.float32), node_slice(nodes, slab, self.grid), axes=1
            )[::-1]
            index[0] += k[slab]
            index[1] += j[:, None]
            index[2] += i[None, :]
            # Beyond the last voxel the values fall to air's within one voxel: rounding must not lose a slice.
            hu[slab] = map_coordinates(
                self.soft.voxels, index, order=1, mode="grid-constant", cval=AIR_HU, output=np.float32
            )
            if lungs is not None:
                breathing[slab] = map_coordinates(lungs, index, order=0, cval=0) > 0
        if lungs is not None:
            determinants = jacobian_determinants(np.moveaxis(nodes, 0, -1), self.grid.node_affine)
            keep_mass(hu, breathing, determinants, self.grid)
        return Volume(hounsfield_to_attenuation(hu), self.grid.affine)

    def project_bones(self, poses: np.ndarray, camera: Camera) -> np.ndarray:
        """Line integrals (H, W) of what bones have beyond soft tissue; poses (K, 4, 4) rig to CT, LPS mm."""
        line = np.zeros((camera.height, camera.width), np.float32)
        for bone, pose in zip(self.bones, poses, strict=True):
            line += independent_projector.project(bone, seen_from_ct(camera, pose), self.projector)
        return line

    def project_soft(self, soft: Volume, poses: np.ndarray, camera: Camera) -> np.ndarray:
        """Line integrals (H, W) of posed soft tissue; poses (K, 4, 4) rig to CT, LPS mm, of the same posture."""
        seen = seen_from_ct(camera, poses[self.reference])
        return independent_projector.project(soft, seen, self.projector)

    def _field(self, relative: np.ndarray, moved: SoftMotion | None) -> np.ndarray:
        """Displacement (3, k, j, i) in mm on the grid's nodes, fixed to moving, for poses (K, 4, 4) fixed to moving."""
        points = _node_points(self.grid)
        to_near = np.linalg.inv(self.near.node_affine)
        distance = np.stack(
            [
                map_coordinates(each, apply(to_near @ pose, points)[:, ::-1].T, order=1, mode="nearest")
                for each, pose in zip(self.distances, relative, strict=True)
            ]
        )
        owner = distance.argmin(0)
        nearest = distance.min(0)
        others = np.where(np.arange(len(relative))[:, None] == owner, np.inf, distance).min(0)
        reach = 0.75 * np.linalg.norm(self.grid.node_affine[:3, :3], axis=0).max()
        known = (nearest <= reach) | (nearest <= _ALONE * others)
        values = np.zeros((len(points), 3), np.float32)
        for number, pose in enumerate(relative):
            mine = known & (owner == number)
            values[mine] = apply(pose, points[mine]) - points[mine]
        shape = self.grid.node_shape
        given, held = values.T.reshape(3, *shape), known.reshape(shape)
        if moved is not None:
            given, held = moved.add_to(given, held, self.grid)
        spacing = np.linalg.norm(self.grid.node_affine[:3, :3], axis=0)[::-1]
        return solve_laplace(given, held, spacing)


def seen_from_ct(camera: Camera, pose: np.ndarray) -> Camera:
    """A camera of the rig in the CT's world of a bone; pose (4, 4) rig to CT."""
    return camera.with_extrinsic(camera.extrinsic @ np.linalg.inv(pose))


def relative_to(poses: np.ndarray, reference: int) -> np.ndarray:
    """Poses (..., K, 4, 4) as if the reference lay where the CT has it."""
    return poses @ np.linalg.inv(poses[..., reference : reference + 1, :, :])


def bones_apart(ct: Volume, structures: Structures) -> tuple[tuple[Volume, ...], Volume]:
    """Attenuation in 1/mm that every bone has beyond soft tissue, and the CT in HU with soft tissue in their place.

    Added up they are the CT's attenuation, exactly.
    """
    spacing = ct.spacing[::-1]
    filled = np.asarray(ct.voxels, dtype=np.float32).copy()
    margin = np.ceil(_MARGIN_MM / spacing).astype(int) + 1
    bones = []
    for number, box in enumerate(find_objects(structures.labels, max_label=len(structures)), start=1):
        crop = grown_box(box, margin, ct.shape)
        labels = structures.labels[crop]
        mine = np.asarray(distance_transform_edt(labels != number, sampling=spacing))
        foreign = (labels > 0) & (labels != number)
        away = (
            np.asarray(distance_transform_edt(~foreign, sampling=spacing))
            if foreign.any()
            else np.full(labels.shape, np.inf)
        )
        shell = (np.minimum(mine, away) < _SHELL_MM) | (labels > 0)
        own = (mine < _SHELL_MM) & (mine < away)
        hu = np.asarray(ct.voxels[crop], dtype=np.float32)
        fill = np.full_like(hu, SOFT_HU)
        if not shell.all():
            fill = np.minimum(hu, 3 * SOFT_HU)[nearest_known(shell, spacing)]
        excess = hounsfield_to_attenuation(hu) - hounsfield_to_attenuation(fill)
        filled[crop][own] = fill[own]
        affine = ct.affine.copy()
        affine[:3, 3] = ct.to_world(np.array([side.start for side in crop][::-1], dtype=np.float64))
        bones.append(Volume(np.where(own, excess, 0).astype(np.float32), affine))
    return tuple(bones), Volume(filled, ct.affine)


def coarser(volume: Volume, size_mm: float) -> Volume:
    """Means over blocks of whole voxels that are about so large; edges are repeated to fill the last blocks."""
    factor = [max(1, round(size_mm / side)) for side in volume.spacing[::-1]]
    pad = [(0, -n % f) for n, f in zip(volume.shape, factor, strict=True)]
    padded = np.pad(np.asarray(volume.voxels, dtype=np.float32), pad, mode="edge")
    k, j, i = (n // f for n, f in zip(padded.shape, factor, strict=True))
    blocks = padded.reshape(k, factor[0], j, factor[1], i, factor[2])
    affine = volume.affine.copy()
    affine[:3, 3] = volume.to_world((np.array(factor[::-1]) - 1) / 2)
    affine[:3, :3] = affine[:3, :3] * np.array(factor[::-1])
    return Volume(blocks.mean(axis=(1, 3, 5)), affine)


def _room(soft: Volume, trees: list[KDTree], relative: np.ndarray) -> np.ndarray:
    """Voxels (2, 3) before and after the soft tissue's grid along (k, j, i) that the body needs in all postures.

    Flesh is taken to move with the bone that is nearest to it.
    """
    body = _few(np.argwhere(soft.voxels > BODY_HU))
    spare = np.ceil(_SPARE_MM / soft.spacing[::-1])
    points = soft.to_world(body[:, ::-1])
    owner = np.argmin([tree.query(points)[0] for tree in trees], axis=0)
    room = np.zeros((2, 3), int)
    last = np.array(soft.shape) - 1
    for poses in relative:
        if np.allclose(poses, np.eye(4)):
            continue
        for number, pose in enumerate(poses):
            mine = points[owner == number]
            if len(mine):
                index = soft.to_index(apply(np.linalg.inv(pose), mine)).round(6)[:, ::-1]
                low, high = np.floor(index.min(0)) - spare, np.ceil(index.max(0)) + spare - last
                room = np.maximum(room, np.stack([-low, high]).astype(int))
    return room


def _node_points(grid: FixedGrid) -> np.ndarray:
    """LPS mm (N, 3) of a grid's nodes."""
    kji = np.stack(np.meshgrid(*map(np.arange, grid.node_shape), indexing="ij"), -1).reshape(-1, 3)
    return apply(grid.node_affine, kji[:, ::-1].astype(np.float64))


def _few(points: np.ndarray) -> np.ndarray:
    """At most about _POINTS of the points, evenly spread over the list."""
    return points[:: max(1, len(points) // _POINTS)]
