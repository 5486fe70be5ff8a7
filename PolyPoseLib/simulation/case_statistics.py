"""Numbers that say what a simulated case is like."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.simulation.motion import apply, structure_points

if TYPE_CHECKING:
    from PolyPoseLib.data.structures import Structures
    from PolyPoseLib.data.volume import Volume
    from PolyPoseLib.geometry.camera import Camera
    from PolyPoseLib.simulation.posed_ct import PosedCt


def case_statistics(
    ct: Volume, structures: Structures, poses: dict[str, np.ndarray], cameras: list[Camera], posed: PosedCt
) -> dict:
    """Rest TRE (mean and largest distance that voxels travel, mm), overlap, share of voxels in view, folds."""
    table = {}
    for name, points in structure_points(structures, ct.affine).items():
        fixed = apply(np.linalg.inv(poses[name]), points)
        travel = np.linalg.norm(fixed - points, axis=1)
        turn = np.degrees(np.arccos(np.clip((np.trace(poses[name][:3, :3]) - 1) / 2, -1, 1)))
        table[name] = {
            "rest_tre_mean_mm": float(travel.mean()),
            "rest_tre_max_mm": float(travel.max()),
            "rotation_deg": float(turn),
            "overlap": posed.overlap.get(name, 0.0),
            "outside_grid": _share_outside(fixed, posed),
            "in_view": [share_in_view(camera, fixed) for camera in cameras],
        }
    return {"structures": table, "folds_percent_outside_bones": posed.folds_percent}


def share_in_view(camera: Camera, points: np.ndarray) -> float:
    """Share (0 to 1) of points (N, 3) in LPS mm that fall onto the detector."""
    pixels = camera.project(points)
    inside = (pixels >= -0.5) & (pixels < np.array([camera.width, camera.height]) - 0.5)
    return float(inside.all(axis=1).mean())


def _share_outside(points: np.ndarray, posed: PosedCt) -> float:
    """Share (0 to 1) of fixed points (N, 3) in LPS mm beyond the posed CT's grid, which no X-ray shows."""
    kji = np.rint(apply(np.linalg.inv(posed.grid.affine), points)[:, ::-1])
    return float(1 - np.all((kji >= 0) & (kji < posed.grid.shape), axis=1).mean())
