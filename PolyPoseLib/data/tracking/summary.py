"""A track in a few numbers, for people."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.tracking.track import Track

MOST_COMPARED = 500
"""Frames that are compared with each other, evenly spread: the time grows with their square."""


@dataclass(frozen=True)
class StructureSummary:
    """One structure.

    Attributes
    ----------
    name
        Of the structure.
    lost
        Frames in which it was not found.
    doubtful
        Frames in which its pose is flagged as uncertain, lost ones among them.
    rotation_deg
        Range of motion: the largest rotation between any two frames, relative to the reference (of the reference
        itself, in the rig's world); NaN with fewer than two frames.
    translation_mm
        The largest distance between the places of its centroid in any two frames, likewise.
    residual
        Median disagreement with the X-rays.

    """

    name: str
    lost: int
    doubtful: int
    rotation_deg: float
    translation_mm: float
    residual: float


def summary_of(track: Track) -> tuple[StructureSummary, ...]:
    """Every structure of a track, in its order."""
    found = np.array([[source != "none" for source in frame.sources] for frame in track.frames])
    poses = track.poses
    reference = track.names.index(track.reference)
    rows = []
    for k, name in enumerate(track.names):
        seen = found[:, k] & np.isfinite(poses[:, k]).all(axis=(1, 2))
        if k != reference:
            seen &= found[:, reference] & np.isfinite(poses[:, reference]).all(axis=(1, 2))
        motions = np.linalg.inv(poses[seen, k])
        if k != reference:
            motions = poses[seen, reference] @ motions
        residuals = np.array([frame.residuals[k] for frame in track.frames])
        known = residuals[np.isfinite(residuals)]
        rows.append(
            StructureSummary(
                name=name,
                lost=int(np.count_nonzero(~found[:, k])),
                doubtful=int(np.count_nonzero(track.doubtful[:, k] | ~found[:, k])),
                rotation_deg=_largest_rotation(motions),
                translation_mm=_largest_distance(motions, track.centroids[k]),
                residual=float(np.median(known)) if len(known) else float("nan"),
            )
        )
    return tuple(rows)


def _chosen(motions: np.ndarray) -> np.ndarray:
    """At most MOST_COMPARED of the motions (N, 4, 4)."""
    if len(motions) <= MOST_COMPARED:
        return motions
    return motions[np.linspace(0, len(motions) - 1, MOST_COMPARED).round().astype(int)]


def _largest_rotation(motions: np.ndarray) -> float:
    """Degrees between the two most different of the motions (N, 4, 4)."""
    if len(motions) < 2:
        return float("nan")
    quaternions = Rotation.from_matrix(_chosen(motions)[:, :3, :3]).as_quat()
    cosine = np.abs(quaternions @ quaternions.T).clip(max=1.0)
    return float(np.degrees(2 * np.arccos(cosine.min())))


def _largest_distance(motions: np.ndarray, point: np.ndarray) -> float:
    """Millimetres between the two places of a point (3,) that are farthest apart."""
    if len(motions) < 2:
        return float("nan")
    chosen = _chosen(motions)
    places = chosen[:, :3, :3] @ point + chosen[:, :3, 3]
    return float(np.linalg.norm(places[:, None] - places[None], axis=-1).max())
