"""Contours around masks hold exactly the centres that the masks hold, by the crossing rule and by filling."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter, label

from PolyPoseLib.geometry.contours import filled
from PolyPoseLib.geometry.mask_contours import outlines

SHAPE = (19, 23)
Y, X = np.mgrid[: SHAPE[0], : SHAPE[1]]


def crossed(polygons) -> np.ndarray:
    """Whether an odd number of edges lies to the right of each centre."""
    inside = np.zeros(SHAPE, bool)
    for polygon in polygons:
        for (x0, y0), (x1, y1) in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
            if y0 != y1:
                inside ^= ((y0 > Y) != (y1 > Y)) & ((x1 - x0) * (Y - y0) / (y1 - y0) + x0 > X)
    return inside


@pytest.mark.parametrize("seed", range(30))
def test_every_mask_comes_back(seed):
    rng = np.random.default_rng(seed)
    noise = gaussian_filter(rng.normal(size=SHAPE), (0.0, 0.7, 1.5)[seed % 3])
    mask = noise > np.quantile(noise, rng.uniform(0.05, 0.9))
    found = outlines(mask)
    assert np.array_equal(crossed(found), mask)
    assert np.array_equal(filled(found, SHAPE), mask)
    assert len(found) == label(mask)[1]
    points = np.concatenate(found)
    assert np.array_equal(2 * points, np.rint(2 * points))
    assert (np.abs(points - np.rint(points)).max(axis=1) == 0.5).all()


def test_holes_within_regions_within_holes():
    radius = np.hypot(X - 11, Y - 9)
    mask = (radius < 8.6) & ~((radius > 2.4) & (radius < 5.2))
    mask[9, 11] = False
    found = outlines(mask)
    assert len(found) == 2
    assert np.array_equal(filled(found, SHAPE), mask)


def test_borders_single_pixels_and_nothing():
    assert outlines(np.zeros(SHAPE, bool)) == []
    (whole,) = outlines(np.ones(SHAPE, bool))
    assert len(whole) == 8
    (single,) = outlines(np.eye(1, dtype=bool))
    assert np.array_equal(single, [[0, -0.5], [0.5, 0], [0, 0.5], [-0.5, 0]])
    assert len(outlines(np.eye(3, dtype=bool))) == 3


def test_many_holes_are_joined():
    mask = np.ones(SHAPE, bool)
    mask[1:-1:2, 1:-1:2] = False
    found = outlines(mask)
    assert len(found) == 1
    assert np.array_equal(filled(found, SHAPE), mask)
