"""Stage A for all X-rays of a study: first cameras, refined by the anchor, those of one rig together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from PolyPoseLib.data.options import Options
from PolyPoseLib.data.progress import Monitor
from PolyPoseLib.data.study import Study
from PolyPoseLib.data.xray import Xray, place_isocenter
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.registration.cameras.initial import Regressor, initial_camera
from PolyPoseLib.registration.cameras.multistart import RefinedCamera
from PolyPoseLib.registration.cameras.rig import find_rig_near
from PolyPoseLib.registration.cameras.rig_initial import initial_rig_cameras
from PolyPoseLib.registration.fit.levels import Observation
from PolyPoseLib.registration.presets import PRESETS, Preset
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.backend import Backend


@dataclass(frozen=True)
class StudyCameras:
    """initial, refined: the X-rays with their cameras before and after stage A; free: numbers of those that may move
    on in stage B; warnings: what is doubtful.
    """

    initial: list[Observation]
    refined: list[Observation]
    free: list[int]
    warnings: list[str]


class CameraRefiner(Protocol):
    """Refines one X-ray's camera by the anchor, as one method does it."""

    def __call__(self, measured: Observation, source_to_detector_mm: float, stage: str) -> RefinedCamera:
        """The camera near ``measured.camera``; stage: name in the progress."""
        ...


def find_study_cameras(
    study: Study,
    scene: Scene,
    preset: Preset,
    options: Options,
    backend: Backend,
    monitor: Monitor,
    refine: CameraRefiner,
    regressor: Regressor | None,
) -> StudyCameras:
    """Stage A for every X-ray; cameras that are known, and those of a rig, do not move after it.

    refine: the method for X-rays by themselves; regressor: proposes initial cameras, or None.
    """
    xrays = place_isocenter(study.xrays, scene.anchor_centre)
    finder = _Finder(len(study.xrays), scene, preset, options, backend, monitor, refine, regressor)
    for numbers in grouped_by_rig(xrays):
        group = [xrays[n] for n in numbers]
        stage = f"camera {group[0].name or numbers[0] + 1}"
        with monitor.timed(stage):
            if len(group) == 1:
                finder.find_one(numbers[0], group[0], stage)
            else:
                finder.find_rig(numbers, group, stage)
    return finder.cameras


def grouped_by_rig(xrays: Sequence[Xray]) -> list[list[int]]:
    """Numbers of the X-rays, those of one rig together, in the order of their first."""
    groups: dict[object, list[int]] = {}
    for n, xray in enumerate(xrays):
        groups.setdefault(n if xray.rig is None else xray.rig.name, []).append(n)
    return list(groups.values())


class _Finder:
    """Finds cameras and collects them in the order of the X-rays."""

    def __init__(
        self,
        count: int,
        scene: Scene,
        preset: Preset,
        options: Options,
        backend: Backend,
        monitor: Monitor,
        refine: CameraRefiner,
        regressor: Regressor | None,
    ) -> None:
        self.scene, self.options = scene, options
        self.levels = preset.camera_levels or PRESETS["default"].camera_levels
        self.refine, self.model = refine, regressor
        self.backend, self.monitor = backend, monitor
        self.initial: list[Observation | None] = [None] * count
        self.refined: list[Observation | None] = [None] * count
        self.free: list[int] = []
        self.warnings: list[str] = []

    @property
    def cameras(self) -> StudyCameras:
        """What was found, once it is complete."""
        initial = [m for m in self.initial if m is not None]
        refined = [m for m in self.refined if m is not None]
        return StudyCameras(initial, refined, sorted(self.free), self.warnings)

    def find_one(self, n: int, xray: Xray, stage: str) -> None:
        """An X-ray by itself."""
        if xray.camera == "known":
            self._keep(n, xray, Camera(xray.intrinsics, xray.extrinsic, *xray.image.shape))
            return
        guess = initial_camera(self.scene, xray, self.backend, self.monitor, stage, model=self.model)
        first = self._keep(n, xray, guess.camera_of(xray))
        self.warnings.extend(guess.warnings)
        if not self.options.refine_cameras:
            return
        self.free.append(n)
        near = self.refine(first, xray.source_to_detector_mm, stage)
        self.warnings.extend([] if near.sure else [_doubt(xray.name or f"X-ray {n + 1}", near)])
        self.refined[n] = first.with_camera(near.camera)

    def find_rig(self, numbers: Sequence[int], xrays: Sequence[Xray], stage: str) -> None:
        """The X-rays of one rig."""
        guesses = initial_rig_cameras(self.scene, xrays, self.backend, self.monitor, stage, model=self.model)
        placed = [
            self._keep(n, xray, guess.camera_of(xray))
            for n, xray, guess in zip(numbers, xrays, guesses, strict=True)
        ]
        self.warnings.extend(dict.fromkeys(line for guess in guesses for line in guess.warnings))
        if any(xray.camera == "known" for xray in xrays) or not self.options.refine_cameras:
            return
        refined = find_rig_near(self.scene, placed, self.levels, self.backend, self.monitor, stage)
        for n, xray, first, found in zip(numbers, xrays, placed, refined, strict=True):
            self.refined[n] = first.with_camera(found.camera)
            self.warnings.extend([] if found.sure else [_doubt(xray.name or f"X-ray {n + 1}", found)])

    def _keep(self, n: int, xray: Xray, camera: Camera) -> Observation:
        """The X-ray with its first camera, which is the refined one until a better is found."""
        measured = Observation(xray.image, xray.mask, camera)
        self.initial[n] = self.refined[n] = measured
        return measured


def _doubt(name: str, near: RefinedCamera) -> str:
    return (
        f'The camera of X-ray "{name}" is doubtful: its rendering of the anchor explains it badly (local correlation '
        f"{near.similarity:.2f}); look at it, or give a better guess, landmarks or a mask."
    )
