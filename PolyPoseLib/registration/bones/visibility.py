"""How much of each structure each X-ray shows: what lies beside its picture, what metal hides, what is clipped."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from PolyPoseLib.geometry.rigid import rigid_inverse
from PolyPoseLib.registration.fit.levels import Observation
from PolyPoseLib.registration.scene import Scene, body_points

VOXEL_MM = 3.0
POINTS = 500
"""Of a structure, by which shares are counted."""


@dataclass(frozen=True)
class Visibility:
    """Shares, 0 to 1, of K structures in N X-rays.

    Attributes
    ----------
    outside : (K, N) ndarray
        Beside the picture, or behind its shutter.
    hidden : (K, N) ndarray
        Behind metal or instruments that were left out.
    clipped : (K, N) ndarray
        Where the X-ray is all black or all white.

    """

    outside: np.ndarray
    hidden: np.ndarray
    clipped: np.ndarray

    @property
    def hidden_share(self) -> np.ndarray:
        """(K,) share, 0 to 1, of what the X-rays could show of a structure that metal hides; 0 where they could not."""
        shown = (1 - self.outside).sum(axis=1)
        return self.hidden.sum(axis=1) / np.maximum(shown, 1e-9)


def structure_visibility(scene: Scene, observations: Sequence[Observation], poses: np.ndarray) -> Visibility:
    """Count the points of every structure by where they project.

    Parameters
    ----------
    scene : Scene
        The structures.
    observations : sequence of Observation
        The N X-rays with their cameras, and with what was left out of them.
    poses : (K, 4, 4) ndarray
        Fixed to moving.

    Returns
    -------
    Visibility
        Of the K structures in the N X-rays.

    """
    outside, hidden, clipped = np.zeros((3, len(poses), len(observations)))
    for k, body in enumerate(scene.bodies(VOXEL_MM)):
        to_fixed = rigid_inverse(poses[k])
        points = body_points(body, POINTS) @ to_fixed[:3, :3].T + to_fixed[:3, 3]
        for n, observation in enumerate(observations):
            outside[k, n] = 1 - _at(points, observation, observation.given).mean()
            if observation.clipped is not None:
                clipped[k, n] = _at(points, observation, observation.clipped).mean()
            if observation.foreign is not None:
                hidden[k, n] = _at(points, observation, observation.foreign).mean()
    return Visibility(outside, hidden, clipped)


def _at(points: np.ndarray, observation: Observation, mask: np.ndarray) -> np.ndarray:
    """(P,) bool: which points (P, 3) LPS mm project into a mask."""
    camera = observation.camera
    column, row = np.rint(camera.project(points)).T  # not a number behind the source
    shows = (row >= 0) & (row < camera.height) & (column >= 0) & (column < camera.width)
    shows[shows] = mask[row[shows].astype(int), column[shows].astype(int)]
    return shows
