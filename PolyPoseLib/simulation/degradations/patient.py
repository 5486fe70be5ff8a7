"""Patients that move between the views, and small joints."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.simulation.degradations.anatomy import body_lines
from PolyPoseLib.simulation.degradations.degraded_case import DegradedCase, View, stated_of, undegraded
from PolyPoseLib.simulation.degradations.instruments import operated_bones
from PolyPoseLib.simulation.motion import rigid_about
from PolyPoseLib.simulation.simulate import perturbed_camera, structures_centre

MOVED_DEG, MOVED_MM = 4.0, 10.0
LIMB_DEG = 6.0
SMALL = 0.25
SMALL_SATURATION = 0.05
"""Exposures are chosen for the thickness: a hand does not burn out where a pelvis would."""


def patient_moved(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """The whole patient turns by 4 degrees and shifts by 10 mm after the first view."""
    case = degraded.case
    centre = structures_centre(case.structures, case.ct.affine)
    axis, direction = (v / np.linalg.norm(v) for v in rng.normal(size=(2, 3)))
    motion = rigid_about(centre, np.radians(MOVED_DEG) * axis, MOVED_MM * direction)
    cameras = [view.camera.with_extrinsic(view.camera.extrinsic @ motion) for view in degraded.views[1:]]
    return _retaken(degraded, cameras, body_lines(case, cameras))


def patient_moved_known_cameras(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """The whole patient moves between the views of a calibrated rig, whose cameras the study calls known."""
    known = degraded.with_views(
        lambda view, _: replace(view, stated=replace(view.stated, extrinsic=view.camera.extrinsic))
    )
    return replace(patient_moved(known, rng), camera_state="known")


def limb_moved(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """One limb turns by 6 degrees in its joint after the first view; the truth is its place in that view."""
    case = degraded.case
    name = operated_bones(degraded)[0]
    joint = case.joints[name].joint if name in case.joints else case.ct.bounds_center
    axis = rng.normal(size=3)
    turn = rigid_about(joint, np.radians(LIMB_DEG) * axis / np.linalg.norm(axis), np.zeros(3))
    poses = {**case.fixed_to_moving, name: np.linalg.inv(turn) @ case.fixed_to_moving[name]}
    cameras = [view.camera for view in degraded.views[1:]]
    return _retaken(degraded, cameras, body_lines(case, cameras, poses))


def small_bones(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """Everything a quarter of its size, like a wrist, on a detector of pixels a quarter as large."""
    case = degraded.case
    centre = _isocentre(degraded)
    shrink = np.eye(4)
    shrink[:3, :3] *= SMALL
    shrink[:3, 3] = (1 - SMALL) * centre
    grow = np.linalg.inv(shrink)
    poses = {name: shrink @ pose @ grow for name, pose in case.fixed_to_moving.items()}
    cameras = [_finer(view.camera) for view in degraded.views]
    options = case.options
    initial = [
        perturbed_camera(camera, centre, rng, options.rotation_deg, options.translation_mm * SMALL)
        for camera in cameras
    ]
    # The line integrals of the shrunken patient through the finer camera: those of the patient as it is, seen from
    # farther away, a quarter as long.
    far = [_farther(view.camera, centre) for view in degraded.views]
    lines = [SMALL * line for line in body_lines(case, far)]
    small = replace(
        case,
        ct=Volume(case.ct.voxels, shrink @ case.ct.affine),
        source_labels=_moved_grid(case.source_labels, shrink),
        fixed_ct=Volume(case.fixed_ct.voxels, shrink @ case.fixed_ct.affine),
        fixed_labels=Volume(case.fixed_labels.voxels, shrink @ case.fixed_labels.affine),
        fixed_source_labels=_moved_grid(case.fixed_source_labels, shrink),
        field=DisplacementField(SMALL * case.field.vectors, shrink @ case.field.affine),
        fixed_to_moving=poses,
        joints={},
        soft=None if case.soft is None else case.soft.mapped(shrink),
        statistics=_shrunken(case.statistics),
        cameras=cameras,
        initial_cameras=initial,
        clean_images=lines,
        images=[line.astype(np.float32) for line in lines],
        options=replace(options, node_mm=max(options.node_mm * SMALL, 0.5), pad_mm=options.pad_mm * SMALL),
    )
    distance = degraded.views[0].stated.source_to_detector_mm
    made = undegraded(small, distance)
    told = cameras if degraded.camera_state == "known" else initial
    views = tuple(
        replace(view, stated=stated_of(camera, distance))
        for view, camera in zip(made.views, told, strict=True)
    )
    return replace(
        made,
        camera_state=degraded.camera_state,
        views=views,
        physics=replace(degraded.physics, saturation=SMALL_SATURATION),
        size_factor=SMALL * degraded.size_factor,
        names=degraded.names,
    )


def _shrunken(statistics: dict) -> dict:
    """Statistics of a case with all lengths a quarter as long."""
    return {
        key: _shrunken(value) if isinstance(value, dict) else SMALL * value if key.endswith("_mm") else value
        for key, value in statistics.items()
    }


def _retaken(degraded: DegradedCase, cameras: list[Camera], lines: list[np.ndarray]) -> DegradedCase:
    """The case with other true cameras and line integrals (H, W) of the patient from the second view on."""

    def retake(view: View, number: int) -> View:
        if number == 0:
            return view
        line = lines[number - 1]
        return replace(view, camera=cameras[number - 1], body=line, line=line)

    return degraded.with_views(retake)


def _isocentre(degraded: DegradedCase) -> np.ndarray:
    """The point (3,) nearest to the central rays of all views, and as near to the bones as these allow."""
    case = degraded.case
    matrix, right = 1e-6 * np.eye(3), 1e-6 * structures_centre(case.structures, case.ct.affine)
    for view in degraded.views:
        across = np.eye(3) - np.outer(view.camera.axis, view.camera.axis)
        matrix, right = matrix + across, right + across @ view.camera.source
    return np.linalg.solve(matrix, right)


def _finer(camera: Camera) -> Camera:
    """The camera with pixels a quarter as large."""
    intrinsics = camera.intrinsics.copy()
    intrinsics[[0, 1], [0, 1]] /= SMALL
    return Camera(intrinsics, camera.extrinsic, camera.height, camera.width)


def _farther(camera: Camera, centre: np.ndarray) -> Camera:
    """The camera through which the patient looks as the shrunken one does through the finer camera."""
    extrinsic = camera.extrinsic.copy()
    extrinsic[:3, 3] = (extrinsic[:3, :3] @ centre + extrinsic[:3, 3]) / SMALL - extrinsic[:3, :3] @ centre
    return _finer(camera).with_extrinsic(extrinsic)


def _moved_grid(volume: Volume | None, shrink: np.ndarray) -> Volume | None:
    """A volume on the shrunken grid."""
    return None if volume is None else Volume(volume.voxels, shrink @ volume.affine)
