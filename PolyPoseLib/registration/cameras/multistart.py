"""Stage A from an initial camera: several starts about it, and a search around it when they do not agree."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.rigid import about, perturbation
from PolyPoseLib.registration.cameras.hypotheses import Hypothesis, has_too_few_votes, is_plausible
from PolyPoseLib.registration.cameras.refine import find_camera
from PolyPoseLib.registration.cameras.search import SearchRange, Stage, find_cameras, refine_cameras
from PolyPoseLib.registration.fit.levels import Level, Observation
from PolyPoseLib.registration.run import Run

TURN_DEG = 6.0
"""Rotation of the starts about the anchor."""

SEARCH_RADIUS = (5.0, 20.0)
"""Degrees and mm around the initial camera within which one is searched when no start led to a reliable one."""

_STARTS_KEPT, _STARTS_APART_MM = 3, 4.0
_BEST_KEPT, _BEST_APART_MM = 2, 2.0


@dataclass(frozen=True)
class RefinedCamera:
    """A camera after stage A.

    Parameters
    ----------
    camera : Camera
        Refined through all levels.
    similarity : float
        Local correlation around the anchor, in [-1, 1]; NaN where the method does not compute it.
    reliable : bool
        Whether the rendering matches the X-ray, and enough starts agree.

    """

    camera: Camera
    similarity: float
    reliable: bool


def find_camera_near(
    run: Run,
    observation: Observation,
    levels: Sequence[Level],
    source_to_detector_mm: float,
    search: bool = True,
) -> RefinedCamera:
    """Refine one X-ray's camera from several starts around it.

    A least-squares fit ends in the nearest local minimum, which is the wrong one after an error of a few degrees: the
    initial camera and rotations of it are followed through the first two levels (or the only one), and the best one
    through the rest.

    Parameters
    ----------
    run : Run
        The patient, the renderer and the monitor.
    observation : Observation
        The X-ray with its initial camera.
    levels : sequence of Level
        Coarse to fine, at least one.
    source_to_detector_mm : float
        Bounds the distances of a search.
    search : bool
        Whether to search around the initial camera where no start led to a reliable one.

    Returns
    -------
    RefinedCamera
        The best one.

    """
    stages = [Stage(levels[0], _STARTS_KEPT, _STARTS_APART_MM)]
    stages += [Stage(level, _BEST_KEPT, _BEST_APART_MM) for level in levels[1:2]]
    centre = run.scene.anchor_centre
    starts = list(turned_about(observation.camera, centre, TURN_DEG))
    best = refine_cameras(run, observation, starts, stages)[0]
    if search and not is_reliable(best):
        searched = SearchRange.around_camera(observation.camera, centre, SEARCH_RADIUS, source_to_detector_mm)
        found = find_cameras(run, observation, searched)
        best = max([best, *found[:1]], key=lambda hypothesis: hypothesis.score)
    camera = find_camera(run, observation.with_camera(best.camera), levels[len(stages) :])
    return RefinedCamera(camera, best.similarity, is_reliable(best))


def is_reliable(best: Hypothesis) -> bool:
    """Whether a camera is similar enough by itself, or similar and reached from several starts."""
    return is_plausible(best) and not has_too_few_votes(best)


def turned_about(camera: Camera, centre: np.ndarray, degrees: float) -> Iterator[Camera]:
    """The camera, and the camera turned to either side about its three axes through ``centre`` (3,) LPS mm."""
    yield camera
    for axis in camera.extrinsic[:3, :3]:
        for sign in (-1.0, 1.0):
            turn = perturbation(np.r_[sign * np.radians(degrees) * axis, np.zeros(3)])
            yield camera.with_extrinsic(camera.extrinsic @ about(turn, centre))
