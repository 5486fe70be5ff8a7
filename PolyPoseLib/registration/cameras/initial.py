"""An initial camera for one X-ray, by the best method that applies, and how certain it is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from PolyPoseLib.data.found_camera import FoundCamera
from PolyPoseLib.data.landmarks import Landmarks
from PolyPoseLib.data.view_names import label_of
from PolyPoseLib.data.xray import Xray
from PolyPoseLib.errors import InputError, UntrustedResultError
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.pnp import PnpSolution, camera_from_landmarks
from PolyPoseLib.registration.cameras.hypotheses import Hypothesis, reasons_for_uncertainty
from PolyPoseLib.registration.cameras.search import (
    DENSE,
    USUAL,
    SearchRange,
    find_cameras,
    perturbed,
    refine_cameras,
)
from PolyPoseLib.registration.fit.levels import Observation
from PolyPoseLib.registration.run import Run

METHODS = ("auto", "dicom", "landmarks", "search", "learned")
"""How an initial camera is found; auto takes the first of CAMERA_METHODS that applies."""

GIVEN_RADIUS = (5.0, 20.0)
"""Degrees and mm within which the true camera is expected around an extrinsic that a study gives."""

SEARCHED_RADIUS = (2.0, 10.0)
"""Degrees and mm within which a camera that was found by search is true, if the right one was found at all."""

LANDMARK_RADIUS = (12.0, 60.0)
"""Degrees and mm; landmarks that leave more open make an uncertain camera."""

LANDMARK_RMS_MM = 5.0
"""Reprojection error of landmarks beyond which their camera is uncertain."""

LANDMARK_SHARE = 0.7
"""Of the landmarks that must agree: any four or five nearly fit some camera."""

LEAST_RADIUS = (1.0, 5.0)
"""Degrees and mm; no landmarks give a camera more exactly."""

LEARNED_COPIES = 12
"""Perturbed copies of a regressor's first answer that are refined beside it."""


class Regressor(Protocol):
    """Proposes cameras for X-rays of the patient it was trained on (PolyPoseLib.learned.regress)."""

    @property
    def how(self) -> str:
        """What it is, for people."""
        ...

    @property
    def warnings(self) -> tuple[str, ...]:
        """What to know about all cameras that it proposes."""
        ...

    def covers(self, xray: Xray) -> bool:
        """Whether it was trained for the directions in question."""
        ...

    def starts(self, xray: Xray) -> list[Camera]:
        """Cameras, likeliest first; raises InputError when it was not trained for the X-ray's standard view."""
        ...


@dataclass(frozen=True)
class CameraMethod:
    """One method that finds an initial camera.

    Parameters
    ----------
    name : str
        One of METHODS, or "given", which only "auto" takes.
    applies : callable
        Whether "auto" may take it, from the X-ray and the regressor.
    find : callable
        The camera, from the run, the X-ray and the regressor; raises InputError when something is missing.
    or_search : bool
        Whether "auto" also searches when the camera is uncertain, and takes the better one.

    """

    name: str
    applies: Callable[[Xray, Regressor | None], bool]
    find: Callable[[Run, Xray, Regressor | None], FoundCamera]
    or_search: bool = False


def initial_camera(run: Run, xray: Xray, method: str = "auto", model: Regressor | None = None) -> FoundCamera:
    """A camera for an X-ray whose camera is not known, from which stage A can start.

    Parameters
    ----------
    run : Run
        The patient, the renderer and the monitor.
    xray : Xray
        With what is known about its camera.
    method : str
        One of METHODS; "dicom" searches around the camera that follows from DICOM.
    model : Regressor, optional
        For "learned", which "auto" chooses only for directions that it was trained for.

    Returns
    -------
    FoundCamera
        With what speaks against it.

    Raises
    ------
    InputError
        The method does not apply to this X-ray, or its landmarks are wrong.
    UntrustedResultError
        No camera that was tried shows the anchor.

    """
    if method not in METHODS:
        raise InputError(f"The method is {method!r}: give one of {', '.join(METHODS)}.")
    if method != "auto":
        return next(each for each in CAMERA_METHODS if each.name == method).find(run, xray, model)
    chosen = next(each for each in CAMERA_METHODS if each.applies(xray, model))
    if chosen.or_search:
        return _found_or_searched(chosen, run, xray, model)
    return chosen.find(run, xray, model)


def _found_or_searched(method: CameraMethod, run: Run, xray: Xray, model: Regressor | None) -> FoundCamera:
    """The method's camera; when it is uncertain, perhaps a better one by search."""
    try:
        found = method.find(run, xray, model)
    except UntrustedResultError:
        return searched_camera(run, xray)
    if found.sure:
        return found
    searched = searched_camera(run, xray)
    return searched if (searched.similarity or 0.0) > (found.similarity or 0.0) else found


def learned_camera(run: Run, xray: Xray, model: Regressor) -> FoundCamera:
    """A regressor's answers, refined and scored as those of a search are."""
    starts = model.starts(xray)
    rng = np.random.default_rng(0)
    starts += [perturbed(starts[0], run.scene.anchor_centre, rng) for _ in range(LEARNED_COPIES)]
    observation = Observation(xray.image, xray.mask, starts[0])
    scored = scored_camera(refine_cameras(run, observation, starts), model.how, xray.name)
    return replace(scored, warnings=(*model.warnings, *scored.warnings))


def landmark_camera(run: Run, xray: Xray, landmarks: Landmarks) -> FoundCamera:
    """The camera that landmarks give; where they leave too much open, the best one within their radius."""
    detector = Camera(xray.intrinsics, np.eye(4), *xray.image.shape)
    name = f'{label_of(xray.name)}: "landmarks"'
    found = camera_from_landmarks(landmarks.points, landmarks.pixels, detector, name)
    how = f"{int(found.inliers.sum())} of {len(found.inliers)} landmarks, {found.rms_mm / run.magnification:.1f} mm off"
    problems = landmark_problems(found, run.magnification)
    degrees, millimetres = found.radius
    radius = max(degrees, LEAST_RADIUS[0]), max(millimetres, LEAST_RADIUS[1])
    if not problems and (radius[0] > GIVEN_RADIUS[0] or radius[1] > GIVEN_RADIUS[1]):
        return _searched_around(run, xray, found.camera, radius, f"{how}, then searched")
    warnings = (
        [f"The camera of {label_of(xray.name)} is uncertain: {'; '.join(problems)}."] if problems else []
    )
    warnings += _outliers(found, xray.name, run.magnification)
    return FoundCamera(found.camera.extrinsic, not problems, radius, how, tuple(warnings))


def searched_camera(run: Run, xray: Xray) -> FoundCamera:
    """Search around the X-ray's standard view, or in all directions when it has none."""
    view = xray.standard_view
    searched = SearchRange.around_view(view, xray.source_to_detector_mm)
    how = f"searched around {view}" if view else "searched in all directions"
    start = Camera(xray.intrinsics, np.eye(4), *xray.image.shape)
    observation = Observation(xray.image, xray.mask, start)
    densities = (USUAL, DENSE) if view else (USUAL,)
    return scored_camera(find_cameras(run, observation, searched, densities), how, xray.name)


def scored_camera(found: Sequence[Hypothesis], how: str, name: str) -> FoundCamera:
    """The best of several hypotheses, best first, with what speaks against it.

    Parameters
    ----------
    found : sequence of Hypothesis
        Best first.
    how : str
        How they were found, for people.
    name : str
        Of the X-ray.

    Returns
    -------
    FoundCamera
        Certain when nothing speaks against it.

    Raises
    ------
    UntrustedResultError
        When there is no hypothesis.

    """
    if not found:
        raise UntrustedResultError(
            f"The camera of {label_of(name)} was not found: no view that was tried shows the anchor; give its "
            '"extrinsic", "landmarks" or "standard_view".'
        )
    best = found[0]
    second = max((other.similarity for other in found[1:]), default=None)
    reasons = reasons_for_uncertainty(found)
    fix = 'check it, or give its "landmarks" or "standard_view"'
    warnings = (
        (f"The camera of {label_of(name)} is uncertain: {'; '.join(reasons)}; {fix}.",) if reasons else ()
    )
    runner_up = "" if second is None else f", the next best {second:.2f}"
    how = f"{how}: similarity {best.similarity:.2f}{runner_up}"
    return FoundCamera(
        best.camera.extrinsic, not reasons, SEARCHED_RADIUS, how, warnings, best.similarity, second
    )


def landmark_problems(found: PnpSolution, magnification: float = 1.0) -> list[str]:
    """What speaks against a camera from landmarks of a scene so magnified; each a clause for people."""
    problems = []
    if found.rms_mm > LANDMARK_RMS_MM:
        problems.append(f"its landmarks are {found.rms_mm / magnification:.1f} mm off")
    if found.radius[0] > LANDMARK_RADIUS[0] or found.radius[1] > LANDMARK_RADIUS[1]:
        problems.append(
            f"its landmarks leave {found.radius[0]:.0f} degrees and {found.radius[1] / magnification:.0f} mm open; "
            "add some"
        )
    if found.inliers.mean() < LANDMARK_SHARE:
        problems.append(
            f"{int((~found.inliers).sum())} of {len(found.inliers)} landmarks do not agree with it"
        )
    if found.ambiguous_mm is not None and found.ambiguous_mm < 2 * found.rms_mm + 1:
        problems.append("another view fits its landmarks as well; add one away from their plane")
    return problems


def _outliers(found: PnpSolution, name: str, magnification: float) -> list[str]:
    """One line that names the landmarks that were left out."""
    out = [f"{n} ({found.errors_mm[n] / magnification:.0f} mm)" for n in np.flatnonzero(~found.inliers)]
    return [f"{label_of(name)}: left out the landmarks {', '.join(out)}, counted from 0."] if out else []


def _searched_around(
    run: Run, xray: Xray, camera: Camera, radius: tuple[float, float], how: str
) -> FoundCamera:
    """The best camera within a radius (degrees, mm) of another."""
    centre = run.scene.anchor_centre
    searched = SearchRange.around_camera(camera, centre, radius, xray.source_to_detector_mm)
    found = find_cameras(run, Observation(xray.image, xray.mask, camera), searched)
    return scored_camera(found, how, xray.name)


def _given(run: Run, xray: Xray, model: Regressor | None) -> FoundCamera:
    """The extrinsic of the study."""
    if xray.extrinsic is None:
        raise InputError(f'{label_of(xray.name)}: it has no "extrinsic"; give one or choose another method.')
    return FoundCamera(xray.extrinsic, True, GIVEN_RADIUS, "the initial camera given in the study")


def _from_landmarks(run: Run, xray: Xray, model: Regressor | None) -> FoundCamera:
    if xray.landmarks is None:
        raise InputError(
            f'{label_of(xray.name)}: it has no "landmarks"; add four pairs or choose another method.'
        )
    return landmark_camera(run, xray, xray.landmarks)


def _around_dicom(run: Run, xray: Xray, model: Regressor | None) -> FoundCamera:
    """The best camera within the radius of the one that follows from DICOM."""
    placed = xray.placed_at(run.scene.anchor_centre)
    if placed.extrinsic is None or placed.initial_radius is None:
        raise InputError(
            f"{label_of(xray.name)}: no camera follows from its DICOM attributes; choose another method."
        )
    start = Camera(xray.intrinsics, placed.extrinsic, *xray.image.shape)
    return _searched_around(run, xray, start, placed.initial_radius, "searched around the camera from DICOM")


def _learned(run: Run, xray: Xray, model: Regressor | None) -> FoundCamera:
    if model is None:
        raise InputError(
            f'{label_of(xray.name)}: "learned" needs a camera model: train one with python -m PolyPoseLib train and '
            'give it with --model or as the option "camera_model".'
        )
    return learned_camera(run, xray, model)


def _searched(run: Run, xray: Xray, model: Regressor | None) -> FoundCamera:
    return searched_camera(run, xray)


def _has_dicom_camera(xray: Xray) -> bool:
    return xray.extrinsic is not None and xray.initial_radius is not None


CAMERA_METHODS = (
    CameraMethod("given", lambda xray, _: xray.extrinsic is not None and not _has_dicom_camera(xray), _given),
    CameraMethod("landmarks", lambda xray, _: xray.landmarks is not None, _from_landmarks),
    CameraMethod("dicom", lambda xray, _: _has_dicom_camera(xray), _around_dicom, or_search=True),
    CameraMethod(
        "learned", lambda xray, model: model is not None and model.covers(xray), _learned, or_search=True
    ),
    CameraMethod("search", lambda *_: True, _searched),
)
"""In the order in which "auto" tries them."""
