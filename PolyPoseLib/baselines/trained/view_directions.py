"""From where X-rays were taken, and whether other X-rays were taken from there as well."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera

TOLERANCE_DEG = 10.0
"""By which a view may differ from the one that a network was trained for: C-arms are set to about that."""


def directions_of(cameras: Sequence[Camera]) -> np.ndarray:
    """Unit vectors (V, 3) along the cameras' axes, LPS."""
    return np.stack([camera.axis for camera in cameras])


def matched_views(trained: np.ndarray, cameras: Sequence[Camera]) -> list[int]:
    """Which camera stands for each trained direction, whatever their order.

    Parameters
    ----------
    trained : (V, 3) array
        Directions that a network was trained for.
    cameras : Sequence[Camera]
        Of the study's X-rays.

    Raises
    ------
    InputError
        Another number of views, or a view that is farther than TOLERANCE_DEG from every trained one left.

    """
    if len(cameras) != len(trained):
        raise InputError(f"they were trained for {len(trained)} X-rays, but the study has {len(cameras)}")
    apart = np.degrees(np.arccos(np.clip(trained @ directions_of(cameras).T, -1, 1)))
    rows, columns = linear_sum_assignment(apart)
    worst = float(apart[rows, columns].max())
    if worst > TOLERANCE_DEG:
        raise InputError(
            f"they were trained for other view angles: one X-ray is {worst:.0f} degrees from the nearest of the "
            f"trained directions, where {TOLERANCE_DEG:g} are allowed"
        )
    return [int(column) for column in columns]
