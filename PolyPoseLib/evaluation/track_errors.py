"""Errors of one structure's poses over the frames of a track."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.rigid import rigid_inverse


@dataclass(frozen=True, eq=False)
class PoseErrors:
    """How far F poses are off; frames without a pose are left out by whoever makes it.

    Attributes
    ----------
    perturbations : (F, 6) ndarray
        [rotation (rad), displacement of the centroid (mm)] on the left of the true pose, about the centroid in the CT:
        what the track's covariances are of.
    places : (F, 3) ndarray
        Displacement of the centroid in the rig's world, mm.
    target : (F,) ndarray
        Root mean square over the structure's points of how far they are off, mm.
    target_worst : (F,) ndarray
        The largest of them.
    beams : (V, F, 3) ndarray
        Unit directions, in the rig's world, of each camera's ray through the true centroid.
    found : (F, 3, 3) ndarray
        Rotations of the found poses.

    """

    perturbations: np.ndarray
    places: np.ndarray
    target: np.ndarray
    target_worst: np.ndarray
    beams: np.ndarray
    found: np.ndarray

    @classmethod
    def of(
        cls,
        true: np.ndarray,
        found: np.ndarray,
        centroid: np.ndarray,
        points: np.ndarray,
        cameras: Mapping[str, Camera],
    ) -> PoseErrors:
        """Compare poses (F, 4, 4), the rig's world to the CT's; centroid (3,) and points (N, 3) in the CT, mm."""
        error = found @ rigid_inverse(true)
        turn = Rotation.from_matrix(error[:, :3, :3]).as_rotvec() if len(error) else np.zeros((0, 3))
        shift = _moved(error, centroid[None])[:, 0] - centroid
        back, forth = rigid_inverse(true), rigid_inverse(found)
        at = _moved(back, centroid[None])[:, 0]
        away = np.linalg.norm(_moved(forth, points) - _moved(back, points), axis=-1)
        rays = np.array([at - camera.source for camera in cameras.values()]).reshape(len(cameras), len(at), 3)
        return cls(
            np.concatenate([turn, shift], axis=1),
            _moved(forth, centroid[None])[:, 0] - at,
            np.sqrt((away**2).mean(axis=1)),
            away.max(axis=1),
            rays / np.linalg.norm(rays, axis=-1, keepdims=True),
            found[:, :3, :3],
        )

    @property
    def centroid_mm(self) -> np.ndarray:
        """(F,) how far the centroid is off."""
        return np.linalg.norm(self.places, axis=1)

    @property
    def rotation_deg(self) -> np.ndarray:
        """(F,) angle between the true and the found orientation."""
        return np.degrees(np.linalg.norm(self.perturbations[:, :3], axis=1))

    @property
    def along_beams(self) -> np.ndarray:
        """(V, F) displacement of the centroid along each camera's ray, mm, away from the source above 0."""
        return np.einsum("vfi,fi->vf", self.beams, self.places)

    @property
    def across_beams(self) -> np.ndarray:
        """(V, F) displacement of the centroid across each camera's ray, mm."""
        return np.linalg.norm(self.places - self.along_beams[..., None] * self.beams, axis=-1)


def _moved(motions: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Points (F, N, 3) that motions (F, 4, 4) make of points (N, 3)."""
    return np.einsum("fij,nj->fni", motions[:, :3, :3], points) + motions[:, None, :3, 3]
