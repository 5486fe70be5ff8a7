"""From a simulated sequence to what a track of it is scored against."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import binary_erosion, find_objects

from PolyPoseLib.data.tracking.track_truth import TrackTruth
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.simulation.sequences import SimulatedSequence

POINTS = 500
"""Of every structure's surface, at most."""


def truth_of_sequence(sequence: SimulatedSequence) -> TrackTruth:
    """The truth of a sequence: poses, and points of the structures to measure errors at."""
    structures, options = sequence.structures, sequence.options
    return TrackTruth(
        names=structures.names,
        reference=sequence.reference,
        frames_per_second=sequence.frames_per_second,
        poses=sequence.poses,
        centroids=structures.centroids(sequence.ct.affine),
        points={
            name: surface_points(structures.labels, number, sequence.ct)
            for number, name in enumerate(structures.names, start=1)
        },
        cameras={view.name: view.camera for view in sequence.views},
        unseen=_unseen(sequence),
        seed=sequence.seed,
        description=f"{options.motion}, {options.frames} frames at {options.frames_per_second:g} per second",
    )


def surface_points(labels: np.ndarray, number: int, ct: Volume) -> np.ndarray:
    """Centres (N, 3) in LPS mm of a label's voxels that have a neighbour outside it, evenly thinned to POINTS."""
    box = find_objects(labels, max_label=number)[number - 1]
    inside = labels[box] == number
    surface = inside & ~np.asarray(binary_erosion(inside), dtype=bool)
    kji = np.argwhere(surface) + [side.start for side in box]
    chosen = np.linspace(0, len(kji) - 1, min(POINTS, len(kji))).round().astype(int)
    return ct.to_world(kji[chosen][:, ::-1])


def _unseen(sequence: SimulatedSequence) -> dict[str, tuple[int, ...]]:
    """Frames that a view does not show: blank ones, and those in whose place an earlier one was stored."""
    options = sequence.options
    found = {}
    for number, view in enumerate(sequence.views):
        images = {*options.blank.get(number, ()), *options.repeated.get(number, ())}
        frames = sorted(image - view.first for image in images if image >= view.first)
        if frames:
            found[view.name] = tuple(frames)
    return found
