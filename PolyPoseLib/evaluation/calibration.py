"""Whether a pose's error lies inside the interval that was given with it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from PolyPoseLib.geometry.rigid import rigid_inverse

LEVEL = 0.95
"""Probability of the intervals that a result states."""


def interval_ratios(
    true: np.ndarray, found: np.ndarray, centroid: np.ndarray, uncertainty: Mapping[str, Any]
) -> dict[str, float]:
    """Errors of a pose over the half widths of its 95 % intervals; at most 1 means inside.

    Parameters
    ----------
    true : (4, 4) array
        Fixed to moving.
    found : (4, 4) array
        Fixed to moving.
    centroid : (3,) array
        Of the structure in the CT, LPS mm.
    uncertainty : Mapping[str, Any]
        As :class:`PolyPoseLib.data.result.StructureResult` has it.

    Returns
    -------
    dict[str, float]
        "along", "across_1", "across_2": of the centroid's place; "turn_about_view", "turn_across_1",
        "turn_across_2": of the rotation; "pose": all six at once, the root of the Mahalanobis distance over its
        95 % quantile.

    """
    error = found @ rigid_inverse(true)
    rotation = Rotation.from_matrix(error[:3, :3]).as_rotvec()
    shift = error[:3, :3] @ centroid + error[:3, 3] - centroid
    across, along = (
        np.array(uncertainty["directions"]["across"]),
        np.array(uncertainty["directions"]["along"]),
    )
    covariance = np.array(uncertainty["covariance"])
    delta = np.r_[rotation, shift]
    distance = float(delta @ np.linalg.solve(covariance, delta))
    ratios = {
        "along": along @ shift / uncertainty["along_mm"],
        "turn_about_view": np.degrees(along @ rotation) / uncertainty["rotation_about_view_deg"],
        "pose": np.sqrt(distance / chi2.ppf(LEVEL, 6)),
    }
    for n in (0, 1):
        ratios[f"across_{n + 1}"] = across[n] @ shift / uncertainty["across_mm"][n]
        ratios[f"turn_across_{n + 1}"] = (
            np.degrees(across[n] @ rotation) / uncertainty["rotation_across_deg"][n]
        )
    return {name: float(abs(value)) for name, value in ratios.items()}
