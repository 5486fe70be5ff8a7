"""The whole registration: a study goes in, a result comes out. Methods and models are chosen here."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.baselines.published.method import find_camera_by_anchor, fit_structures_by_gmncc
from PolyPoseLib.data.options import Options
from PolyPoseLib.data.paper_options import PUBLISHED
from PolyPoseLib.data.progress import CancelQuery, Monitor, ProgressCallback
from PolyPoseLib.data.result import CameraResult, Result, StructureResult, installed_versions
from PolyPoseLib.data.segmentation import labels_present
from PolyPoseLib.data.study import Study
from PolyPoseLib.data.view_names import view_name
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.io.machine_memory import require_memory
from PolyPoseLib.io.transforms import preview_writer
from PolyPoseLib.registration.bones.joint import StructureFit, fit_structures
from PolyPoseLib.registration.bones.parts import agreement_by_parts
from PolyPoseLib.registration.bones.rejection import inconsistency_warnings
from PolyPoseLib.registration.bones.rows import breaks
from PolyPoseLib.registration.bones.visibility import structure_visibility
from PolyPoseLib.registration.cameras.certainty import CameraVerdict, judge_cameras, stage_warnings
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
from PolyPoseLib.registration.magnification import (
    at_true_size,
    field_at_true_size,
    magnification_of,
    magnified,
)
from PolyPoseLib.registration.memory import needed_memory
from PolyPoseLib.registration.outputs import (
    TRANSFORM_MM,
    Warped,
    render_views,
    warp_study,
    warped_source,
)
from PolyPoseLib.registration.presets import PRESETS, Preset, weighting_of
from PolyPoseLib.registration.run import Preview, Run
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.registration.uncertainty.checks import (
    ViewScores,
    left_out_warnings,
    reasons_for_distrust,
    score_views,
)
from PolyPoseLib.registration.uncertainty.covariance import joint_covariance
from PolyPoseLib.registration.uncertainty.doubts import (
    Evidence,
    disputed_warnings,
    doubts_about,
    reasons_against_most,
    united_warnings,
    unseen_warnings,
)
from PolyPoseLib.registration.uncertainty.intervals import (
    image_uncertainties,
    systematic_error,
    widened_where_united,
    with_allowances,
)
from PolyPoseLib.registration.uncertainty.shrinkage import likeliest_poses
from PolyPoseLib.registration.uncertainty.widths import widths_of
from PolyPoseLib.rendering.select import device_of, must_compile, select_backend, torch_device_of

if TYPE_CHECKING:
    import torch


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
    factor = 1.0
    if options.preset != "paper" and options.camera_model is None:  # a model knows the patient's own size
        factor = magnification_of(study)
    if factor == 1.0:
        return _register(study, options, monitor, factor)
    return at_true_size(_register(magnified(study, factor), options, monitor, factor), factor)


def _register(study: Study, options: Options, monitor: Monitor, magnification: float) -> Result:
    """Register a study that is so many times larger than the patient."""
    backend = select_backend(options.kernel, options.device, options.threads)
    need = needed_memory(study, options, compiles=must_compile(backend))
    require_memory(need, "The registration")
    preset = PRESETS[options.preset]
    preview = _preview(options, magnification)
    monitor.step("preparing", 0, 1, None)
    with monitor.timed("preparing"):
        soft_tissue = _soft_tissue(study, options, preset, magnification, torch_device_of(backend))
    run = Run(soft_tissue, backend, monitor, preview=preview, magnification=magnification)
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
        fit = method.fit_bones(cameras)
    joint, final = fit.joint, fit.observations
    run = replace(run, soft_tissue=fit.soft_tissue)
    with monitor.timed("scoring"):
        agreement = agreement_by_parts(run, final, joint.poses, study.source_segmentation)
        names = [xray.name for xray in study.xrays]
        verdict = judge_cameras(run, names, final, cameras.uncertain)
        verdict.warnings.extend(stage_warnings(run, names, cameras.refined, final))
    with monitor.timed("uncertainty"):
        visibility = structure_visibility(run.scene, final, joint.poses)
        inconsistent = agreement.inconsistent(run.scene.anchor)
        uncertainties, widths = {}, {}
        if options.uncertainty:
            systematic = systematic_error(study.ct, cameras.xrays, final, run.scene.anchor_centre)
            covariance = joint_covariance(joint.problem, joint.state)
            told = image_uncertainties(run, joint, covariance, agreement)
            hidden = visibility.hidden_share
            uncertainties = with_allowances(run, joint, told, agreement, hidden, systematic)
            if preset.shrinks:
                joint = joint.with_poses(likeliest_poses(joint, covariance, uncertainties, inconsistent))
            uncertainties = widened_where_united(uncertainties, agreement)
            widths = widths_of(run.scene, joint, agreement, uncertainties, told)
    with monitor.timed("scoring"):
        after = score_views(run, final, joint.poses)
    evidence = Evidence(
        [xray.name or view_name(n) for n, xray in enumerate(study.xrays)],
        agreement,
        visibility,
        uncertainties,
        widths,
        [xray.maybe_distorted for xray in cameras.xrays],
        magnification,
        breaks(run.scene, joint.poses),
        study.label_names,
    )
    doubts = doubts_about(run.scene, evidence)
    fitted = _Fitted(cameras, joint, final, before, after, evidence, doubts, inconsistent, verdict)
    return _result(study, options, run, fitted)


def camera_regressor(study: Study, path: str | Path | None) -> Regressor | None:
    """The study's camera regressor, or None; raises InputError when it is damaged or of another CT."""
    if path is None:
        return None
    from PolyPoseLib.io.camera_models import load_regressor  # torch is slow to import, and few need it

    return load_regressor(path, study.ct, study.structures, study.anchor)


BARE_CT = (
    "The CT holds bones alone: its renderings lack the soft tissue that the X-rays show, and poses and cameras are "
    "less certain; give the whole CT if there is one."
)


@dataclass(frozen=True)
class _Method:
    """refine_camera: for X-rays by themselves; fit_bones: all structures together, from the cameras of stage A."""

    refine_camera: CameraRefiner
    fit_bones: Callable[[StudyCameras], StructureFit]


def _method(study: Study, options: Options, preset: Preset, run: Run) -> _Method:
    """The published method for the preset "paper", or else the default one at the preset's levels."""
    if options.preset == "paper":
        details = options.paper or PUBLISHED

        def refine_published(
            run: Run, observation: Observation, source_to_detector_mm: float, search: bool
        ) -> RefinedCamera:
            camera = find_camera_by_anchor(run, study.ct, observation, options=details)
            return RefinedCamera(camera, float("nan"), reliable=True)

        def fit_published(cameras: StudyCameras) -> StructureFit:
            optimizer = options.optimizer or "adam"
            joint = fit_structures_by_gmncc(run, study.ct, cameras.refined, optimizer, options=details)
            observed = zip(cameras.refined, joint.cameras, strict=True)
            return StructureFit(
                [each.with_camera(camera) for each, camera in observed], joint, run.soft_tissue
            )

        return _Method(refine_published, fit_published)

    def refine(
        run: Run, observation: Observation, source_to_detector_mm: float, search: bool
    ) -> RefinedCamera:
        return find_camera_near(run, observation, preset.camera_levels, source_to_detector_mm, search)

    def fit(cameras: StudyCameras) -> StructureFit:
        names, poses = run.scene.names, run.scene.rest_poses
        placed = [k for k in run.scene.moving if names[k] in study.initial_poses]
        for k in placed:
            poses[k] = study.initial_poses[names[k]]
        # The coarsest level serves bones that may be far from their place.
        coarsest = max(stage.level.size_mm for stage in preset.joint)
        all_placed = bool(placed) and set(placed) == set(run.scene.moving)
        stages = [stage for stage in preset.joint if not all_placed or stage.level.size_mm < coarsest]
        return fit_structures(run, cameras.refined, poses, cameras.free, stages, placed)

    return _Method(refine, fit)


def _preview(options: Options, magnification: float) -> Preview | None:
    if options.preview is None:
        return None
    write = preview_writer(Path(options.preview))
    return write if magnification == 1 else lambda field: write(field_at_true_size(field, magnification))


def _soft_tissue(
    study: Study, options: Options, preset: Preset, magnification: float, device: torch.device | None
) -> SoftTissue:
    reach, weighting = options.rotation_reach_mm, weighting_of(options)
    return SoftTissue(
        Scene(study.ct, study.structures, study.anchor),
        weighting.frame,
        weighting.form,
        weighting.epsilon / magnification**2,
        preset.rotation_reach_mm if reach is None else reach * magnification,
        device,
    )


@dataclass(frozen=True)
class _Fitted:
    """cameras: of stage A; joint: of stage B; used: the X-rays without what was left out; before, after: scores at rest
    and of the result; evidence: what is known of the poses; doubts: of them, by structure; inconsistent: structures
    that the X-rays contradict; verdict: on the cameras.
    """

    cameras: StudyCameras
    joint: JointResult
    used: Sequence[Observation]
    before: ViewScores
    after: ViewScores
    evidence: Evidence
    doubts: dict[int, tuple[str, ...]]
    inconsistent: list[int]
    verdict: CameraVerdict


def _result(study: Study, options: Options, run: Run, fitted: _Fitted) -> Result:
    """Warp, render, and say what is known about the outcome."""
    monitor, joint = run.monitor, fitted.joint
    warped = _warped(study, options, run.named("warping"), joint)
    renderings = _renderings(run.named("rendering"), fitted, PRESETS[options.preset].rendering_mm)
    names = [xray.name for xray in study.xrays]
    similarities = fitted.after.similarities
    monitor.seconds["total"] = monitor.elapsed
    result = Result(
        structures=_structures(run.scene, fitted),
        anchor=study.anchor,
        cameras=[CameraResult(*each) for each in zip(joint.cameras, similarities, names, strict=True)],
        history=monitor.history,
        seconds=monitor.seconds,
        device=f"{device_of(run.backend)}, {run.backend.name}",
        versions=installed_versions(),
        warnings=_warnings(study, run.scene, fitted),
        warped_ct=warped.ct,
        warped_labels=warped.labels,
        transform=warped.transform,
        inverse_transform=warped.inverse,
        soft_tissue_deviation_mm=run.soft_tissue.deviation_mm,
        structure_labels=Volume(study.structures.labels, study.ct.affine),
        segmentation_labels=tuple(labels_present(warped_source(study).voxels).tolist()),
        renderings_before=renderings[0],
        renderings_after=renderings[1],
        xray_images=[xray.image for xray in fitted.cameras.xrays],
        xray_masks=[each.mask for each in fitted.used],
        distrust=(
            *fitted.verdict.distrust,
            *reasons_against_most(run.scene, fitted.evidence),
            *reasons_for_distrust(run.scene, names, fitted.before, fitted.after, joint.poses),
        ),
    )
    run.named("done").step(1, 1, float(np.mean(similarities)))
    return result


def _warped(study: Study, options: Options, run: Run, joint: JointResult) -> Warped:
    run.step(0, 1)
    with run.timed():
        asked = options.transform_spacing_mm
        spacing = TRANSFORM_MM if asked is None else asked * run.magnification
        unfold = PRESETS[options.preset].unfolded
        return warp_study(study, run.soft_tissue, joint.poses, spacing, options.composed, unfold)


def _renderings(
    run: Run, fitted: _Fitted, coarse_mm: float | None
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Of every view through the camera found: at rest and as registered, so that what differs is the bones' motion."""
    run.step(0, 1)
    with run.timed():
        cameras = fitted.joint.cameras
        return (
            render_views(run, cameras, run.scene.rest_poses, coarse_mm),
            render_views(run, cameras, fitted.joint.poses, coarse_mm),
        )


def _warnings(study: Study, scene: Scene, fitted: _Fitted) -> list[str]:
    bare = [BARE_CT] if scene.bare else []
    pairs = zip(fitted.evidence.names, fitted.used, strict=True)
    return [
        *study.warnings,
        *bare,
        *(f"{xray.name}: {warning}" for xray in fitted.cameras.xrays for warning in xray.warnings),
        *fitted.cameras.warnings,
        *(line for name, used in pairs for line in left_out_warnings(name, used)),
        *fitted.verdict.warnings,
        *unseen_warnings(scene, fitted.evidence),
        *inconsistency_warnings(scene, {k: fitted.doubts[k] for k in fitted.inconsistent}),
        *disputed_warnings(scene, fitted.evidence),
        *united_warnings(scene, fitted.evidence),
    ]


def _structures(scene: Scene, fitted: _Fitted) -> dict[str, StructureResult]:
    structures = {}
    for k, name in enumerate(scene.names):
        pose, centre = fitted.joint.poses[k], scene.centres[k]
        uncertainty = fitted.evidence.uncertainties.get(k)
        fields = None if uncertainty is None else uncertainty.to_dict(fitted.joint.cameras, pose, centre)
        structures[name] = StructureResult.from_pose(pose, centre, fields, fitted.doubts.get(k, ()))
    return structures
