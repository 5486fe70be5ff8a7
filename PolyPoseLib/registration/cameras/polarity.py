"""X-rays whose gray levels run the other way than stated: both are tried where the stated one matches badly."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Protocol, TypeVar

import numpy as np

from PolyPoseLib.data.xray import Xray
from PolyPoseLib.errors import UntrustedResultError
from PolyPoseLib.registration.cameras.hypotheses import CERTAIN_SIMILARITY, LEAST_LEAD, LEAST_SIMILARITY


class Scored(Protocol):
    """What was found for one X-ray."""

    @property
    def similarity(self) -> float:
        """Local correlation around the anchor, in [-1, 1]; NaN where it was not computed."""
        ...


F = TypeVar("F", bound=Scored)

Finder = Callable[[Sequence[Xray], bool], Sequence[F]]
"""Cameras of X-rays, with or without a search far off; raises UntrustedResultError where none shows the anchor."""


def inverted(xray: Xray) -> Xray:
    """The X-ray with its gray levels reversed, their smallest within the mask at 0; it says so in its warnings."""
    image = np.where(xray.mask, xray.image[xray.mask].max() - xray.image, 0)
    warning = (
        "its gray levels run the other way than they were taken (bone dark instead of bright, or the reverse): they "
        'were inverted, because only so does it match the CT; state its "intensity" to settle it.'
    )
    return replace(xray, image=image, warnings=(*xray.warnings, warning))


def found_in_better_polarity(xrays: Sequence[Xray], find: Finder[F]) -> tuple[Sequence[Xray], Sequence[F]]:
    """What is found for X-rays as they are or, where that matches badly, with all of them inverted.

    Both are tried near the initial cameras before one is searched for.

    Parameters
    ----------
    xrays : sequence of Xray
        One by itself, or those of one rig.
    find : callable
        Finds their cameras, with or without a search.

    Returns
    -------
    sequence of Xray
        As given, or inverted.
    sequence of Scored
        What was found for these.

    Raises
    ------
    UntrustedResultError
        Nothing was found for either.

    """
    found, error = _attempt(xrays, find, search=False)
    if found and not _similarity(found) < CERTAIN_SIMILARITY:  # NaN: nothing to compare
        return xrays, found
    turned = [inverted(xray) for xray in xrays]
    other, _ = _attempt(turned, find, search=False)
    if _clearly_better(other, found):
        return turned, other
    searched = (
        len(xrays) == 1 and xrays[0].camera != "known"
    )  # known cameras and rigs stay near where they are
    if searched:
        found, error = _attempt(xrays, find, search=True)
    if searched and _similarity(found) < LEAST_SIMILARITY:
        other, _ = _attempt(turned, find, search=True)
        if _clearly_better(other, found, CERTAIN_SIMILARITY):  # far off, wrong ones are plausible too
            return turned, other
    if error is not None:
        raise error
    return xrays, found


def _clearly_better(
    other: Sequence[Scored], found: Sequence[Scored], least: float = LEAST_SIMILARITY
) -> bool:
    return _similarity(other) >= max(least, _similarity(found) + LEAST_LEAD)


def _attempt(
    xrays: Sequence[Xray], find: Finder[F], search: bool
) -> tuple[Sequence[F], UntrustedResultError | None]:
    try:
        return find(xrays, search), None
    except UntrustedResultError as error:
        return (), error


def _similarity(found: Sequence[Scored]) -> float:
    """Mean over X-rays; -1 where nothing was found."""
    return float(np.mean([each.similarity for each in found])) if found else -1.0
