"""The soft tissue's own motion, fitted to the X-rays with the bones and the cameras held.

One step of Gauss-Newton at a time, between the steps of the bones: the X-rays' residual against what the modes of
:mod:`PolyPoseLib.registration.fit.soft_modes` do to the rendering, and against their prior. How large such a motion is
along each axis the X-rays tell as well. That is stated, for what they do not show of it is likely as large. The fit
keeps its prior: with a narrower one it stopped short of large motions, and bones moved in their stead. When it has
ended, the motion becomes that of the size that was found, so that nothing moves where nothing seems to.
"""

from __future__ import annotations

import numpy as np

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.registration.fit.problem import RigidProblem, State, summed
from PolyPoseLib.registration.fit.soft_jacobian import SoftJacobian
from PolyPoseLib.registration.fit.soft_products import Products, device_products, products
from PolyPoseLib.registration.fit.soft_size import MotionEquations
from PolyPoseLib.registration.fit.soft_tissue import SoftTissue
from PolyPoseLib.registration.fit.views import LevelViews
from PolyPoseLib.registration.fit.weighting import MODEL_VARIANCE, robust_weight
from PolyPoseLib.similarity.local_contrast import NormalisedImage

PRIOR = 0.3
"""Weight of the prior against residuals of MODEL_VARIANCE that are independent from patch to patch."""

LARGEST_STEP_MM = 15.0
"""Steps are shortened so that no tissue is displaced farther."""

SHORTER, TRIALS = 0.4, 3
"""Factor by which a step that does not lower the cost is shortened, and how often."""


def fit_soft_motion(
    views: LevelViews, problem: RigidProblem, state: State
) -> tuple[SoftTissue, DisplacementField]:
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
    soft_tissue : SoftTissue
        With the motion after the step, or as it was where no step lowers the cost.
    field : DisplacementField
        Of all its motion under the poses, which the static images show.

    """
    return _Step(views, problem, state).taken()


class _Step:
    """One step of Gauss-Newton."""

    def __init__(self, views: LevelViews, problem: RigidProblem, state: State) -> None:
        self.views, self.state = views, state
        self.soft = views.run.soft_tissue
        self.following = self.soft.following(state.poses)
        self.freedom = self.soft.freedom(self.following)
        self.bones = [problem.project(state, n) for n in range(len(views.views))]
        self.weights: list[np.ndarray] = []
        pixels = (views.level.patch_mm / views.level.size_mm) ** 2
        self.noise = PRIOR * MODEL_VARIANCE * pixels

    def taken(self) -> tuple[SoftTissue, DisplacementField]:
        """See :func:`fit_soft_motion`."""
        start = self._coefficients(self.soft).reshape(-1)
        matrix, gradient, images = self._normal_equations()
        equations = MotionEquations(matrix, matrix @ start - gradient, self.soft.modes.variances, self.noise)
        prior = equations.prior(np.ones(3))
        cost = images + float(prior @ start**2)
        step = -np.linalg.solve(matrix + np.diag(prior), gradient + prior * start)
        step *= min(1.0, LARGEST_STEP_MM / max(self._longest(step), 1e-9))
        for _ in range(TRIALS):
            trial = start + step
            soft = self.soft.with_motion(trial.reshape(-1, 3), equations)
            field = self._field(soft)
            if self._images(field) + float(prior @ trial**2) < cost:
                return soft, field
            step *= SHORTER
        field = self._field(self.soft)
        self.views.render_soft_field(field, self.state)
        return self.soft, field

    def _field(self, soft: SoftTissue) -> DisplacementField:
        """Displacements of soft tissue that moves so beside the bones."""
        return soft.moved(self.following, self.freedom)

    def _normalised(self, n: int) -> NormalisedImage:
        """A view's rendering with its present static image."""
        view = self.views.views[n]
        return view.contrast.normalise(summed(view.static, self.bones[n]))

    def _coefficients(self, soft: SoftTissue) -> np.ndarray:
        return np.zeros((soft.modes.count, 3)) if soft.coefficients is None else soft.coefficients

    def _longest(self, step: np.ndarray) -> float:
        """Largest displacement, mm along an axis, by coefficients (3 M,)."""
        moved = self._field(self.soft.with_motion(step.reshape(-1, 3)))
        return float(np.abs(moved.vectors - self.following.vectors).max())

    def _normal_equations(self) -> tuple[np.ndarray, np.ndarray, float]:
        """Second derivative (3 M, 3 M) and gradient (3 M,) of half the images' cost, and the cost; sets the weights."""
        count = 3 * self.soft.modes.count
        matrix, gradient, cost = np.zeros((count, count)), np.zeros(count), 0.0
        field = self._field(self.soft)
        jacobian = SoftJacobian(self.soft, field, self.freedom, self.views.level.size_mm)
        self.views.render_soft_field(field, self.state)
        for n, view in enumerate(self.views.views):
            normalised = self._normalised(n)
            residual = normalised.values - view.target
            weight = robust_weight(view, residual, view.contrast.support > 0)
            found = self._products(n, jacobian, normalised, weight)
            matrix += found.matrix
            gradient += found.gradient
            cost += float((weight * residual.astype(np.float64) ** 2).sum())
            self.weights.append(weight)
        return matrix, gradient, cost

    def _products(
        self, n: int, jacobian: SoftJacobian, image: NormalisedImage, weight: np.ndarray
    ) -> Products:
        """What a view contributes, for its normalised rendering and pixel weights (H, W)."""
        view, correction = self.views.views[n], self.state.corrections[n]
        if self.soft.device is None:
            return products(view, image, weight, jacobian.of_view(view.camera, correction))
        bones = summed(np.zeros_like(view.static), self.bones[n])
        return device_products(view, bones, weight, jacobian.on_device(view.camera, correction))

    def _images(self, field: DisplacementField) -> float:
        """The images' cost with soft tissue that a field displaces; the views then show it."""
        self.views.render_soft_field(field, self.state)
        cost = 0.0
        for n, (view, weight) in enumerate(zip(self.views.views, self.weights, strict=True)):
            residual = self._normalised(n).values - view.target
            cost += float((weight * residual.astype(np.float64) ** 2).sum())
        return cost
