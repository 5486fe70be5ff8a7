"""How far each pose of a frame may be off.

Three errors add up. The residual's own spread moves the optimum (the cluster-robust covariance of
:mod:`PolyPoseLib.registration.uncertainty.covariance`). Edges that all lie a little outwards or inwards, of a CT's
partial volumes, an X-ray's blur or its exposure, move it without any spread: what a swollen bone would do to the pose
is computed, and is small but along the beam of a single view, where a larger bone looks like a nearer one. And there is
a floor, of labels and of soft tissue that moves otherwise than the model.
"""

from __future__ import annotations

import numpy as np

from PolyPoseLib.registration.fit.problem import Linearised, RigidProblem, State
from PolyPoseLib.registration.uncertainty.covariance import (
    LEAST_NOISE,
    UNSEEN_ROTATION_DEG,
    UNSEEN_TRANSLATION_MM,
    PoseUncertainty,
    score_statistics,
)
from PolyPoseLib.rendering.rigid import Body, project_body

INFLATION = 2.0
"""Factor on the standard deviations that follow from the residual's spread."""

ROTATION_INFLATION = 1.6
"""Further factor on those of rotations: soft tissue at one end of a bone turns it."""

EDGE_VOXELS = 0.08
"""Standard deviation of how far all edges of a bone may lie outwards, in voxels of the CT."""

FLOOR_ROTATION_DEG, FLOOR_TRANSLATION_MM = 0.1, 0.06
"""Least standard deviations, mm of the scene. These numbers are calibrated, see Testing/Benchmarks/tracking.py."""

SWELLING = 0.002
"""By which a bone is made larger to see what that does: by less than its texture is fine."""


def frame_covariances(problem: RigidProblem, state: State, voxel_mm: float) -> dict[int, np.ndarray]:
    """Covariance of every free pose of a frame's finest problem.

    Parameters
    ----------
    problem, state
        As the fit left them; the problem's depths are exact.
    voxel_mm : float
        Of the CT, in the scene.

    Returns
    -------
    dict of int to (6, 6) ndarray
        Of [rotation (rad), translation (mm)], as :class:`PoseUncertainty` has it, by index of the structure.

    """
    linear = [problem.linearise(state, n) for n in range(len(problem.views))]
    curvature, spread = score_statistics(problem, linear)
    unseen = np.tile([np.radians(UNSEEN_ROTATION_DEG)] * 3 + [UNSEEN_TRANSLATION_MM] * 3, problem.size // 6)
    noise = max(float(np.trace(spread) / max(np.trace(curvature), 1e-12)), LEAST_NOISE)
    prior = noise * (INFLATION / unseen) ** 2
    inverse = np.linalg.inv(curvature + np.diag(prior))
    covariance = INFLATION**2 * inverse @ (spread + np.diag(noise * prior)) @ inverse
    scale = np.tile([ROTATION_INFLATION] * 3 + [1.0] * 3, problem.size // 6)
    covariance *= np.outer(scale, scale)
    for k in range(len(problem.bodies)):
        shift = inverse @ _push_of_swelling(problem, state, linear, k)
        shift *= EDGE_VOXELS * voxel_mm / half_width(problem.bodies[k])
        covariance += np.outer(shift, shift)
    floor = PoseUncertainty.independent(FLOOR_ROTATION_DEG, FLOOR_TRANSLATION_MM).covariance
    return {
        k: covariance[6 * n : 6 * n + 6, 6 * n : 6 * n + 6] + floor for n, k in enumerate(problem.free_poses)
    }


def half_width(body: Body) -> float:
    """Half the smallest width of a body, mm, as of an ellipsoid of its second moments."""
    index = np.argwhere(body.voxels > 0.1 * body.voxels.max())[:, ::-1]
    if len(index) < 4:
        return 1.0
    moments = np.cov((index @ body.affine[:3, :3].T).T)
    return float(max(np.sqrt(5 * np.linalg.eigvalsh(moments)[0]), 1.0))


def _push_of_swelling(
    problem: RigidProblem, state: State, linearised: list[Linearised], k: int
) -> np.ndarray:
    """(P,) scores that the relative swelling of a structure by one would cause."""
    body = problem.bodies[k]
    affine = body.affine.copy()
    affine[:3] *= 1 + SWELLING
    affine[:3, 3] -= SWELLING * body.centre
    larger = Body(body.voxels, affine, body.centre)
    push = np.zeros(problem.size)
    for n, (view, linear) in enumerate(zip(problem.views, linearised, strict=True)):
        image, parts = problem.render(state, n)
        image[parts[k].slices] -= parts[k].image
        pose = state.poses[k] @ state.corrections[n]
        swollen = project_body(larger, view.camera, pose, problem.step_mm, problem.backend)
        image[swollen.slices] += swollen.image / (1 + SWELLING)
        change = (view.contrast.normalise(image).values - view.target - linear.residual) / SWELLING
        for block in linear.blocks:
            weighted = block.jacobian * (view.weight * change)[block.slices]
            push[block.first : block.first + 6] += weighted.sum(axis=(1, 2), dtype=np.float64)
    return push
