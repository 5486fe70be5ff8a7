"""Outlines of what an image shows: the lines at one level, traced into closed polygons."""

from __future__ import annotations

import numpy as np

# Of a cell's corners, 1 is the upper left, 2 the upper right, 4 the lower right, 8 the lower left; its sides are
# 0 top, 1 right, 2 bottom, 3 left. A line enters by the first side and leaves by the second, with what is inside on
# its right. In saddles (5 and 10) the two corners stay apart.
_SEGMENTS: dict[int, tuple[tuple[int, int], ...]] = {
    1: ((3, 0),), 2: ((0, 1),), 3: ((3, 1),), 4: ((1, 2),), 5: ((3, 0), (1, 2)), 6: ((0, 2),), 7: ((3, 2),),
    8: ((2, 3),), 9: ((2, 0),), 10: ((0, 1), (2, 3)), 11: ((2, 1),), 12: ((1, 3),), 13: ((1, 0),), 14: ((0, 3),),
}  # fmt: skip


def traced(image: np.ndarray, level: float) -> list[np.ndarray]:
    """Closed lines at which an image passes a level, by marching squares with linear interpolation.

    Parameters
    ----------
    image : (H, W) array
        Finite; beyond its edge it counts as lying below the level, so that every line closes.
    level : float
        Pixels above it are inside.

    Returns
    -------
    list of (N, 2) float64 arrays
        Polygons as (column, row), centres of pixels at whole numbers, the last point joined to the first; those around
        what is inside run the other way round than those around holes.

    """
    height = image.shape[0] + 2
    width = image.shape[1] + 2
    field = np.full((height, width), -1.0)
    field[1:-1, 1:-1] = np.asarray(image, np.float64) - level
    # The edge lies half a pixel outside the outermost centres, where their pixels end.
    for edge, inner in ((0, 1), (-1, -2)):
        field[edge] = -np.abs(field[inner]) - 1e-12
        field[:, edge] = -np.abs(field[:, inner]) - 1e-12
    follows = _links(field > 0)
    points = _crossings(field, np.fromiter(follows, np.int64, len(follows)))
    outlines = []
    while follows:
        start, side = follows.popitem()
        line = [start]
        while side != start:
            line.append(side)
            side = follows.pop(side)
        outlines.append(np.array([points[each] for each in line]) - 1.0)
    return outlines


def _links(inside: np.ndarray) -> dict[int, int]:
    """From every crossed side of a cell to the next one on its line.

    A side is numbered by the pixel at its upper or left end: twice its place, and one more where the side is vertical.
    """
    width = inside.shape[1]
    bits = inside.astype(np.int64)
    corners = bits[:-1, :-1] + 2 * bits[:-1, 1:] + 4 * bits[1:, 1:] + 8 * bits[1:, :-1]
    offsets = np.array([0, 2 + 1, 2 * width, 1])
    links: dict[int, int] = {}
    for case, segments in _SEGMENTS.items():
        rows, columns = np.nonzero(corners == case)
        first = 2 * (rows * width + columns)
        for entry, leaving in segments:
            links.update(
                zip((first + offsets[entry]).tolist(), (first + offsets[leaving]).tolist(), strict=True)
            )
    return links


def _crossings(field: np.ndarray, sides: np.ndarray) -> dict[int, tuple[float, float]]:
    """Where a field passes zero on sides of cells: from a side's number to (column, row)."""
    width = field.shape[1]
    rows, columns = np.divmod(sides // 2, width)
    vertical = sides % 2
    first, second = field[rows, columns], field[rows + vertical, columns + 1 - vertical]
    share = first / (first - second)
    across, down = columns + share * (1 - vertical), rows + share * vertical
    return dict(zip(sides.tolist(), zip(across.tolist(), down.tolist(), strict=True), strict=True))


def simplified(polygon: np.ndarray, tolerance: float) -> np.ndarray:
    """A closed polygon (N, 2) with fewer points, none of those left out farther from it than a tolerance.

    By Douglas and Peucker's method, from the two points that are farthest apart along the axes.
    """
    if len(polygon) < 4:
        return polygon
    first = int(polygon[:, 0].argmin())
    ring = np.roll(polygon, -first, axis=0)
    middle = int(np.linalg.norm(ring - ring[0], axis=1).argmax())
    closed = np.concatenate([ring, ring[:1]])
    keep = np.zeros(len(closed), bool)
    keep[[0, middle, -1]] = True
    parts = [(0, middle), (middle, len(closed) - 1)]
    while parts:
        start, end = parts.pop()
        if end - start < 2:
            continue
        distance = _from_segment(closed[start + 1 : end], closed[start], closed[end])
        farthest = int(distance.argmax())
        if distance[farthest] > tolerance:
            split = start + 1 + farthest
            keep[split] = True
            parts += [(start, split), (split, end)]
    return closed[:-1][keep[:-1]]


def _from_segment(points: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """(N,) distances of points (N, 2) from a segment."""
    along = end - start
    length = max(float(along @ along), 1e-300)
    share = np.clip((points - start) @ along / length, 0, 1)
    return np.linalg.norm(points - start - share[:, None] * along, axis=1)


def area(polygon: np.ndarray) -> float:
    """Area that a closed polygon (N, 2) encloses, its sign by the direction in which it runs."""
    x, y = polygon.T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2
