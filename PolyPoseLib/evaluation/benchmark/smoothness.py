"""How smooth a motion is: folds and the spread of its Jacobian determinant over the CT's own voxels.

Systems give their fields on grids of different spacing, and a coarse grid hides folds: every field is therefore
interpolated to the same voxels first, slab by slab, so that a whole CT's vectors are never in memory.
"""

from __future__ import annotations

import numpy as np

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.evaluation import metrics
from PolyPoseLib.warp.dense import jacobian_determinant
from PolyPoseLib.warp.field_grids import field_on

_VOXELS_AT_ONCE = 1 << 21


def smoothness(field: DisplacementField, grid: Volume) -> dict[str, float | None]:
    """Folds and the standard deviation of ln |J| of a field over a grid's voxels.

    Parameters
    ----------
    field : DisplacementField
        Fixed to moving.
    grid : Volume
        Two voxels or more along every axis; the CT.

    Returns
    -------
    dict
        "folds_percent": voxels whose Jacobian determinant, by central differences between voxels, is 0 or less;
        "sd_log_jacobian": over the other voxels, no unit, None when there are none.

    """
    folded = count = 0
    mean = squares = 0.0
    layers = max(_VOXELS_AT_ONCE // (grid.shape[1] * grid.shape[2]), 1)
    for start in range(0, grid.shape[0], layers):
        stop = min(start + layers, grid.shape[0])
        determinant = _determinant(field, grid, start, stop)
        folded += round(metrics.fold_percentage(determinant) * determinant.size / 100)
        logs = np.log(determinant[determinant > 0].astype(np.float64))
        if not logs.size:
            continue
        # T. Chan, G. Golub and R. LeVeque, "Algorithms for computing the sample variance", Am. Statistician 1983.
        shift, total = float(logs.mean()) - mean, count + logs.size
        squares += float(logs.var()) * logs.size + shift**2 * count * logs.size / total
        mean += shift * logs.size / total
        count = total
    return {
        "folds_percent": 100.0 * folded / grid.voxels.size,
        "sd_log_jacobian": float(np.sqrt(squares / count)) if count else None,
    }


def _determinant(field: DisplacementField, grid: Volume, start: int, stop: int) -> np.ndarray:
    """Jacobian determinant of layers start to stop of a grid, by differences that know the layers around them."""
    low, high = max(start - 1, 0), min(stop + 1, grid.shape[0])
    affine = grid.affine.copy()
    affine[:3, 3] += affine[:3, 2] * low
    part = field_on(field, affine, (high - low, *grid.shape[1:]))
    return jacobian_determinant(part)[start - low : stop - low]
