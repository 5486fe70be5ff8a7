"""Two volumes that differ by a known rigid motion, given by a formula, for the directions of 3D/3D packages."""

import numpy as np
from scipy.spatial.transform import Rotation

from PolyPoseLib.baselines.volumes.pair import VolumePair

SPACING = 3.0
SHAPE = (40, 34, 46)
ORIGIN = np.array([-71.0, -40.0, -55.0])
CENTRE = ORIGIN + (np.array(SHAPE[::-1]) - 1) / 2 * SPACING

TRANSLATION = ([0.0, 0.0, 0.0], [5.0, -4.0, 3.0])
ROTATION = ([4.0, -6.0, 8.0], [0.0, 0.0, 0.0])
"""Rotation vector in degrees, shift in mm: no two components alike, so that no exchange or sign goes unseen."""


def moved_pair(motion, seed=0):
    """The pair, and the true field (k, j, i, 3) mm from fixed to moving points."""
    nothing, seen = np.zeros(SHAPE, np.float32), np.ones(SHAPE, bool)
    pair = VolumePair(nothing, nothing, ORIGIN, SPACING, seen)
    points = pair.points()
    moved = moved_points(points, motion)
    return (
        VolumePair(body(moved, seed), body(points, seed), ORIGIN, SPACING, seen),
        moved - points,
    )


def moved_points(points, motion):
    rotation = Rotation.from_rotvec(motion[0], degrees=True).as_matrix()
    return (points - CENTRE) @ rotation.T + CENTRE + motion[1]


def body(points, seed):
    """HU of a soft ellipsoid with bones of all sizes in it, all over, unlike in every direction."""
    rng = np.random.default_rng(seed)
    x = (points - CENTRE) / [52.0, 36.0, 44.0]
    hu = np.full(points.shape[:3], -1000.0)
    hu += 1040.0 / (1 + np.exp((np.linalg.norm(x, axis=-1) - 1) * 16))
    for _ in range(45):
        place = rng.normal(size=3)
        place *= rng.uniform(0, 0.85) / np.linalg.norm(place)
        size = rng.uniform(4.0, 9.0)
        away = (points - CENTRE - place * [52.0, 36.0, 44.0]) / size
        hu += rng.uniform(-300, 900) * np.exp(-0.5 * (away**2).sum(-1))
    return hu.astype(np.float32)


def inner(pair):
    """Where the body has something to see, away from its surface and the grid's: (k, j, i) bool."""
    return np.linalg.norm((pair.points() - CENTRE) / [52.0, 36.0, 44.0], axis=-1) < 0.75


def errors(field, pair, truth):
    """Mean error in mm within the body of the field found, and of no motion at all."""
    inside = inner(pair)
    found = field.sample(pair.points()[inside])
    return (
        np.linalg.norm(found - truth[inside], axis=1).mean(),
        np.linalg.norm(truth[inside], axis=1).mean(),
    )
