"""Stage A for all X-rays of a study: initial cameras, refined by the anchor, those of one rig together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from PolyPoseLib.data.view_names import label_of
from PolyPoseLib.data.xray import Xray, place_isocenter
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.registration.cameras.initial import Regressor, initial_camera
from PolyPoseLib.registration.cameras.multistart import RefinedCamera
from PolyPoseLib.registration.cameras.rig import find_rig_near
from PolyPoseLib.registration.cameras.rig_initial import initial_rig_cameras
from PolyPoseLib.registration.fit.levels import Level, Observation
from PolyPoseLib.registration.run import Run


class CameraRefiner(Protocol):
    """Refines one X-ray's camera by the anchor, as one method does it."""

    def __call__(self, run: Run, observation: Observation, source_to_detector_mm: float) -> RefinedCamera:
        """The camera near ``observation.camera``."""
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
    initial, refined : list[Observation]
        The X-rays with their cameras before and after stage A.
    free : list[int]
        Numbers of those that may move on in stage B.
    warnings : list[str]
        What is uncertain, one line each.

    """

    initial: list[Observation]
    refined: list[Observation]
    free: list[int]
    warnings: list[str]


def find_study_cameras(run: Run, xrays: Sequence[Xray], how: CameraStage) -> StudyCameras:
    """Stage A for every X-ray; cameras that are known, and those of a rig, do not move after it.

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
    placed = place_isocenter(xrays, run.scene.anchor_centre)
    found: dict[int, _Found] = {}
    warnings: list[str] = []
    for numbers in grouped_by_rig(placed):
        group = [placed[n] for n in numbers]
        here = run.named(f"camera {group[0].name or numbers[0] + 1}")
        with here.timed():
            cameras = [_find_one(here, group[0], how)] if len(group) == 1 else _find_rig(here, group, how)
        found |= zip(numbers, cameras, strict=True)
        warnings.extend(dict.fromkeys(line for each in cameras for line in each.warnings))
        for n in numbers:
            warnings.extend(_unreliable(placed[n].name or f"X-ray {n + 1}", found[n].refinement))
    ordered = [found[n] for n in range(len(placed))]
    free = [n for n, each in enumerate(ordered) if each.free]
    return StudyCameras(
        [each.initial for each in ordered], [each.refined for each in ordered], free, warnings
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
    camera stays; free: whether it may move on in stage B.
    """

    initial: Observation
    warnings: tuple[str, ...] = ()
    refinement: RefinedCamera | None = None
    free: bool = False

    @property
    def refined(self) -> Observation:
        """The X-ray after stage A."""
        return self.initial if self.refinement is None else self.initial.with_camera(self.refinement.camera)


def _find_one(run: Run, xray: Xray, how: CameraStage) -> _Found:
    """An X-ray by itself."""
    if xray.camera == "known" and xray.extrinsic is not None:
        camera = Camera(xray.intrinsics, xray.extrinsic, *xray.image.shape)
        return _Found(Observation(xray.image, xray.mask, camera))
    found = initial_camera(run, xray, model=how.regressor)
    observation = Observation(xray.image, xray.mask, found.camera_of(xray))
    if not how.refined:
        return _Found(observation, found.warnings)
    refinement = how.refine(run, observation, xray.source_to_detector_mm)
    return _Found(observation, found.warnings, refinement, free=True)


def _find_rig(run: Run, xrays: Sequence[Xray], how: CameraStage) -> list[_Found]:
    """The X-rays of one rig."""
    pairs = list(zip(xrays, initial_rig_cameras(run, xrays, model=how.regressor), strict=True))
    observations = [Observation(xray.image, xray.mask, each.camera_of(xray)) for xray, each in pairs]
    refinements: Sequence[RefinedCamera | None] = [None] * len(xrays)
    if how.refined and not any(xray.camera == "known" for xray in xrays):
        refinements = find_rig_near(run, observations, how.rig_levels)
    return [
        _Found(observation, found.warnings, refinement)
        for observation, (_, found), refinement in zip(observations, pairs, refinements, strict=True)
    ]


def _unreliable(name: str, refinement: RefinedCamera | None) -> list[str]:
    """A warning about a camera after stage A, if there is one."""
    if refinement is None or refinement.reliable:
        return []
    return [
        f"The camera of {label_of(name)} is uncertain: its rendering of the anchor does not match it well (local "
        f"correlation {refinement.similarity:.2f}); check it, or give a better initial camera, landmarks or a mask."
    ]
