"""Stage A from a guess: several starts about it, a search around it when they disagree, and how sure the outcome is."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from PolyPoseLib.data.progress import Monitor
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.rigid import about, perturbation
from PolyPoseLib.registration.cameras.hypotheses import Hypothesis, has_too_few_votes, is_plausible
from PolyPoseLib.registration.cameras.refine import find_camera
from PolyPoseLib.registration.cameras.search import SearchRange, Stage, find_cameras, refine_cameras
from PolyPoseLib.registration.fit.levels import Level, Observation
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.backend import Backend

TURN_DEG = 6.0
"""Rotation of the starts about the anchor."""

SEARCH_RADIUS = (5.0, 20.0)
"""Degrees and mm around the guess within which a camera is searched when the starts found none that convinces."""

_STARTS_KEPT, _STARTS_APART_MM = 3, 4.0
_BEST_KEPT, _BEST_APART_MM = 2, 2.0


@dataclass(frozen=True)
class RefinedCamera:
    """camera: refined through all levels; similarity: local correlation around the anchor; sure: whether it may be
    believed.
    """

    camera: Camera
    similarity: float
    sure: bool


def find_camera_near(
    scene: Scene,
    measured: Observation,
    levels: Sequence[Level],
    source_to_detector_mm: float,
    backend: Backend,
    monitor: Monitor,
    stage: str,
) -> RefinedCamera:
    """The camera near the guess ``measured.camera``.

    A least-squares fit ends in the nearest valley, which a few degrees of error may make the wrong one: the guess and
    turns of it are followed through the first two levels (or the only one), and the best goes on.
    """
    stages = [Stage(levels[0], _STARTS_KEPT, _STARTS_APART_MM)]
    stages += [Stage(level, _BEST_KEPT, _BEST_APART_MM) for level in levels[1:2]]
    starts = list(turned_about(measured.camera, scene.anchor_centre, TURN_DEG))
    best = refine_cameras(scene, measured, starts, backend, monitor, stage, stages)[0]
    if not convincing(best):
        searched = SearchRange.around_camera(
            measured.camera, scene.anchor_centre, SEARCH_RADIUS, source_to_detector_mm
        )
        found = find_cameras(scene, measured, searched, backend, monitor, stage)
        best = max([best, *found[:1]], key=lambda hypothesis: hypothesis.worth)
    placed = measured.with_camera(best.camera)
    camera = find_camera(scene, placed, levels[len(stages) :], backend, monitor, stage)
    return RefinedCamera(camera, best.similarity, convincing(best))


def convincing(best: Hypothesis) -> bool:
    """Whether a camera near a guess may be believed: plainly similar, or similar and reached from several starts."""
    return is_plausible(best) and not has_too_few_votes(best)


def turned_about(camera: Camera, centre: np.ndarray, degrees: float) -> Iterator[Camera]:
    """The camera, and the camera turned to either side about its three axes through ``centre`` (3,) LPS mm."""
    yield camera
    for axis in camera.extrinsic[:3, :3]:
        for sign in (-1.0, 1.0):
            turn = perturbation(np.r_[sign * np.radians(degrees) * axis, np.zeros(3)])
            yield camera.with_extrinsic(camera.extrinsic @ about(turn, centre))
