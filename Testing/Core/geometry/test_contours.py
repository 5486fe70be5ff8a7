"""Closed contours filled on pixels, against the definition: an odd number of edges to the right of a centre."""

import numpy as np
import pytest

from PolyPoseLib.geometry.contours import ON_CONTOUR, filled, row_crossings

SHAPE = (19, 23)
Y, X = np.mgrid[: SHAPE[0], : SHAPE[1]]


def oracle(polygons) -> tuple[np.ndarray, np.ndarray]:
    """Whether each centre is inside, and its distance from the nearest edge."""
    inside, apart = np.zeros(SHAPE, bool), np.full(SHAPE, np.inf)
    for polygon in polygons:
        for (x0, y0), (x1, y1) in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
            if (x0, y0) == (x1, y1):
                continue
            with np.errstate(divide="ignore", invalid="ignore"):
                inside ^= ((y0 > Y) != (y1 > Y)) & ((x1 - x0) * (Y - y0) / (y1 - y0) + x0 > X)
            share = ((X - x0) * (x1 - x0) + (Y - y0) * (y1 - y0)) / ((x1 - x0) ** 2 + (y1 - y0) ** 2)
            share = np.clip(share, 0, 1)
            apart = np.minimum(apart, np.hypot(x0 + share * (x1 - x0) - X, y0 + share * (y1 - y0) - Y))
    return inside, apart


@pytest.mark.parametrize("seed", range(20))
def test_pixels_are_inside_an_odd_number_of_contours(seed):
    rng = np.random.default_rng(seed)
    polygons = [rng.uniform(-6, 28, (rng.integers(1, 12), 2)) for _ in range(rng.integers(1, 4))]
    expected, apart = oracle(polygons)
    sure = apart > 10 * ON_CONTOUR
    assert np.array_equal(filled(polygons, SHAPE)[sure], expected[sure])


@pytest.mark.parametrize("seed", range(5))
def test_contours_through_centres_hold_them_whatever_their_direction(seed):
    rng = np.random.default_rng(seed)
    polygon = rng.integers(0, 19, (rng.integers(1, 7), 2)).astype(float)
    expected, apart = oracle([polygon])
    on = apart < 1e-9 if len(polygon) > 1 else (polygon[0, 0] == X) & (polygon[0, 1] == Y)
    shaken = polygon + rng.uniform(-1, 1, polygon.shape) * ON_CONTOUR / 10
    clear = on | (apart > 10 * ON_CONTOUR)
    for each in (polygon, polygon[::-1], shaken):
        assert np.array_equal(filled([each], SHAPE)[clear], (expected | on)[clear])


def test_a_hole_and_a_keyhole_are_one():
    angles = np.linspace(0, 2 * np.pi, 2000)
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    outer, inner = 8.3 * circle + [11.21, 9.13], 3.4 * circle + [11.21, 9.13]
    keyhole = np.concatenate([outer, inner[::-1]])
    hole = filled([outer, inner], SHAPE)
    assert np.array_equal(filled([keyhole], SHAPE), hole)
    radius = np.hypot(X - 11.21, Y - 9.13)
    assert np.array_equal(hole, (radius < 8.3) & (radius > 3.4))


def test_the_stated_work_is_no_less_than_what_is_done():
    polygon = np.array([[0.0, -1e12], [3.0, 1e12], [5.0, 3.0]])
    assert SHAPE[0] <= row_crossings([polygon], SHAPE[0]) < 4 * SHAPE[0]
    assert filled([polygon], SHAPE).shape == SHAPE
