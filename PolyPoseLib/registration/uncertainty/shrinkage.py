"""Poses as they are likeliest among motions of the size that the X-rays suggest.

What the X-rays hardly show of a bone's pose ends anywhere within its interval: a rib along the beam, or every bone
where nothing moved at all. Motions of one patient tell of each other, though. A priori, bones move by zero on average,
alike where they are close, and by a size that is estimated from all of them together (empirical Bayes: B. Efron and C.
Morris, "Stein's estimation rule and its competitors", JASA 68, 1973). Poses are then shrunk towards what that prior
expects, each direction by as much as it is uncertain against the prior. Errors that bones have in common, such as the
cameras', count as such and not as motion.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
from scipy.linalg import cholesky, eigh, solve_triangular
from scipy.optimize import minimize_scalar

from PolyPoseLib.geometry.rigid import about, perturbation, perturbation_between
from PolyPoseLib.registration.fit.problem import JointResult
from PolyPoseLib.registration.uncertainty.covariance import PoseUncertainty
from PolyPoseLib.registration.uncertainty.local_minima import LEVER_MM

LENGTH_MM = 100.0
"""Length scale of the motions' correlation: bones whose centroids are this far apart are correlated by 0.6, but for
what each does alone."""

ALONE = 0.2
"""Share of a bone's variance a priori that it has in common with no other bone."""

SIZE_STATED, POSE_STATED = 3.0, 6.0
"""How many times larger stated standard deviations are than the errors for which they allow, when the motions' size is
estimated and when a pose is shrunk. Intervals are made to hold, not to be exact; and where one is much too wide, as of
a humerus that is 0.3 mm off, its bone must not be pulled away from where the X-rays have it."""

SIZES_MM = (1e-3, 100.0)
"""Range of the standard deviation a priori of a bone's displacement along each axis."""

_LEVERS = np.array([LEVER_MM] * 3 + [1.0] * 3)


def likeliest_poses(
    joint: JointResult,
    covariance: np.ndarray,
    uncertainties: Mapping[int, PoseUncertainty],
    contradicted: Collection[int],
) -> np.ndarray:
    """Shrink the poses of a joint fit.

    Parameters
    ----------
    joint : JointResult
        As the fit left it.
    covariance : (6 F, 6 F) ndarray
        Of its free poses together, see :func:`joint_covariance`; what is stated of one alone is not shared with others.
    uncertainties : dict of int to PoseUncertainty
        As they are stated, by index of the structure.
    contradicted : collection of int
        Structures that the X-rays contradict: what is stated of them does not come from the covariance.

    Returns
    -------
    (K, 4, 4) ndarray
        Fixed to moving.

    """
    poses, problem = joint.poses.copy(), joint.problem
    used = [n for n, k in enumerate(problem.free_poses) if k in uncertainties]
    if not used:
        return poses
    bones = [problem.free_poses[n] for n in used]
    rows = np.concatenate([np.arange(6 * n, 6 * n + 6) for n in used])
    whole = covariance[np.ix_(rows, rows)]
    for n, k in enumerate(bones):
        own = slice(6 * n, 6 * n + 6)
        if k in contradicted:
            whole[own, :], whole[:, own] = 0, 0
        whole[own, own] = uncertainties[k].covariance
    centres = np.array([problem.bodies[k].centre for k in bones])
    poses[bones] = shrunk_poses(poses[bones], centres, whole)[0]
    return poses


def shrunk_poses(poses: np.ndarray, centres: np.ndarray, covariance: np.ndarray) -> tuple[np.ndarray, float]:
    """Shrink the poses of K bones by a prior whose size they suggest.

    Parameters
    ----------
    poses : (K, 4, 4) ndarray
        Fixed to moving, as the X-rays have them.
    centres : (K, 3) ndarray
        Centroids in the CT, LPS mm.
    covariance : (6 K, 6 K) ndarray
        Stated, of perturbations [rotation (rad), translation (mm)] on the left of the poses about the centroids.

    Returns
    -------
    poses : (K, 4, 4) ndarray
        Fixed to moving.
    size_mm : float
        Standard deviation a priori of a bone's displacement along each axis, with which the poses found are likeliest;
        its rotation has that of size_mm at a lever of LEVER_MM.

    """
    rest = np.eye(4)
    found = np.concatenate(
        [perturbation_between(rest, pose, centre) for pose, centre in zip(poses, centres, strict=True)]
    )
    # Along these axes errors are independent with variance 1, and so are motions, with a variance of each their own.
    root = cholesky(covariance, lower=True)
    half = solve_triangular(root, _covariance_of_motions(centres, np.ones(len(centres))), lower=True)
    variances, axes = eigh(solve_triangular(root, half.T, lower=True))
    variances = np.maximum(variances, 0)  # rounding
    along = axes.T @ solve_triangular(root, found, lower=True)

    def unlikeliness(log_size: float) -> float:
        total = SIZE_STATED**-2 + np.exp(2 * log_size) * variances
        return float(np.log(total).sum() + (along**2 / total).sum())

    best: Any = minimize_scalar(unlikeliness, bounds=np.log(SIZES_MM), method="bounded")
    size = float(np.exp(best.x))
    errors = covariance / POSE_STATED**2
    alike = _expected(found, errors, _covariance_of_motions(centres, np.full(len(centres), size)))
    # A bone that moved by more than the others, as arms do, is not one of theirs: its own motion is its size.
    sizes = np.maximum(size, _own_sizes(alike))
    likeliest = _expected(found, errors, _covariance_of_motions(centres, sizes)).reshape(-1, 6)
    shrunk = [about(perturbation(delta), centre) for delta, centre in zip(likeliest, centres, strict=True)]
    return np.array(shrunk), size


def _expected(found: np.ndarray, errors: np.ndarray, prior: np.ndarray) -> np.ndarray:
    """(P,) mean of what was found (P,) with errors of a covariance (P, P), given another one a priori (P, P)."""
    return prior @ np.linalg.solve(prior + errors, found)


def _own_sizes(motions: np.ndarray) -> np.ndarray:
    """(K,) root mean square along the six axes, rotations by a lever, of each bone's motion out of (6 K,)."""
    return np.sqrt(((motions.reshape(-1, 6) * _LEVERS) ** 2).mean(axis=1))


def _covariance_of_motions(centres: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """(6 K, 6 K) a priori, of motions about the centres (K, 3) of sizes (K,)."""
    squares = ((centres[:, None] - centres[None]) ** 2).sum(axis=2)
    between = (1 - ALONE) * np.exp(-0.5 * squares / LENGTH_MM**2) + ALONE * np.eye(len(centres))
    return np.kron(between * np.outer(sizes, sizes), np.diag(_LEVERS**-2))
