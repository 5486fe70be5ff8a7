"""What fills hollow organs: contrast medium in bladder and vessel, gas in the bowel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter

from PolyPoseLib.data.volume import WATER_ATTENUATION_PER_MM, hounsfield_to_attenuation
from PolyPoseLib.simulation.degradations.anatomy import bone_points, bones_of_kind, excess_lines, soft_tissue
from PolyPoseLib.simulation.degradations.degraded_case import DegradedCase
from PolyPoseLib.simulation.motion import bone_kind

BLADDER_HU, VESSEL_HU = 900.0, 1100.0
"""Excess over water of iodine in a filled bladder, and in a vessel during an injection."""

BLADDER_SEMIAXES_MM = (36.0, 30.0, 28.0)
VESSEL_RADIUS_MM = 11.0


def contrast(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """Contrast medium in the bladder where there is a pelvis, and in the great vessel before the spine."""
    case = degraded.case
    points = _soft_points(degraded)
    share = np.zeros(len(points), np.float32)
    hips = [name for name in case.structures.names if _is_pelvic(name)]
    if hips:
        bone = np.concatenate([bone_points(case, name) for name in hips])
        low, high = np.quantile(bone, 0.02, axis=0), np.quantile(bone, 0.98, axis=0)
        middle = low + (high - low) * [0.5, 0.3, 0.3] + rng.uniform(-6, 6, 3)
        inside = (((points - middle) / BLADDER_SEMIAXES_MM) ** 2).sum(1) < 1
        share[inside] = BLADDER_HU / 1000
    share[_near_curve(points, _vessel(degraded), VESSEL_RADIUS_MM)] = VESSEL_HU / 1000
    return _added(degraded, share * WATER_ATTENUATION_PER_MM)


def bowel_gas(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """A dozen pockets of gas in soft tissue before the spine, in chains as in the colon."""
    points = _soft_points(degraded)
    spine = np.concatenate([bone_points(degraded.case, n) for n in bones_of_kind(degraded.case, "spine")])
    before = points[:, 1] < np.quantile(spine[:, 1], 0.1) - 10
    allowed = points[before] if before.any() else points
    gas = np.zeros(len(points), bool)
    for _ in range(4):
        at = allowed[rng.integers(len(allowed))].copy()
        for _ in range(4):
            axes = rng.uniform(9, 24, 3)
            gas |= (((points - at) / axes) ** 2).sum(1) < 1
            at += rng.uniform(-32, 32, 3) * [1, 0.3, 1]
    mu = hounsfield_to_attenuation(degraded.case.fixed_ct.voxels)[soft_tissue(degraded.case)]
    return _added(degraded, np.where(gas, -mu, 0).astype(np.float32))


def _added(degraded: DegradedCase, excess: np.ndarray) -> DegradedCase:
    """The case with additional attenuation (N,) in 1/mm of its voxels of soft tissue in every beam."""
    volume = np.zeros(degraded.case.fixed_ct.shape, np.float32)
    volume[soft_tissue(degraded.case)] = excess
    spacing = degraded.case.ct.spacing[::-1]
    volume = gaussian_filter(volume, 1.0 / spacing, mode="nearest")  # walls are 1 mm thick
    lines = excess_lines(degraded.case, volume, [view.camera for view in degraded.views])
    return degraded.with_views(
        lambda view, number: replace(view, line=np.maximum(view.line + lines[number], 0))
    )


def _soft_points(degraded: DegradedCase) -> np.ndarray:
    """Centres (N, 3) in LPS mm of all voxels of soft tissue."""
    kji = np.argwhere(soft_tissue(degraded.case))
    return degraded.case.fixed_ct.to_world(kji[:, ::-1])


def _is_pelvic(name: str) -> bool:
    """Whether a structure's name is that of a hip bone or the pelvis."""
    return bone_kind(name) == "other" and any(word in name.lower() for word in ("pelvis", "hip", "sacrum"))


def _vessel(degraded: DegradedCase) -> np.ndarray:
    """Points (N, 3) on a line before the spine, on its left: the aorta and the left iliac artery."""
    case = degraded.case
    spine = np.concatenate([bone_points(case, name) for name in bones_of_kind(case, "spine")])
    heights = np.arange(spine[:, 2].min(), spine[:, 2].max(), 6.0)
    curve = []
    for height in heights:
        here = spine[np.abs(spine[:, 2] - height) < 6]
        if len(here):
            front = np.quantile(here[:, 1], 0.03) - VESSEL_RADIUS_MM - 4
            curve.append([np.median(here[:, 0]) + 8.0, front, height])
    lowest = np.array(curve[0])
    branch = [lowest + step * np.array([0.55, -0.1, -0.85]) for step in np.arange(90.0, 0, -6)]
    return np.array([*branch, *curve])


def _near_curve(points: np.ndarray, curve: np.ndarray, radius: float) -> np.ndarray:
    """Which points (N, 3) lie within a radius of a curve's points (M, 3)."""
    from scipy.spatial import KDTree

    return KDTree(curve).query(points, distance_upper_bound=radius)[0] <= radius
