"""What speaks against a pose: the X-rays, the frames beside it, and other structures in the same place."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from PolyPoseLib.data.tracking.track import TrackedFrame
from PolyPoseLib.geometry.rigid import perturbation_between, rigid_inverse
from PolyPoseLib.registration.uncertainty.covariance import PoseUncertainty
from PolyPoseLib.tracking.frame_fit import FrameFit
from PolyPoseLib.tracking.intervals import frame_covariances
from PolyPoseLib.tracking.patient import Patient
from PolyPoseLib.tracking.prediction import is_found

REMEMBERED = 15
"""Frames beside one that it is compared with. What is ordinary is known from the nearest ones in which nothing speaks
against a structure, however far away these are: otherwise a cause that lasts would become ordinary itself."""

LEAST_BESIDE = 4
"""Frames from which on it is known what is ordinary."""

WORSE, WORSE_AT_LEAST = 3.0, 0.05
"""A residual is out of the ordinary when it is so many times what it was before, and larger by so much (half of the
mean square, 0 to 1)."""

JUMP_MM = 4.0
"""Distance from the predicted place, mm of the scene, below which nothing is a jump; a structure's rotation counts by
its radius."""

JUMPS = 6.0
"""Times what the prediction missed by in the frames before, from which on a structure has jumped."""

SURE = 5.0
"""Standard deviations of the poses that a jump exceeds."""

WIDE_MM = 5.0
"""Half width of a 95 % interval, mm of the scene as in a registration, beyond which a pose is doubtful."""

WIDER = 2.5
"""Times what it was in the frames beside it, from which on an interval of a single camera is wide."""

INSIDE_SHARE = 0.08
"""Share of a structure's points that may lie inside another one."""

AGAINST = "its rendering does not match"
"""How the line about cameras whose X-rays contradict a pose begins."""

NOT_SHOWN = "it shows in no X-ray"
WORSENED = "its rendering matches the X-rays much worse than in the frames beside it"
WEAK = "the X-rays determine its pose weakly"


@dataclass(frozen=True)
class Assessment:
    """What is known of the K poses of a fit.

    Attributes
    ----------
    fit : FrameFit
        The poses.
    covariances : (K, 6, 6) ndarray
        In the scene.
    residuals : (K,) ndarray
        As :class:`TrackedFrame` has them.
    doubts : tuple of tuple of str
        Clauses, the gravest first.
    suspects : tuple of int
        Structures for which other poses should be tried.
    lost : tuple of int
        Structures whose pose is not to be used.

    """

    fit: FrameFit
    covariances: np.ndarray
    residuals: np.ndarray
    doubts: tuple[tuple[str, ...], ...]
    suspects: tuple[int, ...]
    lost: tuple[int, ...]


def assess(
    patient: Patient, fit: FrameFit, predicted: np.ndarray | None, beside: Sequence[TrackedFrame]
) -> Assessment:
    """Compare a fit with its X-rays and with frames beside it.

    Parameters
    ----------
    patient : Patient
        The structures.
    fit : FrameFit
        Of the frame.
    predicted : (K, 4, 4) ndarray, optional
        Where the frames beside it lead, in the scene; None for a frame without any.
    beside : sequence of TrackedFrame
        All before it, or after it where time goes backward, the nearest last.

    Returns
    -------
    Assessment
        Of every structure. Those that stand still are looked at in the first frame alone, unless their pose is given,
        and are never suspects.

    """
    agreement = fit.agreement
    count = len(fit.poses)
    covariances = np.stack([PoseUncertainty.unseen().covariance] * count)
    residuals = np.array([_residual(each) for each in agreement.residuals])
    for k, covariance in frame_covariances(fit.problem, fit.state, patient.voxel_mm).items():
        covariances[k] = covariance
    inside = overlaps(patient, fit.poses)
    doubts: list[tuple[str, ...]] = []
    suspects, lost = [], []
    for k in range(count):
        if k in patient.vouched or (beside and k in patient.still):
            doubts.append(())
            continue
        if agreement.is_unseen[k]:
            doubts.append((NOT_SHOWN,))
            lost.append(k)
            continue
        lines = []
        against = agreement.contradicted[k]
        worsened = _has_worsened(residuals[k], k, beside)
        if against.any():
            lines.append(f"{AGAINST} {_those(fit, against)}")
        if worsened:
            lines.append(WORSENED)
        # Given up where the change is recent alone: what lasts is flagged, with the pose that was found.
        changed = _has_worsened(residuals[k], k, beside[-REMEMBERED:])
        if against.any() and (changed or not (agreement.is_clear[k] or agreement.supported[k].any())):
            lost.append(k)
        if _is_wide(patient, covariances[k], k, beside):
            lines.append(WEAK)
        lines += [f'it lies partly inside "{patient.scene.names[other]}"' for other in inside.get(k, ())]
        doubts.append(tuple(lines))
        jumped = predicted is not None and _has_jumped(patient, fit, covariances, predicted, beside, k)
        # What other starts did not change in the frame before they will not change in this one.
        known = set(beside[-1].doubts[k]) if beside and is_found(beside[-1], k) else set()
        if k in patient.moving and (jumped or set(lines) - {WEAK} - known):
            suspects.append(k)
    return Assessment(fit, covariances, residuals, tuple(doubts), tuple(suspects), tuple(lost))


def overlaps(patient: Patient, poses: np.ndarray) -> dict[int, list[int]]:
    """Structures that lie more inside others than in the CT's own posture could be a fault of labels; by index."""
    labels = patient.scene.structures.labels
    to_index = np.linalg.inv(patient.scene.ct_affine)
    limit = np.array(labels.shape[::-1])
    found: dict[int, list[int]] = {}
    for k, points in enumerate(patient.points):
        fixed = rigid_inverse(poses[k])
        in_fixed = points @ fixed[:3, :3].T + fixed[:3, 3]
        for other in range(len(poses)):
            if other == k:
                continue
            to_voxel = to_index @ poses[other]
            index = np.rint(in_fixed @ to_voxel[:3, :3].T + to_voxel[:3, 3]).astype(int)
            index = index[((index >= 0) & (index < limit)).all(axis=1)]
            share = (labels[tuple(index.T[::-1])] == other + 1).sum() / len(points)
            if share > INSIDE_SHARE:
                found.setdefault(k, []).append(other)
    return found


def distance_mm(patient: Patient, first: np.ndarray, second: np.ndarray, k: int) -> float:
    """How far (mm) two poses (4, 4) of a structure are apart, its rotation counted by its radius."""
    delta = perturbation_between(first, second, patient.scene.centres[k])
    return float(np.hypot(patient.radii[k] * np.linalg.norm(delta[:3]), np.linalg.norm(delta[3:])))


def _those(fit: FrameFit, which: np.ndarray) -> str:
    """The names of a frame's X-rays whose flag (N,) is set."""
    return " and ".join(f'the camera "{name}"' for name, each in zip(fit.names, which, strict=True) if each)


def _residual(of_views: np.ndarray) -> float:
    """Half the mean square over the views that show a structure, 1 where none does."""
    shown = of_views[~np.isnan(of_views)]
    return float(np.clip(shown.mean() / 2, 0, 1)) if len(shown) else 1.0


def _undoubted(k: int, beside: Sequence[TrackedFrame]) -> list[TrackedFrame]:
    """The nearest frames in which a structure was found and nothing speaks against it; none where they are too few."""
    fine = (each for each in reversed(beside) if is_found(each, k) and not each.doubts[k])
    nearest = list(itertools.islice(fine, REMEMBERED))
    return nearest if len(nearest) >= LEAST_BESIDE else []


def _has_worsened(residual: float, k: int, beside: Sequence[TrackedFrame]) -> bool:
    residuals = [each.residuals[k] for each in _undoubted(k, beside)]
    if not residuals:
        return False
    usual = float(np.median(residuals))
    return residual > max(WORSE * usual, usual + WORSE_AT_LEAST)


def _is_wide(patient: Patient, covariance: np.ndarray, k: int, beside: Sequence[TrackedFrame]) -> bool:
    """Whether an interval is wide, and not because a single camera always leaves it so along its beam."""
    widest = PoseUncertainty(covariance).widest_mm
    if widest <= WIDE_MM or len(patient.sequence.views) > 1:
        return widest > WIDE_MM
    widths = [
        patient.factor * PoseUncertainty(each.covariances[k]).widest_mm for each in _undoubted(k, beside)
    ]
    return bool(widths) and widest > WIDER * float(np.median(widths))


def _has_jumped(
    patient: Patient,
    fit: FrameFit,
    covariances: np.ndarray,
    predicted: np.ndarray,
    beside: Sequence[TrackedFrame],
    k: int,
) -> bool:
    """Whether a pose is farther from the predicted one than is ordinary, and than their errors explain."""
    if len(beside) < LEAST_BESIDE:
        return False
    away = distance_mm(patient, predicted[k], fit.poses[k], k)
    if away < max(JUMP_MM, JUMPS * usual_step(patient, beside, k)):
        return False
    delta = perturbation_between(predicted[k], fit.poses[k], patient.scene.centres[k])
    # The prediction's error is that of two poses more.
    return float(delta @ np.linalg.solve(3 * covariances[k], delta)) > SURE**2


def usual_step(patient: Patient, beside: Sequence[TrackedFrame], k: int) -> float:
    """Median change (mm of the scene) of a structure's step from one frame to the next, in the frames beside one."""
    poses = [patient.enlarged(each.poses[k]) for each in beside[-REMEMBERED:] if is_found(each, k)]
    steps = [perturbation_between(a, b, patient.scene.centres[k]) for a, b in itertools.pairwise(poses)]
    changes = [b - a for a, b in itertools.pairwise(steps)]
    if len(changes) < 2:
        return 0.0
    sizes = [np.hypot(patient.radii[k] * np.linalg.norm(c[:3]), np.linalg.norm(c[3:])) for c in changes]
    return float(np.median(sizes))
