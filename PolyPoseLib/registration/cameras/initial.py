"""A camera to start from for one X-ray, by the best way at hand, and how sure it is."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from PolyPoseLib.data.found_camera import FoundCamera
from PolyPoseLib.data.progress import Monitor
from PolyPoseLib.data.xray import Xray
from PolyPoseLib.errors import InputError, UntrustedResultError
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.pnp import PnpSolution, camera_from_landmarks
from PolyPoseLib.registration.cameras.hypotheses import Hypothesis, doubts
from PolyPoseLib.registration.cameras.search import (
    DENSE,
    USUAL,
    SearchRange,
    find_cameras,
    perturbed,
    refine_cameras,
)
from PolyPoseLib.registration.fit.levels import Observation
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.backend import Backend

METHODS = ("auto", "dicom", "landmarks", "search", "learned")
"""Ways to a first camera; auto takes the first that applies: what is given, landmarks, DICOM, a regressor where
there is one, search.
"""

GIVEN_RADIUS = (5.0, 20.0)
"""Degrees and mm within which an extrinsic that a study gives as a guess is taken to be true."""

SEARCHED_RADIUS = (2.0, 10.0)
"""Degrees and mm within which a camera that was found by search is true, if the right one was found at all."""

LANDMARK_RADIUS = (12.0, 60.0)
"""Degrees and mm; landmarks that leave more open are not believed."""

LANDMARK_RMS_MM = 5.0
"""Reprojection error of landmarks beyond which they are not believed."""

LANDMARK_SHARE = 0.7
"""Of the landmarks that must agree: any four or five nearly fit some camera."""


LEARNED_COPIES = 12
"""Perturbed copies of a regressor's first answer that are refined beside it."""


class Regressor(Protocol):
    """Proposes cameras for X-rays of the patient it was trained on (PolyPoseLib.learned.regress).

    how: what it is, for people.
    """

    how: str

    def covers(self, xray: Xray) -> bool:
        """Whether it was trained for the directions in question."""
        ...

    def starts(self, xray: Xray) -> list[Camera]:
        """Cameras, likeliest first; raises InputError when it was not trained for the X-ray's standard view."""
        ...


def initial_camera(
    scene: Scene,
    xray: Xray,
    backend: Backend,
    monitor: Monitor,
    stage: str,
    method: str = "auto",
    model: Regressor | None = None,
) -> FoundCamera:
    """A camera for an X-ray whose camera is not known, from which stage A can start.

    Args:
        scene: the CT with its anchor.
        xray: with what is known about its camera.
        backend: renders.
        monitor: progress and cancelling.
        stage: name in the progress.
        method: one of METHODS; "dicom" searches within the radius of DICOM's guess.
        model: for "learned", which "auto" chooses only with a model.

    Raises:
        InputError: the method does not apply to this X-ray, or its landmarks are wrong.
        UntrustedResultError: no camera that was tried shows the anchor.

    """
    guessed = xray.extrinsic is not None and xray.initial_radius is not None
    if method not in METHODS:
        raise InputError(f"The method is {method!r}: give one of {', '.join(METHODS)}.")
    if method == "dicom" and not guessed:
        raise InputError(
            f'X-ray "{xray.name}": no guess follows from its DICOM attributes; choose another method.'
        )
    if method == "landmarks" and xray.landmarks is None:
        raise InputError(
            f'X-ray "{xray.name}": it has no "landmarks"; add four pairs or choose another method.'
        )
    if method == "learned" and model is None:
        raise InputError(
            f'X-ray "{xray.name}": "learned" needs a camera model: train one with python -m PolyPoseLib train and '
            'give it with --model or as the option "camera_model".'
        )
    if method == "auto" and xray.extrinsic is not None and not guessed:
        return FoundCamera(xray.extrinsic, True, GIVEN_RADIUS, "the guess given in the study")
    if method == "landmarks" or (method == "auto" and xray.landmarks is not None):
        return landmark_camera(scene, xray, backend, monitor, stage)
    if guessed and method != "search":
        return _around_dicom(scene, xray, backend, monitor, stage, fall_back=method == "auto")
    if method == "learned":
        return learned_camera(scene, xray, model, backend, monitor, stage)
    if method == "auto" and model is not None and model.covers(xray):
        return _learned_or_searched(scene, xray, model, backend, monitor, stage)
    return searched_camera(scene, xray, backend, monitor, stage)


def learned_camera(
    scene: Scene, xray: Xray, model: Regressor, backend: Backend, monitor: Monitor, stage: str
) -> FoundCamera:
    """A regressor's answers, refined and judged as those of a search are."""
    starts = model.starts(xray)
    rng = np.random.default_rng(0)
    starts += [perturbed(starts[0], scene.anchor_centre, rng) for _ in range(LEARNED_COPIES)]
    measured = Observation(xray.image, xray.mask, starts[0])
    found = refine_cameras(scene, measured, starts, backend, monitor, stage)
    return scored_camera(found, model.how, xray.name)


def _learned_or_searched(
    scene: Scene, xray: Xray, model: Regressor, backend: Backend, monitor: Monitor, stage: str
) -> FoundCamera:
    """The regressor's camera; when it is doubtful, perhaps a better one by search."""
    learned = learned_camera(scene, xray, model, backend, monitor, stage)
    if learned.sure:
        return learned
    searched = searched_camera(scene, xray, backend, monitor, stage)
    return searched if (searched.similarity or 0.0) > (learned.similarity or 0.0) else learned


def landmark_camera(scene: Scene, xray: Xray, backend: Backend, monitor: Monitor, stage: str) -> FoundCamera:
    """The camera that landmarks give; where they leave too much open, the best one within their radius."""
    landmarks = xray.landmarks
    detector = Camera(xray.intrinsics, np.eye(4), *xray.image.shape)
    name = f'X-ray "{xray.name}": "landmarks"'
    found = camera_from_landmarks(landmarks.points, landmarks.pixels, detector, name)
    used = f"{int(found.inliers.sum())} of {len(found.inliers)} landmarks, {found.rms_mm:.1f} mm off"
    said = landmark_problems(found)
    radius = tuple(max(own, least) for own, least in zip(found.radius, (1.0, 5.0), strict=True))
    if not said and (radius[0] > GIVEN_RADIUS[0] or radius[1] > GIVEN_RADIUS[1]):
        searched = SearchRange.around_camera(
            found.camera, scene.anchor_centre, radius, xray.source_to_detector_mm
        )
        measured = Observation(xray.image, xray.mask, found.camera)
        hypotheses = find_cameras(scene, measured, searched, backend, monitor, stage)
        return scored_camera(hypotheses, f"{used}, then searched", xray.name)
    warnings = (f'The camera of X-ray "{xray.name}" is doubtful: {"; ".join(said)}.',) if said else ()
    return FoundCamera(
        found.camera.extrinsic, not said, radius, used, (*warnings, *_outliers(found, xray.name))
    )


def searched_camera(scene: Scene, xray: Xray, backend: Backend, monitor: Monitor, stage: str) -> FoundCamera:
    """Search around the X-ray's standard view, or in all directions when it has none."""
    view = xray.standard_view
    searched = SearchRange.around_view(view, xray.source_to_detector_mm)
    how = f"searched around {view}" if view else "searched in all directions"
    start = Camera(xray.intrinsics, np.eye(4), *xray.image.shape)
    measured = Observation(xray.image, xray.mask, start)
    densities = (USUAL, DENSE) if view else (USUAL,)
    found = find_cameras(scene, measured, searched, backend, monitor, stage, densities)
    return scored_camera(found, how, xray.name)


def scored_camera(found: Sequence[Hypothesis], how: str, name: str) -> FoundCamera:
    """The best of several hypotheses with its doubts; raises UntrustedResultError when there is none."""
    if not found:
        raise UntrustedResultError(
            f'The camera of X-ray "{name}" was not found: no view that was tried shows the anchor; give its '
            '"extrinsic", "landmarks" or "standard_view".'
        )
    best = found[0]
    second = max((other.similarity for other in found[1:]), default=None)
    said = doubts(found)
    mend = 'look at it, or give its "landmarks" or "standard_view"'
    warnings = (f'The camera of X-ray "{name}" is doubtful: {"; ".join(said)}; {mend}.',) if said else ()
    runner = "" if second is None else f", the next best {second:.2f}"
    how = f"{how}: similarity {best.similarity:.2f}{runner}"
    return FoundCamera(
        best.camera.extrinsic, not said, SEARCHED_RADIUS, how, warnings, best.similarity, second
    )


def _around_dicom(
    scene: Scene, xray: Xray, backend: Backend, monitor: Monitor, stage: str, fall_back: bool
) -> FoundCamera:
    """The best camera within the radius of DICOM's guess; when it is doubtful, perhaps a better one elsewhere."""
    placed = xray.placed_at(scene.anchor_centre)
    start = Camera(xray.intrinsics, placed.extrinsic, *xray.image.shape)
    radius = xray.initial_radius or GIVEN_RADIUS
    searched = SearchRange.around_camera(start, scene.anchor_centre, radius, xray.source_to_detector_mm)
    measured = Observation(xray.image, xray.mask, start)
    found = find_cameras(scene, measured, searched, backend, monitor, stage)
    if fall_back and (not found or doubts(found)):
        elsewhere = searched_camera(scene, xray, backend, monitor, stage)
        if not found or (elsewhere.similarity or 0.0) > found[0].similarity:
            return elsewhere
    return scored_camera(found, "searched around the guess from DICOM", xray.name)


def landmark_problems(found: PnpSolution) -> list[str]:
    """What speaks against a camera from landmarks; each a clause for people."""
    said = []
    if found.rms_mm > LANDMARK_RMS_MM:
        said.append(f"its landmarks are {found.rms_mm:.1f} mm off")
    if found.radius[0] > LANDMARK_RADIUS[0] or found.radius[1] > LANDMARK_RADIUS[1]:
        said.append(
            f"its landmarks leave {found.radius[0]:.0f} degrees and {found.radius[1]:.0f} mm open; add some"
        )
    if found.inliers.mean() < LANDMARK_SHARE:
        said.append(f"{int((~found.inliers).sum())} of {len(found.inliers)} landmarks do not agree with it")
    if found.ambiguous_mm is not None and found.ambiguous_mm < 2 * found.rms_mm + 1:
        said.append("another view suits its landmarks as well; add one away from their plane")
    return said


def _outliers(found: PnpSolution, name: str) -> tuple[str, ...]:
    """One line that names the landmarks that were left out."""
    out = [f"{n} ({found.errors_mm[n]:.0f} mm)" for n in np.flatnonzero(~found.inliers)]
    return (f'X-ray "{name}": left out the landmarks {", ".join(out)}, counted from 0.',) if out else ()
