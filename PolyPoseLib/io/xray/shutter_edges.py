"""Edges in an X-ray that could be a collimator's or a shutter's: straight lines and circles, by vote and robust fit."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

EDGE_BLUR = 1.2
"""Standard deviation in pixels of the Gaussian whose derivatives find edges."""

STANDS_OUT = 1.8
"""Gradient of an edge over the mean gradient around it: whatever the contrast, an edge is the steepest thing near."""

FAINTEST = 0.006
"""Gradient below which nothing is an edge, in shares of the grey range a pixel."""

NEAR = 1.5
"""Distance in pixels within which an edge point lies on a fitted line or circle."""

ALIGNED = np.cos(np.radians(20.0))
"""Agreement of an edge point's normal with that of the line or circle it lies on."""


@dataclass(frozen=True)
class EdgePoints:
    """Points on edges, one pixel wide.

    Attributes
    ----------
    place
        (N, 2) x and y in pixels from the image's middle.
    normal
        (N, 2) unit vectors across the edge.
    shape
        (H, W) of the image.

    """

    place: np.ndarray
    normal: np.ndarray
    shape: tuple[int, int]


@dataclass(frozen=True, eq=False)
class Line:
    """The half-plane `normal . place <= offset`, which an edge bounds; pixels from the image's middle."""

    normal: np.ndarray
    offset: float

    def beyond(self, place: np.ndarray) -> np.ndarray:
        """How far (...) places (..., 2) lie beyond the line, in pixels; negative within."""
        return place @ self.normal - self.offset

    def outward(self, place: np.ndarray) -> np.ndarray:
        """Directions (..., 2) that lead out at places (..., 2)."""
        return np.broadcast_to(self.normal, place.shape)

    def border(self, shape: tuple[int, int]) -> np.ndarray:
        """Places (M, 2), one a pixel, on the part of the line that lies in the image."""
        reach = np.hypot(*shape) / 2
        along = np.arange(-reach, reach + 1)[:, None] * np.array([-self.normal[1], self.normal[0]])
        return _within(along + self.offset * self.normal, shape)

    def turned(self) -> Line:
        """The other side of the same line."""
        return Line(-self.normal, -self.offset)


@dataclass(frozen=True, eq=False)
class Circle:
    """The disc around a centre (2,) in pixels from the image's middle."""

    centre: np.ndarray
    radius: float

    def beyond(self, place: np.ndarray) -> np.ndarray:
        """How far (...) places (..., 2) lie outside the circle, in pixels; negative within."""
        return np.linalg.norm(place - self.centre, axis=-1) - self.radius

    def outward(self, place: np.ndarray) -> np.ndarray:
        """Directions (..., 2) that lead out at places (..., 2)."""
        away = place - self.centre
        return away / np.maximum(np.linalg.norm(away, axis=-1, keepdims=True), 1e-9)

    def border(self, shape: tuple[int, int]) -> np.ndarray:
        """Places (M, 2), one a pixel, on the part of the circle that lies in the image."""
        angle = np.linspace(0, 2 * np.pi, max(int(2 * np.pi * self.radius), 8), endpoint=False)
        ring = self.centre + self.radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        return _within(ring, shape)


Edge = Line | Circle


def places(shape: tuple[int, int]) -> np.ndarray:
    """Coordinates (H, W, 2), x and y, of all pixels, from the image's middle."""
    y, x = np.mgrid[: shape[0], : shape[1]].astype(np.float64)
    return np.stack([x - (shape[1] - 1) / 2, y - (shape[0] - 1) / 2], axis=-1)


def sampled(values: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Values (...) of an image (H, W) at places (..., 2), linear between pixels, the nearest pixel's outside."""
    rows = place[..., 1] + (values.shape[0] - 1) / 2
    columns = place[..., 0] + (values.shape[1] - 1) / 2
    return ndimage.map_coordinates(values, [rows, columns], order=1, mode="nearest")


def edge_points(values: np.ndarray) -> EdgePoints:
    """Find the crests of the gradient that stand out from what is around them.

    Parameters
    ----------
    values
        (H, W), scaled so that the image's grey range is about 1.

    """
    shape = (values.shape[0], values.shape[1])
    smooth = functools.partial(ndimage.gaussian_filter1d, sigma=EDGE_BLUR, mode="nearest")
    gradient = np.stack(
        [smooth(smooth(values, axis=1 - axis), axis=axis, order=1) for axis in (1, 0)],
        axis=-1,
    )
    steep = np.linalg.norm(gradient, axis=-1)
    around = ndimage.uniform_filter(steep, max(9, min(shape) // 10), mode="nearest")
    chosen = (steep > STANDS_OUT * around) & (steep > FAINTEST)
    chosen[[0, -1]] = chosen[:, [0, -1]] = False
    place = places(shape)[chosen]
    normal = gradient[chosen] / steep[chosen][:, None]
    before, after = sampled(steep, place - normal), sampled(steep, place + normal)
    crest = (steep[chosen] >= before) & (steep[chosen] > after)
    bend = np.maximum(2 * steep[chosen] - before - after, 1e-12)
    shift = np.clip(0.5 * (after - before) / bend, -0.5, 0.5)
    return EdgePoints((place + shift[:, None] * normal)[crest], normal[crest], shape)


def on_edge(points: EdgePoints, edge: Edge, near: float = NEAR) -> np.ndarray:
    """Which points (N,) lie on a line or circle and agree with its direction."""
    across = np.abs((points.normal * edge.outward(points.place)).sum(-1))
    return (np.abs(edge.beyond(points.place)) < near) & (across > ALIGNED)


def lines_of(points: EdgePoints, shortest: float, most: int = 40) -> list[Line]:
    """The lines with the most points (Hough's transform, then least squares), of at least `shortest` points."""
    angle = np.degrees(np.arctan2(points.normal[:, 1], points.normal[:, 0])) % 180
    turns = np.rint(angle[:, None] + np.arange(-7, 8)).astype(int)
    tilt = np.radians(turns)
    offset = points.place[:, :1] * np.cos(tilt) + points.place[:, 1:] * np.sin(tilt)
    offset, turns = np.where(turns % 360 >= 180, -offset, offset), turns % 180
    reach = int(np.hypot(*points.shape) / 2) + 3
    votes = np.zeros((180, 2 * reach + 1))
    np.add.at(votes, (turns, np.rint(offset).astype(int) + reach), 1.0)
    votes = ndimage.uniform_filter1d(votes, 3, axis=1) * 3
    crest = (votes == ndimage.maximum_filter(votes, (7, 9), mode="nearest")) & (votes >= shortest)
    found = sorted(np.argwhere(crest), key=lambda at: -votes[tuple(at)])[:most]
    lines = []
    for turn, bin_ in found:
        tilt = np.radians(turn)
        line = _fitted_line(points, Line(np.array([np.cos(tilt), np.sin(tilt)]), float(bin_ - reach)))
        if not any(_same_line(line, other) for other in lines):
            lines.append(line)
    return lines


def circles_of(points: EdgePoints, most: int = 4) -> list[Circle]:
    """Circles through whose centre the normals of many points run, of a quarter of the image to all of it."""
    size, cell = min(points.shape), 4.0
    radii = np.arange(0.2 * size, 0.9 * size, cell)
    reach = 0.35 * size
    cells = int(2 * reach / cell) + 1
    votes = np.zeros((cells, cells, len(radii)))
    for sign in (1, -1):
        centre = points.place[:, None] + sign * radii[:, None] * points.normal[:, None]
        index = np.rint((centre + reach) / cell).astype(int)
        kept = ((index >= 0) & (index < cells)).all(-1)
        ring = np.broadcast_to(np.arange(len(radii)), kept.shape)[kept]
        np.add.at(votes, (index[kept][:, 0], index[kept][:, 1], ring), 1.0)
    votes = ndimage.gaussian_filter(votes, (1.2, 1.2, 0.7), mode="constant")
    crest = votes == ndimage.maximum_filter(votes, 5)
    found = sorted(np.argwhere(crest & (votes > 0)), key=lambda at: -votes[tuple(at)])[:most]
    return [_fitted_circle(points, Circle(at[:2] * cell - reach, float(radii[at[2]]))) for at in found]


def _fitted_line(points: EdgePoints, line: Line) -> Line:
    """Total least squares through the points near a line, which are chosen anew as it settles."""
    for near in (3.0, 2.0, NEAR):
        chosen = points.place[on_edge(points, line, near)]
        if len(chosen) < 8:
            return line
        middle = chosen.mean(0)
        normal = np.linalg.svd(chosen - middle, full_matrices=False)[2][1]
        normal = normal if normal @ line.normal > 0 else -normal
        line = Line(normal, float(middle @ normal))
    return line


def _fitted_circle(points: EdgePoints, circle: Circle) -> Circle:
    """Least squares through the points near a circle, which are chosen anew as it settles."""
    for near in (8.0, 5.0, 3.0, 2.0, NEAR):
        chosen = points.place[on_edge(points, circle, near)]
        if len(chosen) < 12:
            return circle
        design = np.column_stack([2 * chosen, np.ones(len(chosen))])
        x, y, rest = np.linalg.lstsq(design, (chosen**2).sum(1), rcond=None)[0]
        radius = np.sqrt(max(rest + x * x + y * y, 1.0))
        if not 0.1 * min(points.shape) < radius < 2 * max(points.shape):
            return circle
        circle = Circle(np.array([x, y]), float(radius))
    return circle


def _same_line(line: Line, other: Line) -> bool:
    """Whether two lines differ by less than they are sure of."""
    sign = np.sign(line.normal @ other.normal)
    return bool(
        abs(line.normal @ other.normal) > np.cos(np.radians(2.0))
        and abs(line.offset - sign * other.offset) < 2 * NEAR
    )


def _within(place: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """The places (M, 2) that lie in the image, a pixel from its sides or more."""
    half = np.array([(shape[1] - 1) / 2 - 1, (shape[0] - 1) / 2 - 1])
    return place[(np.abs(place) <= half).all(-1)]
