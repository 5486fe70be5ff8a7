"""How far each pose may be off: the solver's curvature against the residual as it really is.

At the optimum the scores (weighted residual times derivative) sum to zero; their spread over patches of the images
shows how much the optimum would move if the residual were drawn again. The residual is correlated over a patch, so
scores are summed within patches first: the cluster-robust ("sandwich") covariance, inverse curvature times spread
of the scores times inverse curvature (Liang and Zeger, Biometrika 73, 1986).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.special import chdtri

from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.registration.fit.linearised import Linearised
from PolyPoseLib.registration.fit.problem import RigidProblem, State
from PolyPoseLib.registration.fit.refutation import PATCHES_PER_CLUSTER, cluster_sums

NORMAL_95 = 1.96
"""Half width of a 95 % interval in standard deviations."""

INFLATION = 5.0
"""Factor on the standard deviations for errors that the residual does not show: soft tissue that moves otherwise than
the model shifts all of an edge one way. Measured on simulated cases, see Testing/Benchmarks/accuracy.py."""

LEAST_NOISE = 1e-6
"""Least variance of the residual, in variances of the local contrast; keeps the prior in force where the images hold
no information at all."""

COMMON_DIRECTION = 0.55
"""Length of the mean of unit viewing directions above which they have a direction in common."""

SYSTEMATIC_ROTATION_DEG = 0.15
SYSTEMATIC_TRANSLATION_MM = 0.15
"""Standard deviations that no residual shows: voxels of millimetres, labels that miss the bone's edge."""

UNSEEN_ROTATION_DEG = 30.0
UNSEEN_TRANSLATION_MM = 50.0
"""Standard deviations of a pose that no X-ray shows."""

DOUBTED_ROTATION_DEG = 10.0
DOUBTED_TRANSLATION_MM = 10.0
"""Standard deviations of a pose that the X-rays contradict: it is the best within the reach of the restarts."""

TYPICAL_CONTRAST = 0.12
"""Contrast of a bone, in variances of the X-ray's local contrast, at which INFLATION was measured. Errors of the soft
tissue around a bone are as large whatever its contrast, so that they displace a fainter one farther."""

FAINTEST = 3.0
"""How many times fainter a bone may be that counts so: beyond, the residual shows it."""

_UNSEEN = np.array([np.radians(UNSEEN_ROTATION_DEG)] * 3 + [UNSEEN_TRANSLATION_MM] * 3)


@dataclass(frozen=True)
class PoseUncertainty:
    """How far a pose may be off.

    Parameters
    ----------
    covariance : (6, 6) ndarray
        Of [rotation (rad), translation (mm)], a perturbation on the left of the pose fixed to moving, about the
        structure's centroid.
    rival_mm : float
        Distance to another place that fits the X-rays as well, rotations counted by a lever; 0 without one.

    """

    covariance: np.ndarray
    rival_mm: float = 0.0

    @classmethod
    def independent(cls, rotation_deg: float, translation_mm: float) -> PoseUncertainty:
        """Of these standard deviations about and along every axis."""
        deviations = np.array([np.radians(rotation_deg)] * 3 + [translation_mm] * 3)
        return cls(np.diag(deviations**2))

    @classmethod
    def unseen(cls) -> PoseUncertainty:
        """Of a pose that no X-ray shows."""
        return cls.independent(UNSEEN_ROTATION_DEG, UNSEEN_TRANSLATION_MM)

    @classmethod
    def doubted(cls) -> PoseUncertainty:
        """Of a pose that the X-rays contradict."""
        return cls.independent(DOUBTED_ROTATION_DEG, DOUBTED_TRANSLATION_MM)

    @classmethod
    def shift_along(cls, direction: np.ndarray, deviation_mm: float) -> PoseUncertainty:
        """Of a shift along a unit direction (3,) of the CT."""
        covariance = np.zeros((6, 6))
        covariance[3:, 3:] = deviation_mm**2 * np.outer(direction, direction)
        return cls(covariance)

    @property
    def widest_mm(self) -> float:
        """Half width of the 95 % interval of the centroid along its least certain direction."""
        return _widest(self.covariance[3:, 3:])

    def with_error(self, other: PoseUncertainty) -> PoseUncertainty:
        """With an independent error more."""
        return replace(self, covariance=self.covariance + other.covariance)

    def at_contrast(self, contrast: float) -> PoseUncertainty:
        """Of a bone of this contrast, in variances of the X-ray's local contrast."""
        faintness = TYPICAL_CONTRAST / max(contrast, TYPICAL_CONTRAST / FAINTEST)
        return replace(self, covariance=self.covariance * max(1.0, faintness))

    def to_dict(
        self, cameras: list[Camera], fixed_to_moving: np.ndarray, centre: np.ndarray
    ) -> dict[str, Any]:
        """95 % intervals (plus or minus, mm and degrees) along and across the common viewing direction.

        Views from opposite sides, or far apart, have the axis in common that lies nearest to all of their rays.

        Parameters
        ----------
        cameras : list of Camera
            Of all views.
        fixed_to_moving : (4, 4) ndarray
            The pose.
        centre : (3,) ndarray
            The structure's centroid in the CT, LPS mm.

        Returns
        -------
        dict
            As ``result.json`` holds it.

        """
        basis = _beam_basis(cameras, fixed_to_moving, centre)
        shift = _half_widths(self.covariance[3:, 3:], basis)
        turn = np.degrees(_half_widths(self.covariance[:3, :3], basis))
        return {
            "covariance": self.covariance.tolist(),
            "level": 0.95,
            "along_mm": float(shift[2]),
            "across_mm": shift[:2].tolist(),
            "rotation_about_view_deg": float(turn[2]),
            "rotation_across_deg": turn[:2].tolist(),
            "directions": {"along": basis[2].tolist(), "across": basis[:2].tolist()},
        }

    def across_mm(self, cameras: Sequence[Camera], fixed_to_moving: np.ndarray, centre: np.ndarray) -> float:
        """Half width of the 95 % interval of the centroid along the least certain direction across the beams.

        cameras: of the views to count; the rest as :meth:`to_dict` takes it.
        """
        across = _beam_basis(cameras, fixed_to_moving, centre)[:2]
        return _widest(across @ self.covariance[3:, 3:] @ across.T)

    def of_points_mm(self, offsets: np.ndarray) -> float:
        """Root mean square over points of the half width of their 95 % intervals, along their least certain direction.

        offsets: (P, 3) mm in the CT, from the structure's centroid.
        """
        x, y, z = offsets.T
        zero = np.zeros_like(x)
        turns = np.stack([zero, z, -y, -z, zero, x, y, -x, zero], axis=1).reshape(-1, 3, 3)
        moves = np.concatenate(
            [turns, np.broadcast_to(np.eye(3), turns.shape)], axis=2
        )  # (P, 3, 6) mm per rad and mm
        return _widest(np.mean(moves @ self.covariance @ moves.transpose(0, 2, 1), axis=0))

    def contains(self, delta: np.ndarray, level: float = 0.95) -> bool:
        """Whether a perturbation (6,) lies inside the ellipsoid of the given probability."""
        return bool(delta @ np.linalg.solve(self.covariance, delta) <= chdtri(6, 1 - level))


def joint_covariance(problem: RigidProblem, state: State) -> np.ndarray:
    """Covariance of all free poses together at a problem's optimum, the uncertainty of free cameras included.

    Parameters
    ----------
    problem, state
        As the joint fit left them.

    Returns
    -------
    (6 F, 6 F) ndarray
        Of the perturbations, as in :class:`PoseUncertainty`, of the free poses in their order.

    References
    ----------
    K.-Y. Liang and S. Zeger, "Longitudinal data analysis using generalized linear models", Biometrika 73 (1986).

    """
    linear = (problem.linearise(state, n) for n in range(len(problem.views)))
    curvature, spread = score_statistics(problem, linear)
    unseen = np.tile(_UNSEEN, problem.size // 6)
    # The prior enters in the residual's own unit, so that it matters only where the images say nothing.
    noise = max(float(np.trace(spread) / max(np.trace(curvature), 1e-12)), LEAST_NOISE)
    prior = noise * (INFLATION / unseen) ** 2
    inverse = np.linalg.inv(curvature + np.diag(prior))
    covariance = INFLATION**2 * inverse @ (spread + np.diag(noise * prior)) @ inverse
    count = len(problem.free_poses)
    floor = np.array([np.radians(SYSTEMATIC_ROTATION_DEG)] * 3 + [SYSTEMATIC_TRANSLATION_MM] * 3) ** 2
    return covariance[: 6 * count, : 6 * count] + np.diag(np.tile(floor, count))


def pose_uncertainties(problem: RigidProblem, covariance: np.ndarray) -> dict[int, PoseUncertainty]:
    """Each free pose's part, by index of the structure, of the :func:`joint_covariance` (6 F, 6 F)."""
    return {
        k: PoseUncertainty(covariance[6 * n : 6 * n + 6, 6 * n : 6 * n + 6])
        for n, k in enumerate(problem.free_poses)
    }


def score_statistics(
    problem: RigidProblem, linearised: Iterable[Linearised]
) -> tuple[np.ndarray, np.ndarray]:
    """Curvature (P, P) of the images' cost at a problem's optimum, and the spread (P, P) of its scores by clusters.

    linearised: the problem's views there, in their order.
    """
    curvature = np.zeros((problem.size, problem.size))
    spread = np.zeros((problem.size, problem.size))
    for view, linear in zip(problem.views, linearised, strict=True):
        if not linear.blocks:
            continue  # it shows nothing that may move
        used = view.weight > 0
        columns = np.array([block.first + c for block in linear.blocks for c in range(6)], int)
        jacobian = np.zeros((len(columns), *used.shape), np.float32)
        for b, block in enumerate(linear.blocks):
            jacobian[(slice(6 * b, 6 * b + 6), *block.slices)] = block.jacobian
        weighted = jacobian * view.weight
        where = np.ix_(columns, columns)
        curvature[where] += weighted[:, used] @ jacobian[:, used].T
        sums = cluster_sums(weighted * linear.residual, PATCHES_PER_CLUSTER * view.contrast.size)
        spread[where] += sums @ sums.T
    return curvature, spread


def _widest(covariance: np.ndarray) -> float:
    """Half width of the 95 % interval along the least certain direction of a covariance (D, D)."""
    return float(NORMAL_95 * np.sqrt(np.linalg.eigvalsh(covariance)[-1]))


def _half_widths(covariance: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """(3,) of the 95 % intervals along the rows of an orthonormal basis (3, 3)."""
    return NORMAL_95 * np.sqrt(np.diag(basis @ covariance @ basis.T))


def _beam_basis(cameras: Sequence[Camera], fixed_to_moving: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """(3, 3) orthonormal rows in the CT, the last one along the views' common direction at a structure's centroid."""
    in_fixed = np.linalg.inv(fixed_to_moving) @ np.r_[centre, 1.0]
    directions = np.array([in_fixed[:3] - camera.source for camera in cameras])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return _basis_along(fixed_to_moving[:3, :3] @ _common_direction(directions))


def _common_direction(directions: np.ndarray) -> np.ndarray:
    """(3,) the mean of unit directions (N, 3), or, where they point too far apart, their principal axis."""
    mean = directions.mean(axis=0)
    if np.linalg.norm(mean) > COMMON_DIRECTION:
        return mean
    return np.linalg.eigh(directions.T @ directions)[1][:, -1]


def _basis_along(direction: np.ndarray) -> np.ndarray:
    """(3, 3) orthonormal rows, the last one along ``direction``."""
    last = direction / np.linalg.norm(direction)
    helper = np.eye(3)[int(np.argmin(np.abs(last)))]
    first = np.cross(helper, last)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(last, first), last])
