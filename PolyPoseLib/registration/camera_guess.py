"""A camera to start from for one X-ray, by the best way at hand, and how sure it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from PolyPoseLib.errors import UntrustedResultError
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.imaging.xray import Xray
from PolyPoseLib.registration.hypotheses import Hypothesis, doubts
from PolyPoseLib.registration.levels import Measured
from PolyPoseLib.registration.monitor import Monitor
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.registration.search import SearchRange, find_cameras
from PolyPoseLib.rendering.backend import Backend

GIVEN_RADIUS = (5.0, 20.0)
"""Degrees and mm within which an extrinsic that a study gives as a guess is taken to be true."""

SEARCHED_RADIUS = (2.0, 10.0)
"""Degrees and mm within which a camera that was found by search is true, if the right one was found at all."""


@dataclass(frozen=True)
class Guess:
    """A camera before stage A.

    camera: where to start; sure: whether it may be believed without a look; radius: (degrees, mm) within which the
    truth is expected; how: one line for people; warnings: what is doubtful, one line each; similarity,
    runner_up: local correlation of the best hypothesis and of the best one that is clearly another view, when searched.
    """

    camera: Camera
    sure: bool
    radius: tuple[float, float]
    how: str
    warnings: tuple[str, ...] = ()
    similarity: float | None = None
    runner_up: float | None = None


def initial_camera(scene: Scene, xray: Xray, backend: Backend, monitor: Monitor, stage: str) -> Guess:
    """A camera for an X-ray whose camera is not known, from which stage A can start.

    An extrinsic in the study is taken as it is; one guessed from DICOM is the centre of a search within its own
    radius; without either, the camera is searched for.

    Raises:
        UntrustedResultError: no camera that was tried shows the anchor.

    """
    if xray.extrinsic is not None and xray.initial_radius is None:
        camera = Camera(xray.intrinsics, xray.extrinsic, *xray.image.shape)
        return Guess(camera, True, GIVEN_RADIUS, "the guess given in the study")
    return searched_camera(scene, xray, backend, monitor, stage)


def searched_camera(
    scene: Scene, xray: Xray, backend: Backend, monitor: Monitor, stage: str, view: str | None = None
) -> Guess:
    """Search around DICOM's guess when there is one, else around a standard view, or around all of them."""
    start = Camera(
        xray.intrinsics, np.eye(4) if xray.extrinsic is None else xray.extrinsic, *xray.image.shape
    )
    distance = xray.source_to_detector_mm
    if view is None and xray.extrinsic is not None and xray.initial_radius is not None:
        placed = _on_anchor(xray, scene)
        start = start.with_extrinsic(placed.extrinsic)
        searched = SearchRange.around_camera(start, scene.anchor_centre, xray.initial_radius, distance)
        how = "searched around the guess from DICOM"
    else:
        searched = SearchRange.around_view(view, distance)
        how = f"searched around {view}" if view else "searched in all directions"
    measured = Measured(xray.image, xray.mask, start)
    found = find_cameras(scene, measured, searched, backend, monitor, stage)
    if not found:
        raise UntrustedResultError(
            f'The camera of X-ray "{xray.name}" was not found: no view that was tried shows the anchor; give its '
            '"extrinsic", "landmarks" or "standard_view".'
        )
    return judged_guess(found, how, xray.name)


def judged_guess(found: Sequence[Hypothesis], how: str, name: str) -> Guess:
    """The best of several hypotheses with its doubts."""
    best = found[0]
    second = max((other.similarity for other in found[1:]), default=None)
    said = doubts(found)
    warnings = (
        (
            f'The camera of X-ray "{name}" is doubtful: {"; ".join(said)}; look at it, or give its "landmarks" or '
            '"standard_view".',
        )
        if said
        else ()
    )
    runner = "" if second is None else f", the next best {second:.2f}"
    how = f"{how}: similarity {best.similarity:.2f}{runner}"
    return Guess(best.camera, not said, SEARCHED_RADIUS, how, warnings, best.similarity, second)


def _on_anchor(xray: Xray, scene: Scene) -> Xray:
    """The X-ray with a guess whose isocentre nobody told placed on the anchor."""
    if xray.isocenter is not None and not np.any(xray.isocenter):
        return xray.placed_at(scene.anchor_centre)
    return xray
