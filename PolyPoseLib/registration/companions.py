"""Bones that lie side by side, as ribs do, and therefore move alike.

Muscles and membranes between them let one move by little against the other, at both ends and in the middle; a rib that
the X-rays hardly show, or show as well in its neighbour's place, stays with its neighbours.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import KDTree

from PolyPoseLib.registration.articulations import Articulation

SIDE_MM = 30.0
"""Bones are side by side where they are at most so far apart."""

LEAST_SHARE = 0.55
"""Share of each of two companions that lies beside the other. Neighbouring ribs share 0.56 to 1, a rib and the shoulder
blade over it 0.4 to 0.5."""

SLIDE_MM = 5.0
"""How far two companions are expected to move against each other (standard deviation)."""

YIELDS_AT = 2.0
"""Standard deviations beyond which the prior hardly grows: the forearm's bones cross when the hand is turned."""

POINTS = 3
"""Along two companions, at which they stay together."""


def find_companions(clouds: Sequence[np.ndarray], joints: Sequence[Articulation] = ()) -> list[Articulation]:
    """Links between bones that lie side by side and have no joint.

    Parameters
    ----------
    clouds : sequence of (N, 3) ndarray
        Points of every bone, evenly picked, LPS mm.
    joints : sequence of Articulation
        Of the same bones.

    Returns
    -------
    list of Articulation
        POINTS of every pair, which together weigh as much as a joint.

    """
    trees = [KDTree(cloud, leafsize=16) for cloud in clouds]
    boxes = [(cloud.min(axis=0) - SIDE_MM, cloud.max(axis=0) + SIDE_MM) for cloud in clouds]
    jointed = {(joint.first, joint.second) for joint in joints}
    links = []
    for a in range(len(clouds)):
        for b in range(a + 1, len(clouds)):
            if (a, b) in jointed:
                continue
            if (boxes[a][0] > boxes[b][1]).any() or (boxes[b][0] > boxes[a][1]).any():
                continue
            distance, nearest = (np.asarray(each) for each in trees[b].query(clouds[a]))
            beside = distance <= SIDE_MM
            if beside.mean() < LEAST_SHARE:
                continue
            if (np.asarray(trees[a].query(clouds[b])[0]) <= SIDE_MM).mean() < LEAST_SHARE:
                continue
            middles = (clouds[a][beside] + clouds[b][nearest[beside]]) / 2
            links += [
                Articulation(a, b, point, SLIDE_MM, 1 / POINTS, YIELDS_AT, is_joint=False)
                for point in _spread(middles, POINTS)
            ]
    return links


def _spread(points: np.ndarray, count: int) -> list[np.ndarray]:
    """So many of the points (N, 3), far from each other, the one farthest from the middle first."""
    chosen = [points[np.linalg.norm(points - points.mean(axis=0), axis=1).argmax()]]
    while len(chosen) < count:
        away = np.min([np.linalg.norm(points - each, axis=1) for each in chosen], axis=0)
        chosen.append(points[away.argmax()])
    return chosen
