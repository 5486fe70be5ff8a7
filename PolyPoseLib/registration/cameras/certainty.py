"""Which of the cameras found are certain: near where they were expected, or supported by their X-ray."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from PolyPoseLib.data.view_names import label_of, view_name
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.rigid import rotation_angle_deg
from PolyPoseLib.registration.cameras.coarse_search import compared_points
from PolyPoseLib.registration.cameras.hypotheses import CERTAIN_SIMILARITY, LEAST_SIMILARITY, score_camera
from PolyPoseLib.registration.cameras.initial import GIVEN_RADIUS
from PolyPoseLib.registration.fit.camera_prior import CameraPrior
from PolyPoseLib.registration.fit.levels import COMPARISON_LEVEL, Observation
from PolyPoseLib.registration.run import Run

SLACK = 1.25
"""Radii that a camera may be from its initial place without a word."""

LARGEST = 2.0
"""Radii beyond which nothing else makes up for it."""

STAGES_DEG, STAGES_DEPTH_MM = 1.5, 10.0
"""How far a camera may go between the camera stage and the fit of all bones without a word."""


def anchor_similarity(run: Run, observation: Observation) -> float:
    """Local correlation around the anchor with the camera as it is, in [-1, 1]."""
    return score_camera(run, observation, COMPARISON_LEVEL, compared_points(run.scene)).similarity


def expected_near(camera: Camera, within: tuple[float, float]) -> CameraPrior:
    """The prior around an initial camera that is said to be right within (degrees, mm), and at least GIVEN_RADIUS."""
    return CameraPrior(camera, *(max(pair) for pair in zip(within, GIVEN_RADIUS, strict=True)))


def departure(expected: CameraPrior, camera: Camera, point: np.ndarray) -> tuple[float, float]:
    """Degrees and mm between an expected camera and one that was found.

    Parameters
    ----------
    expected : CameraPrior
        The initial camera.
    camera : Camera
        The one found.
    point : (3,) ndarray
        LPS mm; how far it moved in the camera's axes gives the millimetres.

    Returns
    -------
    (float, float)
        Degrees and mm.

    """
    initial = expected.camera.extrinsic
    turn = camera.extrinsic[:3, :3] @ initial[:3, :3].T
    shift = (camera.extrinsic - initial) @ np.append(point, 1.0)
    return rotation_angle_deg(turn), float(np.linalg.norm(shift[:3]))


@dataclass(frozen=True)
class CameraVerdict:
    """What is to be said of the cameras that were found.

    Attributes
    ----------
    warnings, distrust : list of str
        One sentence each; those of ``distrust`` mean that the result must not be trusted.

    """

    warnings: list[str]
    distrust: list[str]


def judge_cameras(
    run: Run, names: Sequence[str], observations: Sequence[Observation], uncertain: Collection[int]
) -> CameraVerdict:
    """Compare cameras with where they were expected, and say which are not certain.

    Parameters
    ----------
    run : Run
        The patient and the renderer.
    names : sequence of str
        Of the X-rays.
    observations : sequence of Observation
        With the cameras of the result; those without expectation were not refined.
    uncertain : collection of int
        Numbers of the X-rays whose camera was uncertain when it was found.

    Returns
    -------
    CameraVerdict
        A camera far outside its radius is not trusted whatever it shows; one a little outside, or uncertain, only where
        the X-ray agrees with the anchor as no wrong camera's does; one that was not refined, where it agrees at all.

    """
    verdict = CameraVerdict([], [])
    centre = run.scene.anchor_centre
    for n, (name, observation) in enumerate(zip(names, observations, strict=True)):
        label, expected = label_of(name or view_name(n)), observation.expected
        radii, where = 0.0, ""
        if expected is not None:
            degrees, millimetres = departure(expected, observation.camera, centre)
            radii = max(degrees / expected.rotation_deg, millimetres / expected.translation_mm)
            shift, radius = (each / run.magnification for each in (millimetres, expected.translation_mm))
            where = (
                f"The camera of {label} ended {degrees:.0f} degrees and {shift:.0f} mm from its initial place, where "
                f"it was expected within {expected.rotation_deg:.0f} degrees and {radius:.0f} mm: check it in the "
                "overlay, or give a better initial camera, landmarks or a larger anchor."
            )
            if radii <= SLACK and n not in uncertain:
                continue
        similarity = anchor_similarity(run, observation)
        if radii > SLACK:
            trusted = similarity >= CERTAIN_SIMILARITY and radii <= LARGEST
            (verdict.warnings if trusted else verdict.distrust).append(where)
        elif expected is None and similarity < LEAST_SIMILARITY:
            verdict.distrust.append(
                f"The camera of {label}, which was not to be refined, does not show the anchor where the X-ray does "
                f"(local correlation {similarity:.2f}, at least {LEAST_SIMILARITY:g} is expected): check it, or "
                "whether the patient moved between the X-rays, or let it be refined."
            )
        elif n in uncertain and similarity < CERTAIN_SIMILARITY:
            verdict.distrust.append(
                f"The camera of {label} is uncertain (local correlation around the anchor {similarity:.2f}; "
                f"{CERTAIN_SIMILARITY:g} would settle it): check it in the overlay, or give a better initial camera or "
                "landmarks."
            )
    return verdict


def stage_warnings(
    run: Run, names: Sequence[str], first: Sequence[Observation], final: Sequence[Observation]
) -> list[str]:
    """Warnings of cameras that moved once bones and soft tissue were placed.

    Parameters
    ----------
    run : Run
        The patient.
    names : sequence of str
        Of the X-rays.
    first, final : sequence of Observation
        The X-rays with the cameras of the camera stage and of the result.

    Returns
    -------
    list of str
        One sentence a camera that turned about the anchor, or moved along the beam, by more than may pass.

    """
    warnings = []
    centre = run.scene.anchor_centre
    for n, (name, before, after) in enumerate(zip(names, first, final, strict=True)):
        turn = rotation_angle_deg(after.camera.extrinsic[:3, :3] @ before.camera.extrinsic[:3, :3].T)
        deeper = float(after.camera.depth(centre) - before.camera.depth(centre)) / run.magnification
        if turn > STAGES_DEG or abs(deeper) > STAGES_DEPTH_MM:
            warnings.append(
                f"The camera of {label_of(name or view_name(n))} changed by {turn:.1f} degrees and {deeper:+.0f} mm in "
                "depth once bones and soft tissue were placed: what lies over the anchor moved, or hides it; check the "
                "anchor in the overlay."
            )
    return warnings
