"""How well each bone's rendering agrees with each X-ray, and which bones the X-rays contradict.

Two measures. The residual where a bone shows is large wherever the X-ray holds something that the CT does not: a wrong
bone, but also a shutter, scatter, or metal over a right one. The support is the correlation between what the bone adds
to the rendering and what the X-ray lacks without it, which a bone in a wrong place does not have. An X-ray contradicts
a bone where the residual is large and the support small; a bone is inconsistent where some X-ray contradicts it and
none that is undisturbed supports it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from PolyPoseLib.registration.fit.levels import COMPARISON_LEVEL, Observation
from PolyPoseLib.registration.fit.problem import RigidProblem, State, View
from PolyPoseLib.registration.fit.views import LevelViews
from PolyPoseLib.registration.fit.weighting import dilated, mark_shown, reliability
from PolyPoseLib.registration.run import Run
from PolyPoseLib.rendering.rigid import BodyProjection

DISTURBED, UNDISTURBED = 0.2, 0.1
"""Residuals above which something is wrong where a bone shows, and up to which nothing is. At right poses it is 0.02 to
0.07, up to 0.15 where much soft tissue lies over the bone."""

SUPPORTED = 0.5
"""Support from which an X-ray shows a bone where it is. In the best X-ray it is 0.46 to 0.95 of right bones, up to 0.46
of wrong ones, see Testing/Benchmarks/degraded.py."""

PART_SUPPORTED = 0.45
"""Support up to which no X-ray shows one of several bones that move as one structure. In the best X-ray it is 0.5 and
above of right ones (vertebrae, ribs, femurs, halves of a pelvis)."""

APART_MM, CONVINCING = 3.0, 0.6
"""Shift by which such a bone has moved against the others, and the support that it has there in some X-ray."""

LEAST_PIXELS = 20
"""A bone that shows in fewer pixels cannot be compared."""

EDGE_PX = 2
"""Pixels around a bone's projection that count for its support: its edge is what places it."""


@dataclass(frozen=True)
class PartAgreement:
    """Of one of several bones that were united in a structure, with N X-rays.

    Attributes
    ----------
    label : int or None
        Of the segmentation; None where one label holds several bones.
    support, refitted : (N,) ndarray
        As :class:`Agreement` holds it, where the structure's pose puts the bone and where it fits by itself.
    shift_mm : float
        How far the two are apart across the beam, in the X-ray in which it is most.

    """

    label: int | None
    support: np.ndarray
    refitted: np.ndarray
    shift_mm: float

    @property
    def shows_elsewhere(self) -> bool:
        """Whether an X-ray shows it clearly, somewhere else than the structure's pose puts it."""
        return self.shift_mm > APART_MM and bool((self.refitted >= CONVINCING).any())

    @property
    def is_off(self) -> bool:
        """Whether it is somewhere else, or X-rays show it but none where the structure's pose puts it."""
        shows = self.support[~np.isnan(self.support)]
        return self.shows_elsewhere or (len(shows) > 0 and bool((shows < PART_SUPPORTED).all()))


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
    parts : mapping of int to sequence of PartAgreement
        Of structures that unite several bones, by index, where they were compared one by one.

    """

    residuals: np.ndarray
    support: np.ndarray
    contrast: np.ndarray
    parts: Mapping[int, Sequence[PartAgreement]] = field(default_factory=dict)

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

    def parts_off(self, k: int) -> list[PartAgreement]:
        """Bones united in a structure that are not where its pose puts them, while others are.

        Where none is, it is the structure that is off.
        """
        parts = self.parts.get(k, ())
        off = [part for part in parts if part.is_off]
        return off if len(off) < len(parts) else []

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
    return agreement_in(*posed(run, observations, poses))


def agreement_in(problem: RigidProblem, state: State) -> Agreement:
    """Of every structure of a problem with its views, at COMPARISON_LEVEL, in front of their soft tissue."""
    residuals, support, contrast = np.full((3, len(state.poses), len(problem.views)), np.nan)
    for k, n, shown in _shown_structures(problem, state):
        residuals[k, n] = shown.residual()
        support[k, n], contrast[k, n] = shown.support_and_contrast()
    return Agreement(residuals, support, contrast)


def structure_residuals(run: Run, observations: Sequence[Observation], poses: np.ndarray) -> np.ndarray:
    """(K, N) mean squared residuals, as :class:`Agreement` holds them, for less work."""
    residuals = np.full((len(poses), len(observations)), np.nan)
    for k, n, shown in _shown_structures(*posed(run, observations, poses)):
        residuals[k, n] = shown.residual()
    return residuals


@dataclass(frozen=True)
class Shown:
    """A structure, or a part of one, in an X-ray. view: the X-ray; image, normalised: (H, W) rendering of everything;
    part: of it, the structure; shows: (H, W) bool, where that can be seen.
    """

    view: View
    image: np.ndarray
    normalised: np.ndarray
    part: BodyProjection
    shows: np.ndarray

    def residual(self) -> float:
        """Mean squared residual where the structure shows."""
        squared = (self.normalised - self.view.target)[self.shows] ** 2
        return float(np.average(squared, weights=reliability(self.view)[self.shows]))

    def support_and_contrast(self) -> tuple[float, float]:
        """As :class:`Agreement` holds them."""
        without = self.image.copy()
        without[self.part.slices] -= self.part.image
        left = self.view.contrast.normalise(without).values
        around = dilated(self.shows, EDGE_PX) & (self.view.contrast.support > 0)
        adds, lacks = (self.normalised - left)[around], (self.view.target - left)[around]
        weights = reliability(self.view)[around]
        return _correlation(adds, lacks, weights), float(np.average(adds**2, weights=weights))


def posed(run: Run, observations: Sequence[Observation], poses: np.ndarray) -> tuple[RigidProblem, State]:
    """All structures at poses (K, 4, 4), as they are compared with their X-rays."""
    return LevelViews(run, observations, COMPARISON_LEVEL).posed_structures(poses)


def _shown_structures(problem: RigidProblem, state: State) -> Iterator[tuple[int, int, Shown]]:
    """(structure, X-ray, what it shows there) wherever a structure shows in enough pixels."""
    for n, view in enumerate(problem.views):
        image, parts = problem.render(state, n)
        normalised = view.contrast.normalise(image).values
        for k, part in enumerate(parts):
            shown = shown_in(view, image, normalised, part)
            if shown is not None:
                yield k, n, shown


def shown_in(view: View, image: np.ndarray, normalised: np.ndarray, part: BodyProjection) -> Shown | None:
    """What a part of a view's rendering (H, W) shows; None where that is in hardly any pixel."""
    shows = np.zeros(image.shape, bool)
    mark_shown(shows, part)
    shows &= view.contrast.support > 0
    return Shown(view, image, normalised, part, shows) if shows.sum() >= LEAST_PIXELS else None


def _correlation(first: np.ndarray, second: np.ndarray, weights: np.ndarray) -> float:
    """Of two images without their means, which local normalisation has removed; 0 where one of them is nothing."""
    scale = np.sqrt(float(weights @ first**2) * float(weights @ second**2))
    return float(weights @ (first * second)) / scale if scale > 0 else 0.0
