"""Where bones, skin and soft tissue lie in the posture of the X-rays: the places for wires, implants and cables."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import binary_erosion, label
from scipy.spatial import KDTree

from PolyPoseLib.data.volume import Volume, hounsfield_to_attenuation
from PolyPoseLib.simulation import independent_projector
from PolyPoseLib.simulation.motion import bone_kind
from PolyPoseLib.simulation.posed_ct import BODY_HU, pose_ct

if TYPE_CHECKING:
    from PolyPoseLib.geometry.camera import Camera
    from PolyPoseLib.simulation.simulate import SimulatedCase

_SKIN_CELL_MM = 8.0


def bone_points(case: SimulatedCase, name: str) -> np.ndarray:
    """Voxel centres (N, 3) of a structure in LPS mm, in the posture of the X-rays; of the CT where it left the grid."""
    number = case.structures.names.index(name) + 1
    kji = np.argwhere(case.fixed_labels.voxels == number)
    if len(kji):
        return case.fixed_labels.to_world(kji[:, ::-1])
    return case.ct.to_world(np.argwhere(case.structures.labels == number)[:, ::-1])


def bones_of_kind(case: SimulatedCase, *kinds: str) -> list[str]:
    """Names of the structures of some kinds (`motion.bone_kind`), in the study's order; all when there are none."""
    names = [name for name in case.structures.names if bone_kind(name) in kinds]
    return names or list(case.structures.names)


def parent_of(case: SimulatedCase, name: str) -> str:
    """The structure with which a bone has its joint; the anchor when nobody knows."""
    return case.joints[name].parent if name in case.joints else case.anchor


def long_axis(points: np.ndarray) -> np.ndarray:
    """Unit vector (3,) of the largest extent of points (N, 3), pointing to the feet (-z) or, if level, to the left."""
    centred = points - points.mean(0)
    axis = np.linalg.svd(centred[:: max(1, len(centred) // 5000)], full_matrices=False)[2][0]
    return axis if (axis[2], -axis[0]) < (0, 0) else -axis


def body_mask(case: SimulatedCase) -> np.ndarray:
    """(k, j, i) bool: the patient in the posture of the X-rays, the largest piece that is not air."""
    pieces = np.asarray(label(case.fixed_ct.voxels > BODY_HU)[0])  # type: ignore[index]
    sizes = np.bincount(pieces.ravel())
    sizes[0] = 0
    return pieces == sizes.argmax()


def soft_tissue(case: SimulatedCase) -> np.ndarray:
    """(k, j, i) bool: voxels like muscle, fluid or fat, away from bones and skin."""
    hu = case.fixed_ct.voxels
    soft = (hu > -200) & (hu < 200) & (case.fixed_labels.voxels == 0)
    return binary_erosion(soft & body_mask(case), iterations=2)


def skin_surface(case: SimulatedCase, x: np.ndarray, z: np.ndarray, back: bool = False) -> np.ndarray:
    """Height y in LPS mm of the skin in front of (or behind) each (x, z), (N,)."""
    surface = body_mask(case)
    surface &= ~np.asarray(binary_erosion(surface), dtype=bool)
    points = case.fixed_ct.to_world(np.argwhere(surface)[:, ::-1])
    cells = np.round(points[:, [0, 2]] / _SKIN_CELL_MM).astype(int)
    unique, owner = np.unique(cells, axis=0, return_inverse=True)
    sign = -1.0 if back else 1.0
    height = np.full(len(unique), np.inf)
    np.minimum.at(height, owner.ravel(), sign * points[:, 1])
    wanted = np.stack([np.atleast_1d(x), np.atleast_1d(z)], axis=-1)
    near = KDTree(unique * _SKIN_CELL_MM).query(wanted, k=min(5, len(unique)))[1]
    return sign * height[near].reshape(len(wanted), -1).mean(axis=1)


def body_lines(
    case: SimulatedCase, cameras: list[Camera], poses: dict[str, np.ndarray] | None = None
) -> list[np.ndarray]:
    """Noise-free line integrals (H, W) of the posed patient for other cameras or other poses {name: (4, 4)}."""
    options = case.options
    posed = pose_ct(
        case.ct,
        case.structures,
        case.fixed_to_moving if poses is None else poses,
        None,
        options.node_mm,
        options.pad_mm,
        options.ends,
        options.tissue,
        case.soft,
    )
    attenuation = Volume(hounsfield_to_attenuation(posed.hu), posed.grid.affine)
    return [independent_projector.project(attenuation, camera, options.projector) for camera in cameras]


def excess_lines(case: SimulatedCase, excess: np.ndarray, cameras: list[Camera]) -> list[np.ndarray]:
    """Line integrals (H, W) of additional attenuation (k, j, i) in 1/mm on the grid of the case's fixed_ct."""
    volume = Volume(np.ascontiguousarray(excess, dtype=np.float32), case.fixed_ct.affine)
    return [independent_projector.project(volume, camera, case.options.projector) for camera in cameras]
