"""The uncertainty that is stated for every structure: all that is known of how far its pose may be off."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from PolyPoseLib.data.hounsfield import bone_is_clipped
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.data.xray import Xray
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.rigid import rigid_inverse
from PolyPoseLib.registration.bones.agreement import Agreement
from PolyPoseLib.registration.bones.rows import breaks
from PolyPoseLib.registration.fit.levels import Observation, pixel_size_mm
from PolyPoseLib.registration.fit.problem import JointResult
from PolyPoseLib.registration.run import Run
from PolyPoseLib.registration.uncertainty.covariance import PoseUncertainty, pose_uncertainties
from PolyPoseLib.registration.uncertainty.local_minima import LEVER_MM, widened_by_local_minima

DISTORTION = 0.03
"""Standard deviation that an image intensifier's distortion leaves in poses, in radians and relative to the radius of
its field at the patient. Pincushion of 5 to 7 % at the edge and an S of 2 to 3 degrees displace bones by 0.5 to 4 % of
the radius; with 0.02, 3 of 16 bones of three pelvises and a chest were outside their region, by up to a sixth, with
0.025 one of 30 of three pelvises and three chests, by 3 %, see Testing/Benchmarks/degraded.py."""

UNCONFIRMED_DEG, UNCONFIRMED_MM = 7.0, 5.0
"""Standard deviations of a bone that no X-ray shows clearly, of a structure that unites bones which moved against each
other, and along the beam of the one X-ray that shows a bone, where another contradicts it."""

HIDDEN_SHARE = 0.4
"""Share behind metal at which a bone is as uncertain as one that no X-ray shows clearly."""

SOFT_SHARE = 0.25
"""Standard deviation of a bone's place, of how far the soft tissue around it moved by itself: the motion that is found
is smooth and stops at bones, and what it misses of an organ's edge over a rib moves the rib."""

CLIPPED_DEG, CLIPPED_MM = 1.5, 1.5
"""Standard deviations more where the CT was clipped to a window of soft tissue: edges of bones are not where the X-rays
have them, and bones were up to 3.3 mm off."""


def image_uncertainties(
    run: Run, joint: JointResult, covariance: np.ndarray, agreement: Agreement
) -> dict[int, PoseUncertainty]:
    """What the images alone tell of every pose that was fitted.

    Parameters
    ----------
    run : Run
        The patient and the monitor.
    joint : JointResult
        Of the last level.
    covariance : (6 F, 6 F) ndarray
        Of all its free poses, see :func:`joint_covariance`.
    agreement : Agreement
        Of the structures with the X-rays.

    Returns
    -------
    dict of int to PoseUncertainty
        By index of the structure; those that the X-rays contradict have no curvature to speak of.

    """
    inconsistent = agreement.inconsistent(run.scene.anchor)
    of_all = pose_uncertainties(joint.problem, covariance)
    consistent = {k: each for k, each in of_all.items() if k not in inconsistent}
    step = run.named("uncertainty").step
    told = {k: PoseUncertainty.doubted() for k in of_all}
    for k, each in widened_by_local_minima(joint.problem, joint.state, consistent, step).items():
        contrast = agreement.contrast[k]
        told[k] = each if np.isnan(contrast).all() else each.at_contrast(float(np.nanmean(contrast)))
        if not agreement.is_clear[k]:
            told[k] = told[k].with_error(PoseUncertainty.independent(UNCONFIRMED_DEG, UNCONFIRMED_MM))
    return told


def with_allowances(
    run: Run,
    joint: JointResult,
    told: Mapping[int, PoseUncertainty],
    agreement: Agreement,
    hidden: np.ndarray,
    systematic: PoseUncertainty | None = None,
) -> dict[int, PoseUncertainty]:
    """Uncertainties that allow for what the images do not tell.

    Parameters
    ----------
    run, joint, agreement
        As :func:`image_uncertainties` takes them.
    told : mapping of int to PoseUncertainty
        What the images tell, by index of the structure.
    hidden : (K,) ndarray
        Shares, 0 to 1, of the structures that metal hides.
    systematic : PoseUncertainty, optional
        An error that all poses may have, whatever the images show.

    Returns
    -------
    dict of int to PoseUncertainty
        Of the same structures.

    """
    inconsistent = agreement.inconsistent(run.scene.anchor)
    apart = {k: each.apart_mm for each in reversed(breaks(run.scene, joint.poses)) for k in each.slipped}
    stated = dict(told)
    for k in told.keys() - set(inconsistent):
        in_fixed = (rigid_inverse(joint.poses[k]) @ np.append(run.scene.centres[k], 1.0))[:3]
        beside = run.soft_tissue.motion_around(in_fixed)
        stated[k] = stated[k].with_error(error_beside_soft_motion(beside))
        if k in apart:
            stated[k] = stated[k].with_error(error_out_of_row(apart[k]))
        if hidden[k] > 0:
            stated[k] = stated[k].with_error(error_behind_metal(float(hidden[k])))
        supporting = np.flatnonzero(agreement.supported[k]).tolist()
        if agreement.disputed[k] and len(supporting) == 1:
            beam = _beam(joint.cameras[supporting[0]], joint.poses[k], run.scene.centres[k])
            stated[k] = stated[k].with_error(PoseUncertainty.shift_along(beam, UNCONFIRMED_MM))
    return {k: each if systematic is None else each.with_error(systematic) for k, each in stated.items()}


def widened_where_united(
    uncertainties: dict[int, PoseUncertainty], agreement: Agreement
) -> dict[int, PoseUncertainty]:
    """Uncertainties that allow for bones which moved against the structure that unites them.

    They are for stating alone: the structure's pose is where most of it is, and must not be shrunk for it.
    """
    error = PoseUncertainty.independent(UNCONFIRMED_DEG, UNCONFIRMED_MM)
    return {
        k: each.with_error(error) if agreement.parts_off(k) else each for k, each in uncertainties.items()
    }


def error_beside_soft_motion(moved_mm: float) -> PoseUncertainty:
    """What a bone's pose may be off by more where the soft tissue around it moved so far by itself."""
    deviation = SOFT_SHARE * moved_mm
    return PoseUncertainty.independent(float(np.degrees(deviation / LEVER_MM)), deviation)


def error_out_of_row(apart_mm: float) -> PoseUncertainty:
    """What a bone's pose may be off by more that has moved so far against the companions beside it."""
    deviation = apart_mm / 2
    return PoseUncertainty.independent(float(np.degrees(deviation / LEVER_MM)), deviation)


def error_behind_metal(share: float) -> PoseUncertainty:
    """What a bone's pose may be off by more, of which metal hides a share, 0 to 1.

    It grows steeply, with the third power: wires and screws leave a bone's outline, a prosthesis replaces it.
    """
    part = (share / HIDDEN_SHARE) ** 3
    return PoseUncertainty.independent(part * UNCONFIRMED_DEG, part * UNCONFIRMED_MM)


def _beam(camera: Camera, fixed_to_moving: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """(3,) unit direction in the CT of the ray through a structure's centroid (3,)."""
    source = fixed_to_moving[:3, :3] @ camera.source + fixed_to_moving[:3, 3]
    ray = centre - source
    return ray / np.linalg.norm(ray)


def systematic_error(
    ct: Volume, xrays: Sequence[Xray], observations: Sequence[Observation], point: np.ndarray
) -> PoseUncertainty | None:
    """What all poses may be off by, whatever the images show: distortion, and a CT without dense bone.

    Parameters
    ----------
    ct : Volume
        In HU.
    xrays, observations, point
        As :func:`distortion_error` takes them.

    Returns
    -------
    PoseUncertainty or None
        None where nothing speaks for such an error.

    """
    distortion = distortion_error(xrays, observations, point)
    if not bone_is_clipped(ct):
        return distortion
    clipped = PoseUncertainty.independent(CLIPPED_DEG, CLIPPED_MM)
    return clipped if distortion is None else clipped.with_error(distortion)


def distortion_error(
    xrays: Sequence[Xray], observations: Sequence[Observation], point: np.ndarray
) -> PoseUncertainty | None:
    """What distortion that was not corrected may do to poses.

    Parameters
    ----------
    xrays : sequence of Xray
        Of which some may be distorted.
    observations : sequence of Observation
        The same with their cameras.
    point : (3,) ndarray
        LPS mm, where the field's radius is measured.

    Returns
    -------
    PoseUncertainty or None
        None where no X-ray is distorted.

    """
    radii = [
        min(observation.image.shape) / 2 * pixel_size_mm(observation.camera, point)
        for xray, observation in zip(xrays, observations, strict=True)
        if xray.maybe_distorted
    ]
    if not radii:
        return None
    return PoseUncertainty.independent(float(np.degrees(DISTORTION)), DISTORTION * max(radii))
