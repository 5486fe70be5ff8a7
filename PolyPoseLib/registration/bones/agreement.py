"""How well each bone's rendering agrees with each X-ray, and which bones the X-rays contradict.

Two measures. The residual where a bone shows is large wherever the X-ray holds something that the CT does not: a wrong
bone, but also a shutter, scatter, or metal over a right one. The support is the correlation between what the bone adds
to the rendering and what the X-ray lacks without it, which a bone in a wrong place does not have. An X-ray contradicts
a bone where the residual is large and the support small; a bone is inconsistent where some X-ray contradicts it and
none that is undisturbed supports it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from PolyPoseLib.registration.fit.levels import Level, Observation
from PolyPoseLib.registration.fit.views import LevelViews
from PolyPoseLib.registration.fit.weighting import VISIBLE_LINE_INTEGRAL, dilated, reliability
from PolyPoseLib.registration.run import Run
from PolyPoseLib.rendering.rigid import BodyProjection

COMPARISON_LEVEL = Level(3.0, 20.0, 0)
"""Resolution at which bones are compared: coarse enough that texture does not decide."""

DISTURBED, UNDISTURBED = 0.2, 0.1
"""Residuals above which something is wrong where a bone shows, and up to which nothing is. At right poses it is 0.02 to
0.07, up to 0.15 where much soft tissue lies over the bone."""

SUPPORTED = 0.5
"""Support from which an X-ray shows a bone where it is. In the best X-ray it is 0.46 to 0.95 of right bones, up to 0.46
of wrong ones, see Testing/Benchmarks/degraded.py."""

LEAST_PIXELS = 20
"""A bone that shows in fewer pixels cannot be compared."""

EDGE_PX = 2
"""Pixels around a bone's projection that count for its support: its edge is what places it."""


@dataclass(frozen=True)
class Agreement:
    """Of K structures with N X-rays, NaN where a structure hardly shows.

    Attributes
    ----------
    residuals : (K, N) ndarray
        Mean squared residual where the structure shows, in variances of the X-ray's local contrast.
    support : (K, N) ndarray
        Correlation of what the structure adds with what the X-ray lacks without it, in [-1, 1].
    contrast : (K, N) ndarray
        Mean square of what it adds, in variances of the local contrast.

    """

    residuals: np.ndarray
    support: np.ndarray
    contrast: np.ndarray

    @property
    def contradicted(self) -> np.ndarray:
        """(K, N) bool, where an X-ray contradicts a structure."""
        return (self.residuals > DISTURBED) & (self.support < SUPPORTED)

    @property
    def supported(self) -> np.ndarray:
        """(K, N) bool, where an undisturbed X-ray shows a structure where it is."""
        return (self.residuals <= UNDISTURBED) & (self.support >= SUPPORTED)

    @property
    def is_clear(self) -> np.ndarray:
        """(K,) bool, which structures some X-ray shows where they are, disturbed or not."""
        return np.asarray((self.support >= SUPPORTED).any(axis=1))

    @property
    def disputed(self) -> np.ndarray:
        """(K,) bool, which structures some X-ray contradicts and another supports."""
        return np.asarray(self.contradicted.any(axis=1) & self.supported.any(axis=1))

    def inconsistent(self, anchor: int) -> list[int]:
        """Indices of the structures, the anchor excepted, that an X-ray contradicts and none supports."""
        against = self.contradicted.any(axis=1) & ~self.disputed
        return [k for k in np.flatnonzero(against).tolist() if k != anchor]


def structure_agreement(run: Run, observations: Sequence[Observation], poses: np.ndarray) -> Agreement:
    """Compare every structure with every X-ray.

    Pixels count by their reliability, so that noise does not count against a bone.

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
    Agreement
        Of the K structures with the N X-rays.

    """
    level = LevelViews(run, observations, COMPARISON_LEVEL)
    problem, state = level.posed_structures(poses)
    residuals, support, contrast = np.full((3, len(poses), len(level.views)), np.nan)
    for n, view in enumerate(level.views):
        image, parts = problem.render(state, n)
        normalised, weight = view.contrast.normalise(image).values, reliability(view)
        for k, part in enumerate(parts):
            shows = _shows(part, image.shape) & (view.contrast.support > 0)
            if shows.sum() < LEAST_PIXELS:
                continue
            residuals[k, n] = np.average((normalised - view.target)[shows] ** 2, weights=weight[shows])
            without = image.copy()
            without[part.slices] -= part.image
            left = view.contrast.normalise(without).values
            around = dilated(shows, EDGE_PX) & (view.contrast.support > 0)
            adds, lacks = (normalised - left)[around], (view.target - left)[around]
            weights = weight[around]
            support[k, n] = _correlation(adds, lacks, weights)
            contrast[k, n] = np.average(adds**2, weights=weights)
    return Agreement(residuals, support, contrast)


def structure_residuals(run: Run, observations: Sequence[Observation], poses: np.ndarray) -> np.ndarray:
    """(K, N) mean squared residuals, as :class:`Agreement` holds them."""
    return structure_agreement(run, observations, poses).residuals


def _shows(part: BodyProjection, shape: tuple[int, ...]) -> np.ndarray:
    """(H, W) bool: where a bone adds something that can be seen."""
    shows = np.zeros(shape, bool)
    shows[part.slices] = np.abs(part.image) > VISIBLE_LINE_INTEGRAL
    return shows


def _correlation(first: np.ndarray, second: np.ndarray, weights: np.ndarray) -> float:
    """Of two images without their means, which local normalisation has removed; 0 where one of them is nothing."""
    scale = np.sqrt(float(weights @ first**2) * float(weights @ second**2))
    return float(weights @ (first * second)) / scale if scale > 0 else 0.0
