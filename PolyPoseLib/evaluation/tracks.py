"""A track against the truth of a simulated sequence, as one table."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.stats import chi2, norm

from PolyPoseLib.data.tracking.track import Track
from PolyPoseLib.data.tracking.track_truth import TrackTruth
from PolyPoseLib.evaluation.calibration import LEVEL
from PolyPoseLib.evaluation.track_errors import PoseErrors
from PolyPoseLib.evaluation.track_match import require_truth_of
from PolyPoseLib.geometry.rigid import rigid_inverse

LOST_MM = 3.0
"""A structure is lost in a frame where its points are off by more, in the root mean square."""

NONE = "none"
"""Source of a pose that was not found."""

AXES = ("turn_x", "turn_y", "turn_z", "x", "y", "z")
"""Of a pose's covariance, in the CT's LPS."""


def score_track(track: Track, truth: TrackTruth) -> dict[str, Any]:
    """Score a track against the truth.

    Parameters
    ----------
    track : Track
        Of the same sequence; it may have fewer structures and fewer frames.
    truth : TrackTruth
        Of the simulation.

    Returns
    -------
    dict[str, Any]
        A table that json can write: "structures" {name: see `_structure`}, "relative" {name: {"rotation_deg",
        "centroid_mm"} of its motion against the reference's, each {"rms", "median", "worst"}}, and "summary"
        {"frames", "rms_mm" of points, "centroid_rms_mm", "rotation_rms_deg", "worst_mm", "worst_deg",
        "lost_and_said", "lost_in_silence", "false_alarms": counts of a structure in a frame, "coverage" of the six-
        dimensional regions, "cpu_seconds_per_frame", "smoothed"}, all of them over all structures, and "distrust".

    Raises
    ------
    InputError
        The track has a structure, a frame or a camera that the truth does not have, or another frame rate.

    """
    require_truth_of(track, truth)
    structures = {name: _structure(track, truth, name) for name in track.names}
    return {
        "structures": structures,
        "relative": _relative_motion(track, truth),
        "summary": _summary(track, structures),
        "distrust": list(track.distrust),
    }


def _structure(track: Track, truth: TrackTruth, name: str) -> dict[str, Any]:
    """Scores of one structure.

    Returns
    -------
    dict[str, Any]
        "frames", "none": how many, and of these without any pose; "tre_mm" of points, "centroid_mm", "rotation_deg":
        {"rms", "median", "worst"} of frames with a pose; "relied_on": "tre_mm" and so on of those that are not flagged;
        "lost_and_said", "lost_in_silence", "false_alarms": numbers of frames that are off by more than LOST_MM or have
        no pose, and of flags without need; "coverage": see `_coverage`; "beams" {view: {"along_mm", "across_mm",
        "along_coverage"}}.

    """
    here, there = track.names.index(name), truth.names.index(name)
    given = _has_pose(track, here)
    flagged = track.doubtful[:, here]
    found, true = track.poses[given, here], truth.poses[track.numbers[given], there]
    # The covariances are about the centroid of what was tracked, of which the truth may hold more.
    errors = PoseErrors.of(true, found, track.centroids[here], truth.points[name], truth.cameras)
    covariances = track.covariances[given, here]
    off = np.ones(len(given), dtype=bool)
    off[given] = errors.target > LOST_MM
    said = flagged | ~given
    numbers = track.numbers
    relied = ~flagged[given]
    return {
        "frames": len(given),
        "none": int((~given).sum()),
        **_spreads(errors, np.ones(len(relied), dtype=bool)),
        "relied_on": _spreads(errors, relied),
        "lost_and_said": numbers[off & said].tolist(),
        "lost_in_silence": numbers[off & ~said].tolist(),
        "false_alarms": numbers[~off & said].tolist(),
        "coverage": _coverage(errors, covariances),
        "beams": _beams(errors, covariances, truth),
    }


def _has_pose(track: Track, structure: int) -> np.ndarray:
    """(F,) frames in which a structure was found."""
    found = [frame.sources[structure] != NONE for frame in track.frames]
    return np.array(found) & np.isfinite(track.poses[:, structure]).all(axis=(1, 2))


def _spreads(errors: PoseErrors, chosen: np.ndarray) -> dict[str, dict[str, float]]:
    """Root mean square, median and worst of the chosen (F,) frames' errors."""
    return {
        "tre_mm": spread(errors.target[chosen]) | {"worst_point": _largest(errors.target_worst[chosen])},
        "centroid_mm": spread(errors.centroid_mm[chosen]),
        "rotation_deg": spread(errors.rotation_deg[chosen]),
    }


def _coverage(errors: PoseErrors, covariances: np.ndarray) -> dict[str, Any]:
    """Share of frames whose errors lie in the intervals of LEVEL that covariances (F, 6, 6) give.

    Returns
    -------
    dict[str, Any]
        "pose": of the six-dimensional region; "rotation", "translation": of the two three-dimensional ones; "axes": of
        the interval along each of AXES; "frames": how many there are. NaN where there are none.

    """
    parts = {"pose": slice(0, 6), "rotation": slice(0, 3), "translation": slice(3, 6)}
    inside = {
        part: held(errors.perturbations[:, where], covariances[:, where, where])
        for part, where in parts.items()
    }
    axes = [held(errors.perturbations[:, n : n + 1], covariances[:, n : n + 1, n : n + 1]) for n in range(6)]
    return {
        **{part: _mean(each) for part, each in inside.items()},
        "axes": {axis: _mean(each) for axis, each in zip(AXES, axes, strict=True)},
        "frames": len(covariances),
    }


def held(errors: np.ndarray, covariances: np.ndarray) -> np.ndarray:
    """Which errors (F, D) lie in the region of LEVEL of normal laws with covariances (F, D, D).

    A covariance that is none, with a variance of 0 or below or a number that is not finite, holds nothing.
    """
    found = np.zeros(len(errors), dtype=bool)
    limit = chi2.ppf(LEVEL, errors.shape[1])
    for n, (error, covariance) in enumerate(zip(errors, covariances, strict=True)):
        if not np.isfinite(covariance).all():
            continue
        values, axes = np.linalg.eigh((covariance + covariance.T) / 2)
        found[n] = values[0] > 0 and ((axes.T @ error) ** 2 / values).sum() <= limit
    return found


def _beams(errors: PoseErrors, covariances: np.ndarray, truth: TrackTruth) -> dict[str, dict[str, float]]:
    """Root mean squares along and across the ray of each camera, and how often the interval along it holds."""
    # A displacement of the bone by d in the rig moves the pose's points by -R d in the CT.
    directions = np.einsum("fij,vfj->vfi", errors.found, errors.beams)
    table = {}
    for view, (name, along) in enumerate(zip(truth.cameras, directions, strict=True)):
        variance = np.einsum("fi,fij,fj->f", along, covariances[:, 3:, 3:], along)
        shift = np.einsum("fi,fi->f", along, errors.perturbations[:, 3:])
        table[name] = {
            "along_mm": _rms(errors.along_beams[view]),
            "across_mm": _rms(errors.across_beams[view]),
            "along_coverage": _mean(
                np.abs(shift) <= norm.ppf((1 + LEVEL) / 2) * np.sqrt(np.maximum(variance, 0))
            ),
        }
    return table


def _relative_motion(track: Track, truth: TrackTruth) -> dict[str, Any]:
    """Errors of every structure's place as seen from the reference, in frames where both have a pose."""
    if track.reference not in track.names:
        return {}
    base, true_base = track.names.index(track.reference), truth.names.index(track.reference)
    table = {}
    for name in track.names:
        if name == track.reference:
            continue
        here, there = track.names.index(name), truth.names.index(name)
        given = _has_pose(track, here) & _has_pose(track, base)
        numbers = track.numbers[given]
        found = track.poses[given, here] @ rigid_inverse(track.poses[given, base])
        true = truth.poses[numbers, there] @ rigid_inverse(truth.poses[numbers, true_base])
        errors = PoseErrors.of(true, found, track.centroids[here], truth.points[name], {})
        table[name] = _spreads(errors, np.ones(len(true), dtype=bool))
    return table


def _summary(track: Track, structures: dict[str, Any]) -> dict[str, Any]:
    """Over all structures."""
    each = list(structures.values())
    frames = [s["frames"] - s["none"] for s in each]
    return {
        "frames": len(track.frames),
        "rms_mm": _pooled([s["tre_mm"]["rms"] for s in each], frames),
        "centroid_rms_mm": _pooled([s["centroid_mm"]["rms"] for s in each], frames),
        "rotation_rms_deg": _pooled([s["rotation_deg"]["rms"] for s in each], frames),
        "worst_mm": _largest(np.array([s["tre_mm"]["worst"] for s in each])),
        "worst_deg": _largest(np.array([s["rotation_deg"]["worst"] for s in each])),
        **{
            key: sum(len(s[key]) for s in each)
            for key in ("lost_and_said", "lost_in_silence", "false_alarms")
        },
        "coverage": _mean_of([s["coverage"]["pose"] for s in each], frames),
        "cpu_seconds_per_frame": float(np.mean([frame.cpu_seconds for frame in track.frames])),
        "smoothed": track.smoothed,
    }


def spread(errors: np.ndarray) -> dict[str, float]:
    """Root mean square, median and worst of errors (F,); NaN of none."""
    if not len(errors):
        return dict.fromkeys(("rms", "median", "worst"), float("nan"))
    return {"rms": _rms(errors), "median": float(np.median(errors)), "worst": float(errors.max())}


def _rms(errors: np.ndarray) -> float:
    return float(np.sqrt(np.mean(errors**2))) if len(errors) else float("nan")


def _mean(values: np.ndarray) -> float:
    return float(np.mean(values)) if len(values) else float("nan")


def _largest(values: np.ndarray) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.max()) if len(finite) else float("nan")


def _pooled(roots: list[float], counts: list[int]) -> float:
    """The root mean square of errors in groups, from those of the groups."""
    return float(np.sqrt(_mean_of([root**2 for root in roots], counts)))


def _mean_of(values: list[float], counts: list[int]) -> float:
    """The mean over groups of these sizes; empty ones do not count."""
    pairs = [(value, count) for value, count in zip(values, counts, strict=True) if count]
    total = sum(count for _, count in pairs)
    return sum(value * count for value, count in pairs) / total if total else float("nan")
