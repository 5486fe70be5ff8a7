"""What is expected of a camera before its X-ray is looked at: near its initial place.

The prior is weak. It decides only along directions in which the X-ray says nothing, as when the anchor is a thin rod
that may slide along the beam or turn about itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.rigid import perturbation_between

WEIGHT = 3e-5
"""Cost of a camera at its radius, in units of the images' cost (0 = identical, 2 = unrelated). A hundred times as much
pulled the cameras of a pelvis back towards their initial place by half a degree."""


@dataclass(frozen=True)
class CameraPrior:
    """A camera near which the true one is expected.

    Parameters
    ----------
    camera : Camera
        The initial one.
    rotation_deg, translation_mm : float
        Radius within which the true camera is expected, both > 0.

    """

    camera: Camera
    rotation_deg: float
    translation_mm: float

    def deviation(self, camera: Camera, correction: np.ndarray, centre: np.ndarray) -> np.ndarray:
        """How far a corrected camera is from the expected one, in radii.

        Parameters
        ----------
        camera : Camera
            Before its correction.
        correction : (4, 4) ndarray
            Fixed to fixed.
        centre : (3,) ndarray
            LPS mm, about which cameras move.

        Returns
        -------
        (6,) ndarray
            Rotation about ``centre`` and translation of it, over the radius.

        """
        total = correction @ np.linalg.inv(camera.extrinsic) @ self.camera.extrinsic
        return perturbation_between(np.eye(4), total, centre) / self.radii

    @property
    def radii(self) -> np.ndarray:
        """(6,) rad and mm."""
        return np.r_[np.full(3, np.radians(self.rotation_deg)), np.full(3, self.translation_mm)]
