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
from PolyPoseLib.registration.fit.weighting import VISIBLE_LINE_INTEGRAL, dilated, mark_shown, reliability
from PolyPoseLib.registration.run import Run
from PolyPoseLib.rendering.rigid import BodyProjection

DISTURBED, UNDISTURBED = 0.2, 0.1
"""Residuals above which something is wrong where a bone shows, and up to which nothing is. At right poses it is 0.02 to
0.07, up to 0.15 where much soft tissue lies over the bone."""

SUPPORTED = 0.5
"""Support from which an X-ray shows a bone where it is. In the best X-ray it is 0.46 to 0.95 of right bones, up to 0.46
of wrong ones, see Testing/Benchmarks/degraded.py."""

PART_SUPPORTED = 0.45
"""The same for one of several bones that move as one structure, which has less of an edge of its own. In the best X-ray
it is 0.5 and above of right whole vertebrae, ribs, femurs and halves of a pelvis."""

APART_MM, GAIN, CONVINCING = 3.0, 0.05, 0.6
"""Shift by which such a bone has moved against the others, in the scene, how much more support it has there, and how
much where there is no doubt. Right bones shift by up to 2.5 mm when they are fitted alone."""

LARGE_GAIN = 0.1
"""Of support where there is doubt: half a vertebra at a CT's end gained 0.05 and shifted by 3.6 mm, femurs that were 6
mm off and more gained 0.13 to 0.4."""

FAINT_SHARE = 0.4
"""Share of a structure's projection that stands out, below which its label is not that of a bone. It is 0.55 and above
of bones, thin ones and a CT clipped to soft tissue included, 0.1 to 0.38 of what is left of vertebrae 5 mm inside."""

LEAST_PIXELS = 20
"""A bone that shows in fewer pixels cannot be compared. Of projections with less than twice as many the border is the
larger part."""

EDGE_PX = 2
"""Pixels around a bone's projection that count for its support: its edge is what places it."""


@dataclass(frozen=True)
class PartAgreement:
    """Of one of several bones that were united in a structure, with N X-rays, NaN where it hardly shows.

    Attributes
    ----------
    label : int or None
        Of the segmentation; None where one label holds several bones.
    support, refitted : (N,) ndarray
        As :class:`Agreement` holds it, where the structure's pose puts the bone and where it fits by itself.
    shifts_mm : (N,) ndarray
        How far the two are apart across the beam.

    """

    label: int | None
    support: np.ndarray
    refitted: np.ndarray
    shifts_mm: np.ndarray

    @property
    def moved(self) -> np.ndarray:
        """(N,) bool, in which X-rays it fits better somewhere else."""
        return self._moved(GAIN)

    def _moved(self, gain: float) -> np.ndarray:
        """(N,) bool, in which X-rays it has so much more support somewhere else."""
        return np.asarray((self.shifts_mm > APART_MM) & (self.refitted - self.support >= gain))

    @property
    def shift_mm(self) -> float:
        """The largest shift to where it fits better."""
        return float(self.shifts_mm[self.moved].max(initial=0))

    @property
    def shows_elsewhere(self) -> bool:
        """Whether an X-ray shows it clearly, somewhere else than the structure's pose puts it."""
        return bool((self.moved & (self.refitted >= CONVINCING)).any())

    @property
    def is_off(self) -> bool:
        """Whether an X-ray shows it elsewhere, or it fits much better there and none shows it where it should be."""
        shown = bool((self.support >= PART_SUPPORTED).any())
        return self.shows_elsewhere or bool(self._moved(LARGE_GAIN).any() and not shown)

    @property
    def is_right(self) -> bool:
        """Whether an X-ray shows it where the structure's pose puts it, and none elsewhere."""
        return not self.moved.any() and bool((self.support >= SUPPORTED).any())


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
    shown_share : (K, N) ndarray
        Share, 0 to 1, of a structure's projection in which it stands out; NaN where hardly any of that is in the
        picture, or used of it.
    parts : mapping of int to sequence of PartAgreement
        Of structures that unite several bones, by index, where they were compared one by one.

    """

    residuals: np.ndarray
    support: np.ndarray
    contrast: np.ndarray
    shown_share: np.ndarray
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

    @property
    def is_unseen(self) -> np.ndarray:
        """(K,) bool, which structures hardly show in any X-ray."""
        return np.asarray(np.isnan(self.residuals).all(axis=1))

    @property
    def in_picture(self) -> np.ndarray:
        """(K,) bool, which structures lie in the used part of some X-ray."""
        return np.asarray(~np.isnan(self.shown_share).all(axis=1))

    @property
    def is_faint(self) -> np.ndarray:
        """(K,) bool, which structures lie in X-rays and stand out in none as bones do."""
        return np.asarray(self.in_picture & ~(self.shown_share >= FAINT_SHARE).any(axis=1))

    def parts_off(self, k: int) -> list[PartAgreement]:
        """Bones united in a structure that are not where its pose puts them, while the whole, or another of them, is.

        Where neither is, it is the structure that is off, and unclear.
        """
        parts = self.parts.get(k, ())
        there = self.is_clear[k] or any(part.is_right for part in parts)
        return [part for part in parts if part.is_off] if there else []

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
    shares = [
        [_shown_share(view, part) for part in problem.project(state, n)]
        for n, view in enumerate(problem.views)
    ]
    return Agreement(residuals, support, contrast, np.array(shares).T)


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


def _shown_share(view: View, part: BodyProjection) -> float:
    """Share of what a body covers in the used part of a view in which it stands out; NaN where it covers little."""
    covered = part.image[(part.image != 0) & (view.contrast.support[part.slices] > 0)]
    return (
        float((np.abs(covered) > VISIBLE_LINE_INTEGRAL).mean())
        if covered.size >= 2 * LEAST_PIXELS
        else np.nan
    )


def _correlation(first: np.ndarray, second: np.ndarray, weights: np.ndarray) -> float:
    """Of two images without their means, which local normalisation has removed; 0 where one of them is nothing."""
    scale = np.sqrt(float(weights @ first**2) * float(weights @ second**2))
    return float(weights @ (first * second)) / scale if scale > 0 else 0.0
