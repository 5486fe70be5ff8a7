"""From where X-rays were taken, and whether other X-rays were taken from there as well."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera

TOLERANCE_DEG = 10.0
"""By which a view may differ from the one that a network was trained for: C-arms are set to about that."""

SOURCE_TOLERANCE_MM = 5.0
"""By which a source may lie, along any axis, outside of where training had it. A small LiftReg that was trained with
one place for each source was 3.6 mm off there, 3.8 to 6 mm with sources 4 to 8 mm nearer or views turned by a degree,
and 9 to 32 mm with sources 10 mm nearer, turned by 5 degrees, or shifted by 20 mm: worse than doing nothing."""


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


def sources_of(cameras: Sequence[Camera], middle: np.ndarray) -> np.ndarray:
    """(V, 3) where the cameras' sources are, LPS mm from the middle (3,) of the CT."""
    return np.stack([camera.source for camera in cameras]) - middle


def require_sources(trained: np.ndarray, sources: np.ndarray) -> None:
    """Refuse X-rays whose sources are not where those of the training were.

    Parameters
    ----------
    trained : (2, V, 3) array
        Least and largest coordinates of each view's source in training, as :func:`sources_of` gives them.
    sources : (V, 3) array
        Of the study, in the order of the training's.

    Raises
    ------
    InputError
        A source beyond SOURCE_TOLERANCE_MM.

    """
    beyond = np.maximum(trained[0] - sources, sources - trained[1]).max()
    if beyond > SOURCE_TOLERANCE_MM:
        raise InputError(
            f"they were trained for other places of the X-ray sources: one is {beyond:.0f} mm beyond those of the "
            f"training, seen from the CT's middle, where {SOURCE_TOLERANCE_MM:g} are allowed"
        )
