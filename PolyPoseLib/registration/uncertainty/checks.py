"""Reasons not to trust a result, each one sentence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from PolyPoseLib.geometry.rigid import rotation_angle_deg
from PolyPoseLib.registration.fit.levels import Level, Observation, pixel_size_mm, view_at
from PolyPoseLib.registration.fit.problem import RigidProblem, State
from PolyPoseLib.registration.fit.soft_tissue import SoftTissue
from PolyPoseLib.registration.fit.weighting import dilated, projection_mask
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.backend import Backend

SCORING_LEVEL = Level(3.0, 20.0, 0)
"""Resolution at which renderings are judged: coarse enough that noise does not decide."""

MARGIN = 0.01
"""Fall of the mean similarity that speaks against a result: noise alone lets a patient at rest lose less."""

LEAST_SIMILARITY = 0.5
"""Local correlation around the bones below which a view is not explained."""

LARGEST_ROTATION_DEG = 60.0
REACH_MM = 10.0


@dataclass(frozen=True)
class ViewScores:
    """similarities: one per view in [-1, 1]; visible: (K, N) whether a structure shows in a view."""

    similarities: list[float]
    visible: np.ndarray


def judge(
    scene: Scene, soft: SoftTissue, measured: Sequence[Observation], poses: np.ndarray, backend: Backend
) -> ViewScores:
    """Local correlation of every X-ray with its rendering around all bones, for poses (K, 4, 4)."""
    views = [view_at(SCORING_LEVEL, m, scene.anchor_centre, expect_noise=False) for m in measured]
    bodies = scene.bodies(SCORING_LEVEL.size_mm)
    problem = RigidProblem(bodies, views, [], [], scene.anchor_centre, SCORING_LEVEL.size_mm, backend)
    state = State(poses, np.stack([np.eye(4)] * len(views)))
    field = soft.coarse_field(poses)
    similarities = []
    visible = np.zeros((len(bodies), len(views)), bool)
    for n, view in enumerate(views):
        view.static = soft.render(field, view.camera, np.eye(4), SCORING_LEVEL.size_mm, backend)
        region = np.zeros(view.static.shape, bool)
        for k in range(len(bodies)):
            shows = projection_mask(problem, state, n, [k]) & (view.contrast.support > 0)
            visible[k, n] = shows.any()
            region |= shows
        region = dilated(region, REACH_MM / pixel_size_mm(view.camera, scene.anchor_centre))
        region &= view.contrast.support > 0
        residual = problem.residual(state, n)[region]
        similarities.append(float(1 - np.mean(residual**2) / 2) if residual.size else -1.0)
    return ViewScores(similarities, visible)


def reasons_for_distrust(
    scene: Scene, names: Sequence[str], before: ViewScores, after: ViewScores, poses: np.ndarray
) -> tuple[str, ...]:
    """What speaks against a result; names are those of the X-rays."""
    reasons = []
    for n, name in enumerate(names):
        if not after.visible[scene.anchor, n]:
            reasons.append(
                f'The anchor "{scene.names[scene.anchor]}" does not project into X-ray "{name}": give it a better '
                "initial camera."
            )
        elif after.similarities[n] < LEAST_SIMILARITY:
            reasons.append(
                f'The rendering explains X-ray "{name}" badly (local correlation {after.similarities[n]:.2f}, at least '
                f"{LEAST_SIMILARITY:g} is expected): check its initial camera, distances and pixel spacing."
            )
    if np.mean(after.similarities) < np.mean(before.similarities) - MARGIN:
        reasons.append(
            f"The similarity did not rise ({np.mean(before.similarities):.3f} before, "
            f"{np.mean(after.similarities):.3f} after): check the initial cameras."
        )
    for k, name in enumerate(scene.names):
        if before.visible[k].any() and not after.visible[k].any():
            reasons.append(f'The structure "{name}" left every X-ray: its pose is meaningless.')
        angle = rotation_angle_deg(poses[k, :3, :3])
        if angle > LARGEST_ROTATION_DEG:
            reasons.append(
                f'The structure "{name}" turned by {angle:.0f} degrees against the anchor, more than '
                f"{LARGEST_ROTATION_DEG:g} is not credible."
            )
    return tuple(reasons)


def hidden_structures(scene: Scene, after: ViewScores) -> list[str]:
    """Warnings about structures that no X-ray shows."""
    return [
        f'The structure "{name}" shows in no X-ray: its pose is a guess with a wide uncertainty.'
        for k, name in enumerate(scene.names)
        if not after.visible[k].any()
    ]
