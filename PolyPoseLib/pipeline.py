"""The whole registration: a study goes in, a result comes out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from PolyPoseLib.baselines.published.method import find_camera_by_anchor, fit_structures_by_gmncc
from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.options import Options
from PolyPoseLib.data.progress import CancelQuery, Monitor, ProgressCallback
from PolyPoseLib.data.result import CameraResult, Result, StructureResult, installed_versions
from PolyPoseLib.data.study import Study
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.io.transforms import preview_writer
from PolyPoseLib.registration.bones.joint import fit_structures
from PolyPoseLib.registration.bones.rejection import inconsistency_warnings, inconsistent_structures
from PolyPoseLib.registration.cameras.initial import Regressor
from PolyPoseLib.registration.cameras.multistart import RefinedCamera, find_camera_near
from PolyPoseLib.registration.cameras.study import CameraRefiner, StudyCameras, find_study_cameras
from PolyPoseLib.registration.fit.levels import Observation
from PolyPoseLib.registration.fit.problem import JointResult
from PolyPoseLib.registration.fit.soft_tissue import SoftTissue
from PolyPoseLib.registration.outputs import TRANSFORM_MM, render_views, warp_study
from PolyPoseLib.registration.presets import PRESETS, Preset
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.registration.uncertainty.checks import (
    ViewScores,
    hidden_structures,
    judge,
    reasons_for_distrust,
)
from PolyPoseLib.registration.uncertainty.covariance import PoseUncertainty, pose_uncertainties
from PolyPoseLib.registration.uncertainty.local_minima import widened_by_local_minima
from PolyPoseLib.rendering.backend import Backend
from PolyPoseLib.rendering.select import resolve_device, select_backend


def register(
    study: Study, progress: ProgressCallback | None = None, cancel: CancelQuery | None = None
) -> Result:
    """Find every camera and the motion of every structure.

    Args:
        study: valid by construction.
        progress: called after every iteration.
        cancel: asked at every iteration.

    Returns:
        The result; ``result.distrust`` says why it must not be trusted, when it must not.

    Raises:
        InputError: an option that cannot be met on this machine.
        CancelledError: ``cancel`` returned True.

    """
    options = Options.from_dict(study.options)
    monitor = Monitor(progress, cancel)
    device = resolve_device(options.device)
    backend = select_backend(options.kernel, device, options.threads)
    preset = PRESETS[options.preset]
    preview = preview_writer(Path(options.preview)) if options.preview else None
    monitor.step("preparing", 0, 1, None)
    with monitor.timed("preparing"):
        scene = Scene(study.ct, study.structures, study.anchor)
        soft = _soft_tissue(scene, options, preset)
    regressor = camera_regressor(study, options.camera_model)
    refine = _camera_refiner(study, scene, options, preset, backend, monitor)
    found = find_study_cameras(study, scene, preset, options, backend, monitor, refine, regressor)
    rest = np.stack([np.eye(4)] * len(scene.names))
    with monitor.timed("judging"):
        before = judge(scene, soft, found.initial, rest, backend)
    with monitor.timed("bones"):
        joint = _fit_bones(study, scene, soft, found, rest, options, preset, backend, monitor, preview)
    measured = [m.with_camera(c) for m, c in zip(found.refined, joint.cameras, strict=True)]
    with monitor.timed("judging"):
        after = judge(scene, soft, measured, joint.poses, backend)
        inconsistent = inconsistent_structures(scene, soft, measured, joint.poses, backend)
    with monitor.timed("uncertainty"):
        doubts = _doubts(joint, inconsistent, monitor) if options.uncertainty else {}
    verdict = _Verdict(before, after, inconsistent, doubts)
    return _assemble(study, options, scene, soft, found, joint, verdict, rest, device, backend, monitor)


def camera_regressor(study: Study, path: str | Path | None) -> Regressor | None:
    """The study's camera regressor, or None; raises InputError when it is damaged or of another CT."""
    if path is None:
        return None
    from PolyPoseLib.io.camera_models import load_regressor  # torch is slow to import, and few need it

    return load_regressor(path, study.ct, study.structures, study.anchor)


def _camera_refiner(
    study: Study, scene: Scene, options: Options, preset: Preset, backend: Backend, monitor: Monitor
) -> CameraRefiner:
    """The method by which the preset refines single cameras."""

    def published(measured: Observation, source_to_detector_mm: float, stage: str) -> RefinedCamera:
        camera = find_camera_by_anchor(study.ct, scene, measured, backend, monitor, stage)
        return RefinedCamera(camera, float("nan"), sure=True)

    def default(measured: Observation, source_to_detector_mm: float, stage: str) -> RefinedCamera:
        levels = preset.camera_levels
        return find_camera_near(scene, measured, levels, source_to_detector_mm, backend, monitor, stage)

    return published if options.preset == "paper" else default


@dataclass(frozen=True)
class _Verdict:
    """before, after: how well X-rays are explained; disbelieved: structures they contradict; doubts: of poses."""

    before: ViewScores
    after: ViewScores
    inconsistent: list[int]
    doubts: dict[int, PoseUncertainty]


def _soft_tissue(scene: Scene, options: Options, preset: Preset) -> SoftTissue:
    return SoftTissue(
        scene,
        options.weight_frame or preset.weight_frame,
        options.weights or preset.weights,
        options.epsilon or 0.1,
        options.rotation_reach_mm or preset.rotation_reach_mm,
    )


def _fit_bones(
    study: Study,
    scene: Scene,
    soft: SoftTissue,
    found: StudyCameras,
    rest: np.ndarray,
    options: Options,
    preset: Preset,
    backend: Backend,
    monitor: Monitor,
    preview: Callable[[DisplacementField], str | None] | None,
) -> JointResult:
    if options.preset == "paper":
        optimizer = options.optimizer or "adam"
        return fit_structures_by_gmncc(
            study.ct, scene, soft, found.refined, optimizer, backend, monitor, preview
        )
    return fit_structures(
        scene, soft, found.refined, rest, found.free, preset.joint, backend, monitor, preview
    )


def _doubts(joint: JointResult, inconsistent: Sequence[int], monitor: Monitor) -> dict[int, PoseUncertainty]:
    doubts = pose_uncertainties(joint.problem, joint.state)
    believed = {k: doubt for k, doubt in doubts.items() if k not in inconsistent}
    return {k: PoseUncertainty.unseen() for k in doubts} | widened_by_local_minima(
        joint.problem, joint.state, believed, lambda n, total: monitor.step("uncertainty", n, total, None)
    )


def _assemble(
    study: Study,
    options: Options,
    scene: Scene,
    soft: SoftTissue,
    found: StudyCameras,
    joint: JointResult,
    verdict: _Verdict,
    rest: np.ndarray,
    device: str,
    backend: Backend,
    monitor: Monitor,
) -> Result:
    monitor.step("warping", 0, 1, None)
    with monitor.timed("warping"):
        spacing = options.transform_spacing_mm or TRANSFORM_MM
        unfolded = PRESETS[options.preset].unfolded
        warped = warp_study(study, soft, joint.poses, spacing, options.composed, unfolded)
    monitor.step("rendering", 0, 1, None)
    with monitor.timed("rendering"):
        first = render_views(scene, soft, [m.camera for m in found.initial], rest, backend)
        last = render_views(scene, soft, joint.cameras, joint.poses, backend)
    names = [xray.name or f"X-ray {n + 1}" for n, xray in enumerate(study.xrays)]
    cameras = [
        CameraResult(camera, similarity, name)
        for camera, similarity, name in zip(joint.cameras, verdict.after.similarities, names, strict=True)
    ]
    monitor.seconds["total"] = monitor.elapsed
    result = Result(
        structures=_structures(scene, joint, verdict.doubts),
        anchor=study.anchor,
        cameras=cameras,
        history=monitor.history,
        seconds=monitor.seconds,
        device=f"{device}, {backend.name}",
        versions=installed_versions(),
        warnings=[
            *study.warnings,
            *_xray_warnings(study),
            *found.warnings,
            *hidden_structures(scene, verdict.after),
            *inconsistency_warnings(scene, verdict.inconsistent),
        ],
        warped_ct=warped.ct,
        warped_labels=warped.labels,
        transform=warped.transform,
        renderings_before=first,
        renderings_after=last,
        xray_images=[xray.image for xray in study.xrays],
        xray_masks=[xray.mask for xray in study.xrays],
        distrust=reasons_for_distrust(scene, names, verdict.before, verdict.after, joint.poses),
    )
    monitor.step("done", 1, 1, float(np.mean(verdict.after.similarities)))
    return result


def _xray_warnings(study: Study) -> list[str]:
    return [f"{xray.name}: {warning}" for xray in study.xrays for warning in xray.warnings]


def _structures(
    scene: Scene, joint: JointResult, doubts: dict[int, PoseUncertainty]
) -> dict[str, StructureResult]:
    cameras: Sequence[Camera] = joint.cameras
    structures = {}
    for k, name in enumerate(scene.names):
        pose, centre = joint.poses[k], scene.centres[k]
        doubt = doubts[k].to_dict(list(cameras), pose, centre) if k in doubts else None
        structures[name] = StructureResult.from_pose(pose, centre, doubt)
    return structures
