"""The whole registration: a study goes in, a result comes out. Methods and models are chosen here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from PolyPoseLib.baselines.published.method import find_camera_by_anchor, fit_structures_by_gmncc
from PolyPoseLib.data.options import Options
from PolyPoseLib.data.progress import CancelQuery, Monitor, ProgressCallback
from PolyPoseLib.data.result import CameraResult, Result, StructureResult, installed_versions
from PolyPoseLib.data.study import Study
from PolyPoseLib.io.machine_memory import require_memory
from PolyPoseLib.io.transforms import preview_writer
from PolyPoseLib.registration.bones.joint import fit_structures
from PolyPoseLib.registration.bones.rejection import inconsistency_warnings, inconsistent_structures
from PolyPoseLib.registration.cameras.initial import Regressor
from PolyPoseLib.registration.cameras.multistart import RefinedCamera, find_camera_near
from PolyPoseLib.registration.cameras.study import (
    CameraRefiner,
    CameraStage,
    StudyCameras,
    find_study_cameras,
)
from PolyPoseLib.registration.fit.levels import Observation
from PolyPoseLib.registration.fit.problem import JointResult
from PolyPoseLib.registration.fit.soft_tissue import SoftTissue
from PolyPoseLib.registration.memory import needed_memory
from PolyPoseLib.registration.outputs import TRANSFORM_MM, Warped, render_views, warp_study
from PolyPoseLib.registration.presets import PRESETS, Preset
from PolyPoseLib.registration.run import Run
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.registration.uncertainty.checks import (
    ViewScores,
    hidden_structures,
    reasons_for_distrust,
    score_views,
)
from PolyPoseLib.registration.uncertainty.covariance import PoseUncertainty, pose_uncertainties
from PolyPoseLib.registration.uncertainty.local_minima import widened_by_local_minima
from PolyPoseLib.rendering.select import resolve_device, select_backend


def register(
    study: Study, progress: ProgressCallback | None = None, cancel: CancelQuery | None = None
) -> Result:
    """Find every camera and the motion of every structure.

    Parameters
    ----------
    study : Study
        Valid by construction.
    progress : callable, optional
        Called with a Progress after every iteration.
    cancel : callable, optional
        Asked at every iteration; True stops the registration.

    Returns
    -------
    Result
        ``result.distrust`` says why it must not be trusted, when it must not.

    Raises
    ------
    InputError
        An option that cannot be met on this machine, or less memory than the study needs.
    CancelledError
        ``cancel`` returned True.

    """
    options = Options.from_dict(study.options)
    monitor = Monitor(progress, cancel)
    device = resolve_device(options.device)
    backend = select_backend(options.kernel, device, options.threads)
    require_memory(needed_memory(study, options), "The registration")
    preset = PRESETS[options.preset]
    preview = preview_writer(Path(options.preview)) if options.preview else None
    monitor.step("preparing", 0, 1, None)
    with monitor.timed("preparing"):
        soft_tissue = _soft_tissue(Scene(study.ct, study.structures, study.anchor), options, preset)
    run = Run(soft_tissue, backend, monitor, preview=preview)
    method = _method(study, options, preset, run)
    stage = CameraStage(
        method.refine_camera,
        preset.camera_levels or PRESETS["default"].camera_levels,
        camera_regressor(study, options.camera_model),
        options.refine_cameras,
    )
    cameras = find_study_cameras(run, study.xrays, stage)
    with monitor.timed("scoring"):
        before = score_views(run, cameras.initial, run.scene.rest_poses)
    with monitor.timed("bones"):
        joint = method.fit_bones(cameras)
    final = [o.with_camera(c) for o, c in zip(cameras.refined, joint.cameras, strict=True)]
    with monitor.timed("scoring"):
        after = score_views(run, final, joint.poses)
        inconsistent = inconsistent_structures(run, final, joint.poses)
    with monitor.timed("uncertainty"):
        uncertainties = _uncertainties(run, joint, inconsistent) if options.uncertainty else {}
    fitted = _Fitted(cameras, joint, before, after, inconsistent, uncertainties)
    return _result(study, options, run, fitted, device)


def camera_regressor(study: Study, path: str | Path | None) -> Regressor | None:
    """The study's camera regressor, or None; raises InputError when it is damaged or of another CT."""
    if path is None:
        return None
    from PolyPoseLib.io.camera_models import load_regressor  # torch is slow to import, and few need it

    return load_regressor(path, study.ct, study.structures, study.anchor)


@dataclass(frozen=True)
class _Method:
    """refine_camera: for X-rays by themselves; fit_bones: all structures together, from the cameras of stage A."""

    refine_camera: CameraRefiner
    fit_bones: Callable[[StudyCameras], JointResult]


def _method(study: Study, options: Options, preset: Preset, run: Run) -> _Method:
    """The published method for the preset "paper", or else the default one at the preset's levels."""
    if options.preset == "paper":

        def refine_published(
            run: Run, observation: Observation, source_to_detector_mm: float
        ) -> RefinedCamera:
            camera = find_camera_by_anchor(run, study.ct, observation)
            return RefinedCamera(camera, float("nan"), reliable=True)

        def fit_published(cameras: StudyCameras) -> JointResult:
            return fit_structures_by_gmncc(run, study.ct, cameras.refined, options.optimizer or "adam")

        return _Method(refine_published, fit_published)

    def refine(run: Run, observation: Observation, source_to_detector_mm: float) -> RefinedCamera:
        return find_camera_near(run, observation, preset.camera_levels, source_to_detector_mm)

    def fit(cameras: StudyCameras) -> JointResult:
        return fit_structures(run, cameras.refined, run.scene.rest_poses, cameras.free, preset.joint)

    return _Method(refine, fit)


def _soft_tissue(scene: Scene, options: Options, preset: Preset) -> SoftTissue:
    return SoftTissue(
        scene,
        options.weight_frame or preset.weight_frame,
        options.weights or preset.weights,
        options.epsilon or 0.1,
        options.rotation_reach_mm or preset.rotation_reach_mm,
    )


def _uncertainties(run: Run, joint: JointResult, inconsistent: list[int]) -> dict[int, PoseUncertainty]:
    """Of every pose; inconsistent ones are as uncertain as those that no X-ray shows."""
    of_all = pose_uncertainties(joint.problem, joint.state)
    consistent = {k: each for k, each in of_all.items() if k not in inconsistent}
    step = run.named("uncertainty").step
    widened = widened_by_local_minima(joint.problem, joint.state, consistent, step)
    return {k: PoseUncertainty.unseen() for k in of_all} | widened


@dataclass(frozen=True)
class _Fitted:
    """cameras: of stage A; joint: of stage B; before, after: scores at rest and of the result; inconsistent: structures
    that the X-rays contradict; uncertainties: by structure.
    """

    cameras: StudyCameras
    joint: JointResult
    before: ViewScores
    after: ViewScores
    inconsistent: list[int]
    uncertainties: dict[int, PoseUncertainty]


def _result(study: Study, options: Options, run: Run, fitted: _Fitted, device: str) -> Result:
    """Warp, render, and say what is known about the outcome."""
    monitor, joint = run.monitor, fitted.joint
    warped = _warped(study, options, run.named("warping"), joint)
    renderings = _renderings(run.named("rendering"), fitted)
    names = [xray.name for xray in study.xrays]
    similarities = fitted.after.similarities
    monitor.seconds["total"] = monitor.elapsed
    result = Result(
        structures=_structures(run.scene, fitted),
        anchor=study.anchor,
        cameras=[CameraResult(*each) for each in zip(joint.cameras, similarities, names, strict=True)],
        history=monitor.history,
        seconds=monitor.seconds,
        device=f"{device}, {run.backend.name}",
        versions=installed_versions(),
        warnings=_warnings(study, run.scene, fitted),
        warped_ct=warped.ct,
        warped_labels=warped.labels,
        transform=warped.transform,
        renderings_before=renderings[0],
        renderings_after=renderings[1],
        xray_images=[xray.image for xray in study.xrays],
        xray_masks=[xray.mask for xray in study.xrays],
        distrust=reasons_for_distrust(run.scene, names, fitted.before, fitted.after, joint.poses),
    )
    run.named("done").step(1, 1, float(np.mean(similarities)))
    return result


def _warped(study: Study, options: Options, run: Run, joint: JointResult) -> Warped:
    run.step(0, 1)
    with run.timed():
        spacing = options.transform_spacing_mm or TRANSFORM_MM
        unfold = PRESETS[options.preset].unfolded
        return warp_study(study, run.soft_tissue, joint.poses, spacing, options.composed, unfold)


def _renderings(run: Run, fitted: _Fitted) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Of every view, at rest with its initial camera and as registered."""
    run.step(0, 1)
    with run.timed():
        initial = [each.camera for each in fitted.cameras.initial]
        return (
            render_views(run, initial, run.scene.rest_poses),
            render_views(run, fitted.joint.cameras, fitted.joint.poses),
        )


def _warnings(study: Study, scene: Scene, fitted: _Fitted) -> list[str]:
    return [
        *study.warnings,
        *(f"{xray.name}: {warning}" for xray in study.xrays for warning in xray.warnings),
        *fitted.cameras.warnings,
        *hidden_structures(scene, fitted.after),
        *inconsistency_warnings(scene, fitted.inconsistent),
    ]


def _structures(scene: Scene, fitted: _Fitted) -> dict[str, StructureResult]:
    structures = {}
    for k, name in enumerate(scene.names):
        pose, centre = fitted.joint.poses[k], scene.centres[k]
        uncertainty = fitted.uncertainties.get(k)
        fields = None if uncertainty is None else uncertainty.to_dict(fitted.joint.cameras, pose, centre)
        structures[name] = StructureResult.from_pose(pose, centre, fields)
    return structures
