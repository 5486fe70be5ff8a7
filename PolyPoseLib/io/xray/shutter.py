"""The field that collimators and shutters leave, found in the picture where no tag describes it.

Outside of the field nothing is to be seen: one colour, or scatter and noise that change slowly. Its border is a
step, straight or round, along its whole length. An anatomic outline is neither straight nor a step, and what lies
beyond an edge within the patient is not plain. Colours play no part, so that the polarity need not be known.

The thresholds come from simulated X-rays of pelvis and chest from nine directions, in four grey curves and both
polarities, clipped and sharpened: none of 228 without shutter loses a pixel, and of those with one, where its edge can
be seen along 85 % of it, nine in ten are found to an overlap of 0.97. What is left out is kept rather than cut away.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from PolyPoseLib.io.xray.shutter_edges import Circle, Edge, Line, circles_of, edge_points, lines_of, places
from PolyPoseLib.io.xray.shutter_evidence import Evidence, Picture, evidence_of, hidden_along, steps_along

WORKING_SIDE = 320
"""Rows and columns of the reduced image that is looked at, at most."""

SMALLEST_SIDE = 48
"""Rows and columns of a reduced image that shows edges, at least."""

SMALLEST_LOSS = 0.015
"""Share of the image that a shutter hides, at least, to be looked for."""

SHORTEST_SIDE = 0.12
"""Length of a straight side of the field, at least, in the image's smaller side."""

SHORTEST_ALONE = 0.5
"""Length of a side that is the only one: a single cut corner is not looked for."""

SHORTEST_ARC = 0.4
"""Length of a round border within the image, at least, in the image's smaller side."""

SUPPORTED_SIDE = 0.75
"""Share of a straight side along which there must be a step: text and equal greys may hide it in places."""

SEEN_SIDE = 0.4
"""Share of a side along which there must be a step where the rest cannot be seen."""

SUPPORTED_ALONE = 0.92
"""The same where there are two sides at most: a table is as straight, and so is the end of a CT when simulated."""

SUPPORTED_ARC = 0.85
"""The same for a round border."""

TANGENT = 0.97
"""Distance of a line from a circle's centre, in radii, from which on it is a part of the circle."""

PENUMBRA = 0.3
"""What the field loses along its border, in pixels of the reduced image: there the beam is cut in part."""


@dataclass(frozen=True)
class Field:
    """What all edges enclose.

    Attributes
    ----------
    edges
        Lines and circles in pixels of the reduced image, from its middle.
    factor
        Pixels of the image per pixel of the reduced one.
    reduced
        (H, W) of the reduced image.

    """

    edges: tuple[Edge, ...]
    factor: int
    reduced: tuple[int, int]

    def mask(self, shape: tuple[int, int]) -> np.ndarray:
        """Pixels (H, W) bool of the image that lie within."""
        middle = (np.array(self.reduced[::-1]) - 1) / 2
        x = (np.arange(shape[1]) + 0.5) / self.factor - 0.5 - middle[0]
        y = (np.arange(shape[0]) + 0.5) / self.factor - 0.5 - middle[1]
        inside = np.ones(shape, dtype=bool)
        for row, height in zip(inside, y, strict=True):
            place = np.column_stack([x, np.full_like(x, height)])
            for edge in self.edges:
                row &= edge.beyond(place) <= -PENUMBRA
        return inside


def find_field(values: np.ndarray, proportional: bool, outside_is: str | None) -> Field | None:
    """Find the field that straight leaves, a polygonal or a round shutter leave.

    Parameters
    ----------
    values
        (H, W) pixel values.
    proportional
        Whether they are proportional to the beam, so that their logarithm is looked at.
    outside_is
        "low" or "high" when the outside must be lower or higher than what is next to it; None when it may be either.

    Returns
    -------
    Field or None
        None where no shutter is in sight.

    """
    if min(values.shape) // _factor(values) < SMALLEST_SIDE:
        return None
    picture, factor = _picture(values, proportional), _factor(values)
    circle = _best_circle(picture, outside_is)
    lines = _best_lines(picture, circle, outside_is)
    if circle is None and lines:
        circle = _best_circle(replace(picture, field=_inside(picture, lines)), outside_is)
    field = Field((*lines, *([] if circle is None else [circle])), factor, picture.shape)
    removes = 1 - float(field.mask(values.shape).mean()) if field.edges else 0.0
    return field if removes >= SMALLEST_LOSS else None


def _factor(values: np.ndarray) -> int:
    """How many pixels along a side become one of the reduced image."""
    return -(-max(values.shape) // WORKING_SIDE)


def _picture(values: np.ndarray, proportional: bool) -> Picture:
    """Reduced image with a grey range of about 1, logarithms where the values are proportional to the beam."""
    factor = _factor(values)
    height, width = (side // factor for side in values.shape)
    blocks = values[: height * factor, : width * factor].reshape(height, factor, width, -1)
    small = blocks.mean(axis=(1, 3), dtype=np.float64)
    low, high = np.percentile(small, (0.5, 99.5))
    if proportional and high > 0:
        small = np.log(np.maximum(small, 2e-3 * high))
        low, high = np.percentile(small, (0.5, 99.5))
    small = (small - low) / max(high - low, 1e-12)
    return Picture(small, edge_points(small), np.ones(small.shape, dtype=bool))


def _measured(picture: Picture, edge: Edge, shortest: float, outside_is: str | None) -> Evidence | None:
    """What speaks for an edge; None where it is too short or its outside has the wrong colour."""
    found = evidence_of(picture, edge)
    if found is None or found.length < shortest * min(picture.shape):
        return None
    sided = {"low": found.darker > 0.8, "high": found.darker < 0.2}.get(str(outside_is), True)
    return found if sided else None


def _best_circle(picture: Picture, outside_is: str | None) -> Circle | None:
    """The certain circle with the most steps along it, None without any."""
    best, most = None, SUPPORTED_ARC
    for circle in circles_of(picture.points):
        step = steps_along(picture, circle)[1]
        if len(step) < SHORTEST_ARC * min(picture.shape) or step.mean() <= most:
            continue
        found = _measured(picture, circle, SHORTEST_ARC, outside_is)
        if found is not None and found.is_certain:
            best, most = circle, float(step.mean())
    return best


def _best_lines(picture: Picture, circle: Circle | None, outside_is: str | None) -> list[Line]:
    """The field's straight sides: likely ones beside three, or a circle and one, that are certain; or these."""
    certain, likely = [], []
    for line in lines_of(picture.points, SHORTEST_SIDE * min(picture.shape)):
        for side in (line, line.turned()):
            if circle is not None and -side.beyond(circle.centre) > TANGENT * circle.radius:
                continue
            found = _measured(picture, side, SHORTEST_SIDE, outside_is)
            if found is not None and found.is_certain:
                certain.append((side, found))
            if found is not None and found.is_likely:
                likely.append(side)
    sure = [side for side, _ in certain]
    if len(sure) + 2 * (circle is not None) > 2:
        sides = _sides(picture, likely, circle, sure)
        edges = [*sides, *([] if circle is None else [circle])]
        whole = [side for side in sure if side in sides and _support(picture, side, edges) > SUPPORTED_ALONE]
        if len(whole) + 2 * (circle is not None) > 2:
            return sides
    sides = _sides(picture, sure, circle)
    if circle is not None or len(sides) != 1:
        return sides
    alone = next(found for side, found in certain if side is sides[0])
    return [] if alone.is_ridge or alone.length < SHORTEST_ALONE * min(picture.shape) else sides


def _inside(picture: Picture, edges: list[Line]) -> np.ndarray:
    """Pixels (H, W) within all edges."""
    place = places(picture.shape)
    return np.all([edge.beyond(place) < 0 for edge in edges], axis=0)


def _sides(
    picture: Picture, lines: list[Line], circle: Circle | None, sure: list[Line] | None = None
) -> list[Line]:
    """The lines that together are a field's sides, each with steps from corner to corner.

    Of `sure` lines, steps need not be where both sides of the edge look the same.
    """
    while lines:
        edges: list[Edge] = [*lines, *([] if circle is None else [circle])]
        support = [_support(picture, line, edges, line in (sure or [])) for line in lines]
        worst = int(np.argmin(support))
        least = SUPPORTED_SIDE if len(lines) > 2 or circle is not None else SUPPORTED_ALONE
        if support[worst] >= least:
            return lines
        lines = lines[:worst] + lines[worst + 1 :]
    return lines


def _support(picture: Picture, line: Line, edges: list[Edge], forgiving: bool = False) -> float:
    """Share of a side, between the other edges, along which there is a step; below 0 where it is no side."""
    border, step = steps_along(picture, line)
    side = np.ones(len(border), dtype=bool)
    for other in edges:
        if other is not line:
            side &= other.beyond(border) < 1.0
    if side.sum() < SHORTEST_SIDE * min(picture.shape):
        return float(step.mean()) - 1.0 if len(step) else -1.0
    share = float(step[side].mean())
    if forgiving and share > SEEN_SIDE:
        side &= ~hidden_along(picture, line, border, step)
        return float(step[side].mean())
    return share
