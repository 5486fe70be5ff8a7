"""The benchmark's degraded cases: one simulated case per anatomy and seed; how much of a bone is covered."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from benchmark_cases import DISTANCES_MM, load_anatomy, parse_views
from scipy.ndimage import binary_dilation

from PolyPoseLib.io.samples import sample_named
from PolyPoseLib.simulation.degradations.anatomy import bone_points
from PolyPoseLib.simulation.degradations.degraded_case import DegradedCase, View
from PolyPoseLib.simulation.degradations.registry import degrade
from PolyPoseLib.simulation.simulate import (
    SimulatedCase,
    arc_angles,
    simulate_case,
    structures_centre,
    view_cameras,
)

CLEAN = "clean"
"""The kind of a case without any fault."""

COVERING_LINE = 0.7
"""Line integral of what lies over a bone from which on the bone counts as covered: half of the beam is gone."""


@lru_cache(maxsize=1)
def simulated(anatomy: str, views: str, seed: int, pixels: int) -> SimulatedCase:
    """The case that is degraded; the last one is kept."""
    ct, structures, labels, _ = load_anatomy(anatomy, structures_of(anatomy))
    count, arc = parse_views(views)
    to_detector, to_isocenter = DISTANCES_MM[anatomy]
    cameras = view_cameras(
        ct,
        arc_angles(count, arc),
        pixels,
        source_to_detector_mm=to_detector,
        source_to_isocenter_mm=to_isocenter,
        isocenter=structures_centre(structures, ct.affine),
    )
    return simulate_case(ct, structures, cameras=cameras, seed=seed, source_labels=labels)


def structures_of(anatomy: str) -> dict[str, list[int]]:
    """Structures that move, as the sample proposes them: few enough for hundreds of registrations."""
    return {name: list(labels) for name, labels in sample_named(anatomy).structures.items()}


def degraded_case(anatomy: str, views: str, seed: int, pixels: int, kind: str) -> DegradedCase:
    """A case of one kind; CLEAN is the case as it is."""
    case = simulated(anatomy, views, seed, pixels)
    return degrade(case, [] if kind == CLEAN else [kind], source_to_detector_mm=DISTANCES_MM[anatomy][0])


def covered_shares(degraded: DegradedCase) -> dict[str, float]:
    """Share (0 to 1) of each bone's silhouette that metal, leaves or paint cover, in the view where it is largest."""
    shares = {}
    for name in degraded.case.structures.names:
        points = bone_points(degraded.case, name)
        each = [_covered(view, points) for view in degraded.views]
        shares[name] = float(np.nanmax(each)) if np.isfinite(each).any() else float("nan")
    return shares


def _covered(view: View, points: np.ndarray) -> float:
    """Share of the silhouette of points (N, 3); NaN when none of it is in the picture."""
    shape = view.line.shape
    pixels = np.rint(view.camera.project(points)).astype(int)
    inside = ((pixels >= 0) & (pixels < [shape[1], shape[0]])).all(axis=1)
    silhouette = np.zeros(shape, bool)
    silhouette[pixels[inside, 1], pixels[inside, 0]] = True
    silhouette = binary_dilation(silhouette, iterations=2)
    covered = view.line - view.body > COVERING_LINE
    if view.leaves is not None:
        covered |= view.leaves < 0.5
    if view.blanked is not None:
        covered |= view.blanked
    return float(covered[silhouette].mean()) if silhouette.any() else float("nan")
