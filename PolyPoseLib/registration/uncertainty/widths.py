"""How wide the intervals of a pose are where its turns count, and where the images alone do."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from PolyPoseLib.registration.bones.agreement import Agreement
from PolyPoseLib.registration.bones.visibility import POINTS, VOXEL_MM
from PolyPoseLib.registration.fit.problem import JointResult
from PolyPoseLib.registration.scene import Scene, body_points
from PolyPoseLib.registration.uncertainty.covariance import PoseUncertainty


@dataclass(frozen=True)
class Widths:
    """Half widths of 95 % intervals, mm of the scene.

    Attributes
    ----------
    points_mm : float
        Of the structure's points, turns included, along their least certain direction, as it is stated.
    across_mm : float
        Of its centroid across the beams of the X-rays that show it, by the images alone.

    """

    points_mm: float
    across_mm: float


def widths_of(
    scene: Scene,
    joint: JointResult,
    agreement: Agreement,
    stated: Mapping[int, PoseUncertainty],
    by_images: Mapping[int, PoseUncertainty],
) -> dict[int, Widths]:
    """Of every structure whose uncertainty is stated.

    Parameters
    ----------
    scene : Scene
        The K structures.
    joint : JointResult
        Their poses and the cameras of the N views.
    agreement : Agreement
        Which views show them.
    stated, by_images : mapping of int to PoseUncertainty
        Of the same structures: all that is known, and what the images tell.

    Returns
    -------
    dict of int to Widths
        By index of the structure.

    """
    bodies = scene.bodies(VOXEL_MM)
    widths = {}
    for k, uncertainty in stated.items():
        shows = ~np.isnan(agreement.contrast[k])
        cameras = [camera for n, camera in enumerate(joint.cameras) if shows[n] or not shows.any()]
        across = by_images[k].across_mm(cameras, joint.poses[k], scene.centres[k])
        offsets = body_points(bodies[k], POINTS) - scene.centres[k]
        widths[k] = Widths(uncertainty.of_points_mm(offsets), across)
    return widths
