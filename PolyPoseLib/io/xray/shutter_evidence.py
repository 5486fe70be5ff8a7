"""What speaks for an edge of an X-ray's field: a sharp step along it, and nothing to be seen beyond."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from scipy.spatial import KDTree

from PolyPoseLib.io.xray.shutter_edges import Edge, EdgePoints, Line, on_edge, places, sampled

GRADUAL = 0.25
"""Further change of grey within the edge, in heights of the step: an outline goes on to rise, a shutter's does not."""

RIDGE = -0.3
"""Change back within the edge, in heights of the step, that a table's edge or a rail has."""

PLAIN = 0.14
"""Spread of what is outside about a smooth surface, in heights of the step."""

MARKED = 0.35
"""The same for the upper quartile: a quarter of the outside may be text."""

CONTINUED = 0.15
"""Difference of what is next to the edge from the surface through all that is outside, in heights of the step."""

HIDDEN = 0.3
"""Difference across an edge, in heights of its step, below which it cannot be seen."""

LOWEST = 0.005
"""Height of a step that counts, in the image's grey range: one level of 8 bits."""

_REACH = 2.5
"""Distance in pixels within which a step is at a place, and from which on a pixel is outside."""

_BEHIND, _BEFORE, _DEEP = (2.5, 3.5, 4.5), (-3.0, -4.0), (-10.0, -12.0, -14.0)
"""Distances in pixels beyond the edge at which the outside, the inside and the deeper inside are sampled."""


@dataclass(frozen=True)
class Picture:
    """An image with its edge points.

    Attributes
    ----------
    values
        (H, W), with a grey range of about 1.
    points
        Its edge points.
    field
        (H, W) bool, where an edge may be a border of the field.

    """

    values: np.ndarray
    points: EdgePoints
    field: np.ndarray

    @property
    def shape(self) -> tuple[int, int]:
        """(H, W)."""
        return self.points.shape


@dataclass(frozen=True)
class Evidence:
    """Measures of one edge.

    Attributes
    ----------
    length
        Of the part with steps, in pixels.
    darker
        Share of it behind which the outside is darker.
    gradual
        Further change in the same direction within the edge, in heights of the step.
    spread, marks
        Median (as a standard deviation) and upper quartile of the outside's difference from a smooth surface, in
        heights of the step.
    strip
        The median next to the edge's steps.

    """

    length: int
    darker: float
    gradual: float
    spread: float
    marks: float
    strip: float

    @property
    def is_certain(self) -> bool:
        """Whether the edge is a step, not a slope, beyond which nothing is to be seen."""
        plain = self.spread < PLAIN and self.marks < MARKED and self.strip < CONTINUED
        return plain and self.gradual < GRADUAL

    @property
    def is_likely(self) -> bool:
        """Whether the edge would do beside others that are certain: scatter beyond it, or a slope along it."""
        return self.gradual < 1.0 and self.spread < 0.3 and self.marks < MARKED and self.strip < 2 * CONTINUED

    @property
    def is_ridge(self) -> bool:
        """Whether the greys return within the edge, as behind a table's or a rail's."""
        return self.gradual < RIDGE


def steps_along(picture: Picture, edge: Edge) -> tuple[np.ndarray, np.ndarray]:
    """Places (M, 2), one a pixel, along an edge within the field, and whether (M,) there is a step at them."""
    border = edge.border(picture.shape)
    rows = np.rint(border[:, 1] + (picture.shape[0] - 1) / 2).astype(int)
    columns = np.rint(border[:, 0] + (picture.shape[1] - 1) / 2).astype(int)
    border = border[picture.field[rows, columns]]
    points = picture.points.place[on_edge(picture.points, edge)]
    if not len(points) or not len(border):
        return border, np.zeros(len(border), dtype=bool)
    return border, KDTree(points).query(border)[0] < _REACH


def hidden_along(picture: Picture, edge: Edge, border: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Where (M,) an edge cannot be seen at places (M, 2), as the grey is the same on both sides of it."""
    behind, before = _levels(picture, edge, border, _BEHIND), _levels(picture, edge, border, _BEFORE)
    difference = np.abs(ndimage.median_filter(before - behind, 5))
    height = float(np.median(difference[step])) if step.any() else 0.0
    return ~step & (difference < HIDDEN * height)


def evidence_of(picture: Picture, edge: Edge) -> Evidence | None:
    """Measure an edge; None where it has no step to speak of, or cuts off next to nothing or most of the image."""
    place = places(picture.shape)
    outside = edge.beyond(place) > _REACH
    border, step = steps_along(picture, edge)
    if not 0.002 < outside.mean() < 0.75 or not step.any():
        return None
    if isinstance(edge, Line):
        run = _longest_run(step, max(2, int(0.03 * min(picture.shape))))
        border, step = border[run], step[run]
    behind, before, deep = (_levels(picture, edge, border, reach) for reach in (_BEHIND, _BEFORE, _DEEP))
    jump, further = ndimage.median_filter(np.stack([before - behind, deep - before]), (1, 5))[:, step]
    height = float(np.median(np.abs(jump)))
    if height < LOWEST:
        return None
    seen = np.abs(jump) > 0.5 * height
    next_to_it = border[step] + np.mean(_BEHIND) * edge.outward(border[step])
    residual, beside = _unevenness(ndimage.uniform_filter(picture.values, 3), outside, next_to_it)
    return Evidence(
        len(border),
        float(np.mean(jump > 0)),
        float(np.median(further[seen] / jump[seen])),
        1.4826 * float(np.median(residual)) / height,
        float(np.quantile(residual, 0.75)) / height,
        float(np.median(beside)) / height,
    )


def _levels(picture: Picture, edge: Edge, border: np.ndarray, reach: tuple[float, ...]) -> np.ndarray:
    """Mean greys (M,) at distances beyond the places (M, 2) of an edge."""
    out = edge.outward(border)
    return np.mean([sampled(picture.values, border + at * out) for at in reach], axis=0)


def _longest_run(step: np.ndarray, gap: int) -> np.ndarray:
    """The longest run (M,) of steps, over gaps of up to twice `gap`."""
    closed = np.asarray(ndimage.binary_closing(np.pad(step, gap + 1), iterations=gap))[gap + 1 : -gap - 1]
    labels = np.zeros(closed.shape, dtype=np.int32)
    ndimage.label(closed, output=labels)
    return labels == 1 + np.argmax(np.bincount(labels)[1:])


def _unevenness(values: np.ndarray, region: np.ndarray, beside: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How far values (H, W) differ from a smooth surface through a region, (M,) there and (K,) at places (K, 2)."""
    where = np.flatnonzero(region)
    where = where[:: max(1, len(where) // 3000)]
    design = _quadratic(places((values.shape[0], values.shape[1])).reshape(-1, 2)[where] / max(values.shape))
    seen = values.reshape(-1)[where]
    residual = np.abs(seen - np.median(seen))
    surface = np.zeros(design.shape[1])
    for _ in range(4):
        weight = 1 / np.sqrt(np.maximum(residual, 1.5 * float(np.median(residual)) + 1e-6))
        surface = np.linalg.lstsq(design * weight[:, None], seen * weight, rcond=None)[0]
        residual = np.abs(seen - design @ surface)
    return residual, np.abs(sampled(values, beside) - _quadratic(beside / max(values.shape)) @ surface)


def _quadratic(place: np.ndarray) -> np.ndarray:
    """Terms (M, 6) of a quadratic surface at places (M, 2)."""
    x, y = place.T
    return np.column_stack([np.ones_like(x), x, y, x * x, x * y, y * y])
