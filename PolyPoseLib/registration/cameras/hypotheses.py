"""Candidate cameras, how well each agrees with its X-ray, and which of them are the same."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.registration.fit.levels import Level, Observation
from PolyPoseLib.registration.fit.views import LevelViews
from PolyPoseLib.registration.fit.weighting import region_around
from PolyPoseLib.registration.run import Run

REACH_MM = 12.0
"""The X-ray is compared this far around the anchor."""

LEAST_PIXELS = 30
"""With fewer pixels around the anchor nothing is compared."""

LEAST_SIMILARITY = 0.42
"""Local correlation around the anchor below which a camera is not plausible."""

LEAST_LEAD = 0.12
"""By which the best camera's similarity must exceed the runner-up's, or else another view is as plausible."""

LEAST_SHARE = 0.4
"""Of the anchor that must show in the X-ray."""

LEAST_VOTES = 2
"""Starts that must have ended at the best camera, unless it is CERTAIN_SIMILARITY or more."""

CERTAIN_SIMILARITY = 0.65
"""Similarity that no wrong camera reaches."""


@dataclass(frozen=True)
class Hypothesis:
    """A candidate camera with its evidence.

    Parameters
    ----------
    camera : Camera
        At full resolution.
    similarity : float
        Correlation of locally normalised X-ray and rendering around the anchor, in [-1, 1].
    share : float
        Of the anchor that projects into the X-ray, 0 to 1.
    votes : int
        How many starts ended here.

    """

    camera: Camera
    similarity: float
    share: float
    votes: int = 1

    @property
    def score(self) -> float:
        """What hypotheses are ranked by: the similarity, less for an anchor that is partly outside."""
        return self.similarity * float(np.sqrt(self.share))


def score_camera(run: Run, observation: Observation, level: Level, points: np.ndarray) -> Hypothesis:
    """How well an X-ray agrees with its camera.

    Parameters
    ----------
    run : Run
        The patient and the renderer.
    observation : Observation
        The X-ray with the camera.
    level : Level
        The resolution.
    points : (N, 3) ndarray
        LPS mm, on the anchor.

    Returns
    -------
    Hypothesis
        Of one vote.

    """
    camera = observation.camera
    pixels = camera.project(points)
    bounds = (camera.width - 0.5, camera.height - 0.5)
    share = float(((pixels >= -0.5) & (pixels <= bounds)).all(axis=1).mean())
    views = LevelViews(run, [observation], level, expect_noise=False)
    (view,), rest = views.views, views.at_rest(1)
    region = region_around(views.anchor(), rest, 0, [0], REACH_MM)
    region &= view.contrast.support > 0
    if region.sum() < LEAST_PIXELS or share == 0:
        return Hypothesis(camera, 0.0, share)
    rendered = view.contrast.normalise(views.whole_ct().render(rest, 0)[0]).values[region]
    return Hypothesis(camera, _correlation(rendered, view.target[region]), share)


def is_plausible(hypothesis: Hypothesis) -> bool:
    """Whether a camera's rendering is similar enough to its X-ray."""
    return hypothesis.similarity >= LEAST_SIMILARITY


def has_too_few_votes(hypothesis: Hypothesis) -> bool:
    """Whether a camera was reached from too few starts for a similarity that a wrong one may have."""
    return hypothesis.votes < LEAST_VOTES and hypothesis.similarity < CERTAIN_SIMILARITY


def reasons_for_uncertainty(found: Sequence[Hypothesis]) -> list[str]:
    """What speaks against the first of several hypotheses, best first; each a clause for people."""
    best = found[0]
    reasons = []
    if not is_plausible(best):
        reasons.append(
            f"the rendering does not match it well (local correlation {best.similarity:.2f}, at least "
            f"{LEAST_SIMILARITY:g} is expected)"
        )
    rival = max((other.similarity for other in found[1:]), default=-1.0)
    if best.similarity - rival < LEAST_LEAD:
        reasons.append(f"another view matches it about as well ({rival:.2f} against {best.similarity:.2f})")
    if best.share < LEAST_SHARE:
        reasons.append(f"only {100 * best.share:.0f} % of the anchor shows in it")
    if has_too_few_votes(best):
        reasons.append("it was reached from one start only")
    return reasons


def merged(
    found: Sequence[Hypothesis], points: np.ndarray, least_mm: float, most: int, same_mm: float
) -> list[Hypothesis]:
    """The best hypotheses, each with the votes of those that are the same.

    Parameters
    ----------
    found : sequence of Hypothesis
        In any order.
    points : (N, 3) ndarray
        LPS mm, by whose projections cameras are compared.
    least_mm : float
        Least distance from all better hypotheses.
    most : int
        How many are kept.
    same_mm : float
        Hypotheses within this distance are the same.

    Returns
    -------
    list of Hypothesis
        Best first.

    """
    cameras = [hypothesis.camera for hypothesis in found]
    kept = distinct(cameras, np.array([hypothesis.score for hypothesis in found]), points, least_mm, most)
    pixels = np.stack([_pixels(camera, points) for camera in cameras]) if cameras else np.zeros((0, 1, 2))
    votes = np.array([hypothesis.votes for hypothesis in found])
    result = []
    for n in kept:
        near = _distances(pixels, pixels[n], _scale(cameras[n], points)) <= same_mm
        result.append(replace(found[n], votes=int(votes[near].sum())))
        votes[near] = 0
    return result


def apart_mm(first: Camera, second: Camera, points: np.ndarray) -> float:
    """Mean distance between two cameras' projections of points (N, 3), in mm at the points' depth."""
    return float(_distances(_pixels(first, points)[None], _pixels(second, points), _scale(first, points))[0])


def distinct(
    cameras: Sequence[Camera], scores: np.ndarray, points: np.ndarray, least_mm: float, most: int
) -> list[int]:
    """The best cameras that differ.

    Parameters
    ----------
    cameras : sequence of Camera
        In any order.
    scores : (M,) ndarray
        Of the cameras.
    points : (N, 3) ndarray
        LPS mm, by whose projections cameras are compared.
    least_mm : float
        Least distance from all better cameras.
    most : int
        How many are kept.

    Returns
    -------
    list of int
        Indices, best first.

    """
    pixels = (
        np.stack([_pixels(camera, points) for camera in cameras]) if len(cameras) else np.zeros((0, 1, 2))
    )
    kept: list[int] = []
    for n in np.argsort(-np.asarray(scores), kind="stable"):
        if not kept or _distances(pixels[kept], pixels[n], _scale(cameras[n], points)).min() > least_mm:
            kept.append(int(n))
        if len(kept) == most:
            break
    return kept


def _pixels(camera: Camera, points: np.ndarray) -> np.ndarray:
    """Projections (N, 2); points behind the source count as far away."""
    return np.nan_to_num(camera.project(points), nan=1e6)


def _scale(camera: Camera, points: np.ndarray) -> np.ndarray:
    """(N,) mm per pixel at the points."""
    return np.maximum(camera.depth(points), 1.0) / camera.intrinsics[0, 0]


def _distances(many: np.ndarray, one: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """(M,) mean distances in mm of projections (M, N, 2) from others (N, 2)."""
    return (np.linalg.norm(many - one, axis=2) * scale).mean(axis=1)


def _correlation(first: np.ndarray, second: np.ndarray) -> float:
    first, second = first - first.mean(), second - second.mean()
    norm = float(np.linalg.norm(first) * np.linalg.norm(second))
    return float(first @ second) / norm if norm > 1e-9 else 0.0
