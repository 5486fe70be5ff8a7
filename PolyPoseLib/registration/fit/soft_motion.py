"""The soft tissue's own motion, fitted to the X-rays with the bones and the cameras held.

One step of Gauss-Newton at a time, between the steps of the bones: the X-rays' residual against what the modes of
:mod:`PolyPoseLib.registration.fit.soft_modes` do to the rendering, and against their prior.
"""

from __future__ import annotations

import numpy as np

from PolyPoseLib.registration.fit.problem import RigidProblem, State
from PolyPoseLib.registration.fit.soft_jacobian import SoftJacobian
from PolyPoseLib.registration.fit.soft_tissue import SoftTissue
from PolyPoseLib.registration.fit.views import LevelViews
from PolyPoseLib.registration.fit.weighting import MODEL_VARIANCE, robust_weight

PRIOR = 0.3
"""Weight of the prior against residuals of MODEL_VARIANCE that are independent from patch to patch."""

LARGEST_STEP_MM = 15.0
"""Steps are shortened so that no tissue is displaced farther."""

SHORTER, TRIALS = 0.4, 3
"""Factor by which a step that does not lower the cost is shortened, and how often."""


def fit_soft_motion(views: LevelViews, problem: RigidProblem, state: State) -> SoftTissue:
    """One step; the views' static images become those of the soft tissue that it leads to.

    Parameters
    ----------
    views : LevelViews
        The X-rays at a coarse level.
    problem : RigidProblem
        Of all structures in them.
    state : State
        Poses and cameras, which are held.

    Returns
    -------
    SoftTissue
        With the motion after the step, or as it was where no step lowers the cost.

    """
    return _Step(views, problem, state).taken()


class _Step:
    """One step of Gauss-Newton."""

    def __init__(self, views: LevelViews, problem: RigidProblem, state: State) -> None:
        self.views, self.problem, self.state = views, problem, state
        self.soft = views.run.soft_tissue
        self.following = self.soft.following(state.poses)
        self.weights: list[np.ndarray] = []
        pixels = (views.level.patch_mm / views.level.size_mm) ** 2
        variances = np.repeat(self.soft.modes.variances, 3)
        self.prior = PRIOR * MODEL_VARIANCE * pixels / variances

    def taken(self) -> SoftTissue:
        """See :func:`fit_soft_motion`."""
        start = self._coefficients(self.soft).reshape(-1)
        matrix, gradient, images = self._normal_equations()
        cost = images + float(self.prior @ start**2)
        step = -np.linalg.solve(matrix + np.diag(self.prior), gradient + self.prior * start)
        step *= min(1.0, LARGEST_STEP_MM / max(self._longest(step), 1e-9))
        for _ in range(TRIALS):
            trial = start + step
            soft = self.soft.with_motion(trial.reshape(-1, 3))
            if self._images(soft) + float(self.prior @ trial**2) < cost:
                return soft
            step *= SHORTER
        self._images(self.soft)
        return self.soft

    def _coefficients(self, soft: SoftTissue) -> np.ndarray:
        return np.zeros((soft.modes.count, 3)) if soft.coefficients is None else soft.coefficients

    def _longest(self, step: np.ndarray) -> float:
        """Largest displacement, mm along an axis, by coefficients (3 M,)."""
        moved = self.soft.with_motion(step.reshape(-1, 3)).moved(self.following)
        return float(np.abs(moved.vectors - self.following.vectors).max())

    def _normal_equations(self) -> tuple[np.ndarray, np.ndarray, float]:
        """Second derivative (3 M, 3 M) and gradient (3 M,) of half the images' cost, and the cost; sets the weights."""
        count = 3 * self.soft.modes.count
        matrix, gradient, cost = np.zeros((count, count)), np.zeros(count), 0.0
        field = self.soft.moved(self.following)
        size = self.views.level.size_mm
        jacobian = SoftJacobian(self.soft, field, self.soft.freedom(self.following), size)
        self.views.render_soft_field(field, self.state)
        for n, view in enumerate(self.views.views):
            image, _ = self.problem.render(self.state, n)
            normalised = view.contrast.normalise(image)
            residual = normalised.values - view.target
            weight = robust_weight(view, residual, view.contrast.support > 0)
            changes = jacobian.of_view(view.camera, self.state.corrections[n])
            whole = (0, image.shape[0], 0, image.shape[1])
            changes = view.contrast.derivative(normalised, changes, whole)[0].reshape(count, -1)
            weighted = changes * weight.reshape(-1)
            matrix += weighted @ changes.T
            gradient += weighted @ residual.reshape(-1)
            cost += float((weight * residual.astype(np.float64) ** 2).sum())
            self.weights.append(weight)
        return matrix, gradient, cost

    def _images(self, soft: SoftTissue) -> float:
        """The images' cost with another motion; the views then show it."""
        self.views.render_soft_field(soft.moved(self.following), self.state)
        return sum(
            float((weight * self.problem.residual(self.state, n).astype(np.float64) ** 2).sum())
            for n, weight in enumerate(self.weights)
        )
