"""The first frame, which has none beside it."""

from __future__ import annotations

import numpy as np

from PolyPoseLib.geometry.rigid import rigid_inverse
from PolyPoseLib.registration.bones.joint import fit_structures
from PolyPoseLib.registration.cameras.rig import find_rig_near
from PolyPoseLib.registration.presets import PRESETS
from PolyPoseLib.tracking.frame_fit import Frame
from PolyPoseLib.tracking.patient import Patient, seen_from


def starting_poses(patient: Patient, frame: Frame | None) -> np.ndarray:
    """Where the first frame's fit starts.

    Parameters
    ----------
    patient : Patient
        With the initial poses that somebody gave.
    frame : Frame, optional
        The first frame; None where it is not to be registered: structures are then where they were put, and the others
        where the CT has them relative to the reference, or to the first that was put where the reference was not: one
        bone tells where in the rig's world the patient is.

    Returns
    -------
    (K, 4, 4) ndarray
        The rig's world to moving, in the scene.

    """
    names, given = patient.scene.names, patient.sequence.initial_poses
    reference = names[patient.reference]
    others = given.get(reference, next(iter(given.values()), np.eye(4)))
    poses = patient.enlarged(np.stack([given.get(name, others) for name in names]))
    placed = [k for k, name in enumerate(names) if name in given]
    if frame is None or len(placed) == len(names):
        return poses
    return _registered(patient, frame, poses, placed)


def _registered(patient: Patient, frame: Frame, poses: np.ndarray, placed: list[int]) -> np.ndarray:
    """Poses (K, 4, 4) by the registration that single X-rays get, with cameras that keep their relative places.

    The whole CT is placed first, unless somebody placed the reference; then all structures, with restarts.
    """
    preset, reference = PRESETS["default"], patient.reference
    base = poses[reference]
    observations = seen_from(frame.observations, base)
    if reference not in placed:
        found = find_rig_near(patient.run.named("camera"), observations, preset.camera_levels)
        # A camera that moved by M^-1 in the CT's world sees what the CT would show that moved by M in the rig's.
        moved = rigid_inverse(found[0].camera.extrinsic) @ frame.observations[0].camera.extrinsic
        observations = seen_from(frame.observations, moved)
        base = moved
    relative = poses @ rigid_inverse(base)
    for k in range(len(poses)):
        if k not in placed:
            relative[k] = np.eye(4)
    fit = fit_structures(patient.run, observations, relative, (), preset.joint, placed)
    return fit.joint.poses @ base
