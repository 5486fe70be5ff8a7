"""Grids, motions and three bones that the tests of warps and fields share."""

import numpy as np
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.warp.polyrigid import PolyrigidWarp, RotationFalloff
from PolyPoseLib.warp.weights import distance_maps


def grid_affine(seed: int, spacing=(2.0, 1.5, 2.5)) -> np.ndarray:
    """An affine with oblique axes (seed > 0) that is left-handed for odd seeds; seed 0 is straight."""
    rng = np.random.default_rng(seed)
    axes = Rotation.from_rotvec(rng.normal(0, 0.4, 3)).as_matrix() if seed else np.eye(3)
    if seed % 2:
        axes[:, 1] *= -1
    affine = np.eye(4)
    affine[:3, :3] = axes * spacing
    affine[:3, 3] = rng.uniform(-200, 200, 3)
    return affine


def motion(rotation_deg, translation_mm, center) -> np.ndarray:
    """A rotation about center, then a translation."""
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_rotvec(np.radians(rotation_deg)).as_matrix()
    matrix[:3, 3] = np.asarray(center) - matrix[:3, :3] @ center + translation_mm
    return matrix


class Bones:
    """A spine, a long bone beside it that swings, and a thin rib: volumes from large to small."""

    def __init__(self, seed: int) -> None:
        labels = np.zeros((30, 36, 40), dtype=np.int16)
        labels[4:26, 14:22, 5:13] = 1
        labels[5:24, 14:21, 26:31] = 2
        labels[13:16, 25:29, 8:24] = 3
        self.affine = grid_affine(seed)
        self.structures = Structures(("spine", "limb", "rib"), labels)
        self.ct = Volume(np.full(labels.shape, -1000, dtype=np.float32), self.affine)
        self.ct.voxels[2:-2, 3:-3, 2:-2] = 40
        self.ct.voxels[labels > 0] = 700
        counts = np.bincount(labels.ravel())[1:]
        self.share = counts / counts.sum()
        limb, rib = self.points(2).mean(axis=0), self.points(3).mean(axis=0)
        self.poses = np.stack(
            [np.eye(4), motion((9, 4, -6), (3, -2, 1), limb), motion((-2, 3, 2), (0, 1, 2), rib)]
        )
        self.distances = distance_maps(self.structures, self.affine)

    def points(self, label: int) -> np.ndarray:
        """Moving voxel centres of one structure."""
        index = np.argwhere(self.structures.labels == label)[:, ::-1]
        return index @ self.affine[:3, :3].T + self.affine[:3, 3]

    def somewhere(self, count: int, seed: int = 0) -> np.ndarray:
        """Points anywhere in the volume."""
        rng = np.random.default_rng(seed)
        index = rng.uniform(0, np.array(self.ct.shape[::-1]) - 1, (count, 3))
        return self.ct.to_world(index)

    @property
    def centroids(self) -> np.ndarray:
        """Moving centroids (3, 3) of the structures."""
        return np.stack([self.points(n + 1).mean(axis=0) for n in range(3)])

    def warp(self, frame="moving", form="rigid", poses=None, reach_mm=None) -> PolyrigidWarp:
        """The warp of these bones; reach_mm: within which they turn tissue."""
        poses = self.poses if poses is None else poses
        rotation_falloff = None if reach_mm is None else RotationFalloff(reach_mm, self.centroids)
        return PolyrigidWarp(
            self.distances, self.share, poses, frame, form, rotation_falloff=rotation_falloff
        )
