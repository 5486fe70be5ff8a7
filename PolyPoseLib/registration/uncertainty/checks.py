"""Reasons not to trust a result, each one sentence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from PolyPoseLib.data.view_names import label_of
from PolyPoseLib.geometry.rigid import rotation_angle_deg
from PolyPoseLib.registration.fit.levels import COMPARISON_LEVEL, Observation, pixel_size_mm
from PolyPoseLib.registration.fit.views import LevelViews
from PolyPoseLib.registration.fit.weighting import dilated, usable_projection_mask
from PolyPoseLib.registration.run import Run
from PolyPoseLib.registration.scene import Scene

MARGIN = 0.01
"""Fall of the mean similarity that speaks against a result: noise alone lets a patient at rest lose less."""

LEAST_SIMILARITY = 0.5
"""Local correlation around the bones below which a view is not trusted."""

LARGEST_ROTATION_DEG = 60.0
REACH_MM = 10.0


@dataclass(frozen=True)
class ViewScores:
    """How well a result matches its X-rays.

    Attributes
    ----------
    similarities : list[float]
        One per view in [-1, 1].
    visible : np.ndarray
        (K, N) bool, whether a structure shows in a view.

    """

    similarities: list[float]
    visible: np.ndarray


def score_views(run: Run, observations: Sequence[Observation], poses: np.ndarray) -> ViewScores:
    """Local correlation of every X-ray with its rendering around all bones.

    Parameters
    ----------
    run : Run
        The patient and the renderer.
    observations : sequence of Observation
        N X-rays with their cameras.
    poses : (K, 4, 4) ndarray
        Fixed to moving.

    Returns
    -------
    ViewScores
        Of the N views.

    """
    level = LevelViews(run, observations, COMPARISON_LEVEL, expect_noise=False)
    problem, state = level.posed_structures(poses)
    similarities = []
    visible = np.zeros((len(poses), len(level.views)), bool)
    for n, view in enumerate(level.views):
        region = np.zeros(view.static.shape, bool)
        for k in range(len(poses)):
            shows = usable_projection_mask(problem, state, n, [k])
            visible[k, n] = shows.any()
            region |= shows
        region = dilated(region, REACH_MM / pixel_size_mm(view.camera, problem.camera_centre))
        region &= view.contrast.support > 0
        residual = problem.residual(state, n)[region]
        similarities.append(float(1 - np.mean(residual**2) / 2) if residual.size else -1.0)
    return ViewScores(similarities, visible)


def reasons_for_distrust(
    scene: Scene, names: Sequence[str], before: ViewScores, after: ViewScores, poses: np.ndarray
) -> tuple[str, ...]:
    """What speaks against a result.

    Parameters
    ----------
    scene : Scene
        Names the structures.
    names : sequence of str
        Of the X-rays.
    before, after : ViewScores
        At rest with the initial cameras, and of the result.
    poses : (K, 4, 4) ndarray
        Fixed to moving, of the result.

    Returns
    -------
    tuple of str
        One sentence each.

    """
    reasons = []
    for n, name in enumerate(names):
        if not after.visible[scene.anchor, n]:
            reasons.append(
                f'The anchor "{scene.names[scene.anchor]}" does not project into {label_of(name)}: give it a better '
                "initial camera."
            )
        elif after.similarities[n] < LEAST_SIMILARITY:
            reasons.append(
                f"The rendering does not match {label_of(name)} well (local correlation "
                f"{after.similarities[n]:.2f}, at least {LEAST_SIMILARITY:g} is expected): "
                "check its initial camera, distances and pixel spacing."
            )
    if np.mean(after.similarities) < np.mean(before.similarities) - MARGIN:
        reasons.append(
            f"The similarity did not rise ({np.mean(before.similarities):.3f} before, "
            f"{np.mean(after.similarities):.3f} after): check the initial cameras."
        )
    left = [k for k in scene.moving if before.visible[k].any() and not after.visible[k].any()]
    if 2 * len(left) > len(scene.moving):  # fewer are warned of, as structures that no X-ray shows
        reasons.append(
            f"{len(left)} of {len(scene.moving)} structures left every X-ray: their poses are meaningless; check the "
            "initial cameras."
        )
    for k, name in enumerate(scene.names):
        angle = rotation_angle_deg(poses[k, :3, :3])
        if angle > LARGEST_ROTATION_DEG:
            reasons.append(
                f'The structure "{name}" rotated by {angle:.0f} degrees relative to the anchor; more than '
                f"{LARGEST_ROTATION_DEG:g} is not plausible."
            )
    return tuple(reasons)


def left_out_warnings(name: str, used: Observation) -> list[str]:
    """Warnings about the shares of an X-ray that are clipped and that foreign objects cover, where there are any."""
    given, clipped, foreign = used.given, used.clipped, used.foreign
    warnings = []
    if clipped is not None and clipped.any():
        warnings.append(
            f"{label_of(name)}: {clipped.sum() / given.sum():.0%} of it is all black or all white, clipped by its "
            "window or its detector; these pixels are left out. Export it with a wider window."
        )
    if foreign is not None and foreign.any():
        warnings.append(
            f"{label_of(name)}: metal, instruments or a collimator that the CT does not have cover "
            f"{max(100 * foreign.sum() / given.sum(), 0.1):.1f} % of it; these pixels are left out."
        )
    return warnings
