"""Stage A for all X-rays of a study: initial cameras, refined by the anchor, those of one rig together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Protocol

from PolyPoseLib.data.found_camera import FoundCamera
from PolyPoseLib.data.view_names import label_of, view_name
from PolyPoseLib.data.xray import Xray, place_isocenter
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.registration.cameras.certainty import anchor_similarity, expected_near
from PolyPoseLib.registration.cameras.initial import Regressor, initial_camera
from PolyPoseLib.registration.cameras.multistart import RefinedCamera
from PolyPoseLib.registration.cameras.polarity import found_in_better_polarity
from PolyPoseLib.registration.cameras.rig import find_rig_near
from PolyPoseLib.registration.cameras.rig_initial import initial_rig_cameras
from PolyPoseLib.registration.fit.clipped import without_clipped
from PolyPoseLib.registration.fit.foreign_objects import REFINED_REACH_MM, without_foreign_objects
from PolyPoseLib.registration.fit.levels import Level, Observation
from PolyPoseLib.registration.run import Run


class CameraRefiner(Protocol):
    """Refines one X-ray's camera by the anchor, as one method does it."""

    def __call__(
        self, run: Run, observation: Observation, source_to_detector_mm: float, search: bool
    ) -> RefinedCamera:
        """The camera near ``observation.camera``; search: whether to search farther off for one that matches."""
        ...


@dataclass(frozen=True)
class CameraStage:
    """How stage A finds cameras.

    Parameters
    ----------
    refine : CameraRefiner
        For X-rays by themselves.
    rig_levels : sequence of Level
        Coarse to fine, for X-rays of one rig.
    regressor : Regressor, optional
        Proposes initial cameras.
    refined : bool
        Whether cameras that are not known are refined, or stay where they were found.

    """

    refine: CameraRefiner
    rig_levels: Sequence[Level]
    regressor: Regressor | None = None
    refined: bool = True


@dataclass(frozen=True)
class StudyCameras:
    """What stage A found, in the order of the X-rays.

    Attributes
    ----------
    xrays : list[Xray]
        As they were used: inverted where only so they match the CT.
    initial, refined : list[Observation]
        The X-rays with their cameras before and after stage A.
    free : list[list[int]]
        Numbers of those that may move on in stage B, each by itself or those of one rig as one.
    warnings : list[str]
        What is uncertain, one line each.
    uncertain : set[int]
        Numbers of those whose camera is.

    """

    xrays: list[Xray]
    initial: list[Observation]
    refined: list[Observation]
    free: list[list[int]]
    warnings: list[str]
    uncertain: set[int]


def find_study_cameras(run: Run, xrays: Sequence[Xray], how: CameraStage) -> StudyCameras:
    """Stage A for every X-ray; cameras that are known do not move after it.

    Parameters
    ----------
    run : Run
        The patient, the renderer and the monitor.
    xrays : sequence of Xray
        Of the study.
    how : CameraStage
        How cameras are found.

    Returns
    -------
    StudyCameras
        In the order of the X-rays.

    Raises
    ------
    InputError
        Landmarks are wrong, or the learned model does not fit an X-ray.
    UntrustedResultError
        No camera that was tried shows the anchor.

    """
    placed = list(place_isocenter(xrays, run.scene.anchor_centre))
    found: dict[int, _Found] = {}
    warnings: list[str] = []
    for numbers in grouped_by_rig(placed):
        group = [placed[n] for n in numbers]
        here = run.named(f"camera {group[0].name or numbers[0] + 1}")
        with here.timed():
            used, cameras = found_in_better_polarity(group, partial(_find, here, how))
        found |= zip(numbers, cameras, strict=True)
        for n, xray in zip(numbers, used, strict=True):
            placed[n] = xray
        warnings.extend(dict.fromkeys(line for each in cameras for line in each.warnings))
        for n in numbers:
            name = placed[n].name or view_name(n)
            warnings.extend(_unreliable(name, found[n].refinement))
    ordered = [found[n] for n in range(len(placed))]
    refined = [without_foreign_objects(run, each.refined, REFINED_REACH_MM) for each in ordered]
    free = [numbers for numbers in grouped_by_rig(placed) if found[numbers[0]].free]
    uncertain = {n for n, each in enumerate(ordered) if not each.certain}
    return StudyCameras(
        placed,
        [each.initial for each in ordered],
        refined,
        free,
        warnings,
        uncertain,
    )


def grouped_by_rig(xrays: Sequence[Xray]) -> list[list[int]]:
    """Numbers of the X-rays, those of one rig together, in the order of their first."""
    groups: dict[object, list[int]] = {}
    for n, xray in enumerate(xrays):
        groups.setdefault(n if xray.rig is None else xray.rig.name, []).append(n)
    return list(groups.values())


@dataclass(frozen=True)
class _Found:
    """initial: the X-ray before stage A; warnings: about its initial camera; refinement: by stage A, None where the
    camera stays; free: whether it may move on in stage B; similarity: around the anchor, NaN where not computed; sure:
    whether the initial camera was.
    """

    initial: Observation
    warnings: tuple[str, ...] = ()
    refinement: RefinedCamera | None = None
    free: bool = False
    similarity: float = float("nan")
    sure: bool = True

    @property
    def certain(self) -> bool:
        """Whether nothing spoke against the camera so far."""
        return self.sure and (self.refinement is None or self.refinement.reliable)

    @property
    def refined(self) -> Observation:
        """The X-ray after stage A."""
        return self.initial if self.refinement is None else self.initial.with_camera(self.refinement.camera)


def _find(run: Run, how: CameraStage, xrays: Sequence[Xray], search: bool) -> list[_Found]:
    """An X-ray by itself, or those of one rig; search: whether to search far off for a camera that matches."""
    return [_find_one(run, how, xrays[0], search)] if len(xrays) == 1 else _find_rig(run, how, xrays)


def _find_one(run: Run, how: CameraStage, xray: Xray, search: bool) -> _Found:
    """An X-ray by itself."""
    if xray.camera == "known" and xray.extrinsic is not None:
        camera = Camera(xray.intrinsics, xray.extrinsic, *xray.image.shape)
        observation = _usable(run, Observation(xray.image, xray.mask, camera))
        return _Found(observation, similarity=anchor_similarity(run, observation))
    found = initial_camera(run, xray, model=how.regressor)
    observation = _observed(run, xray, found, how.refined)
    if not how.refined:
        return _Found(observation, found.warnings, sure=found.sure)
    refinement = how.refine(run, observation, xray.source_to_detector_mm, search)
    return _Found(
        observation, found.warnings, refinement, free=True, similarity=refinement.similarity, sure=found.sure
    )


def _find_rig(run: Run, how: CameraStage, xrays: Sequence[Xray]) -> list[_Found]:
    """The X-rays of one rig."""
    pairs = list(zip(xrays, initial_rig_cameras(run, xrays, model=how.regressor), strict=True))
    refined = how.refined and not any(xray.camera == "known" for xray in xrays)
    observations = [_observed(run, xray, each, refined) for xray, each in pairs]
    refinements: Sequence[RefinedCamera | None] = [None] * len(xrays)
    if refined:
        refinements = find_rig_near(run, observations, how.rig_levels)
    return [
        _Found(
            observation,
            found.warnings,
            refinement,
            free=refinement is not None,
            sure=found.sure,
            similarity=anchor_similarity(run, observation) if refinement is None else refinement.similarity,
        )
        for observation, (_, found), refinement in zip(observations, pairs, refinements, strict=True)
    ]


def _observed(run: Run, xray: Xray, found: FoundCamera, refined: bool) -> Observation:
    """The X-ray with its initial camera, expected near it where it will be refined, without foreign objects."""
    camera = found.camera_of(xray)
    expected = expected_near(camera, found.within) if refined else None
    observation = Observation(xray.image, xray.mask, camera, expected)
    return _usable(run, observation)


def _usable(run: Run, observation: Observation) -> Observation:
    """The X-ray without foreign objects and clipped pixels."""
    return without_clipped(run, without_foreign_objects(run, observation))


def _unreliable(name: str, refinement: RefinedCamera | None) -> list[str]:
    """A warning about a camera after stage A, if there is one."""
    if refinement is None or refinement.reliable:
        return []
    return [
        f"The camera of {label_of(name)} is uncertain: its rendering of the anchor does not match it well (local "
        f"correlation {refinement.similarity:.2f}); check it, or give a better initial camera, landmarks or a mask."
    ]
