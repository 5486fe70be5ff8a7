"""Where the parts of a plan fall in one X-ray, and a sentence for what falls outside of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from PolyPoseLib.data.result import CameraResult
from PolyPoseLib.data.view_names import label_of
from PolyPoseLib.geometry.camera import Camera, review_camera
from PolyPoseLib.geometry.outlines import area, simplified, traced
from PolyPoseLib.geometry.projected_ellipse import half_axes, projected_covariances
from PolyPoseLib.geometry.triangles import covered
from PolyPoseLib.io.projected.plan import PlanPart, PlanPoints, PlanRegions, PlanSurface
from PolyPoseLib.rendering.select import select_backend
from PolyPoseLib.rendering.silhouettes import Silhouettes

Polygons = list[np.ndarray]
"""Each (N, 2), closed, (column, row) in pixels of the X-ray, centres of pixels at whole numbers."""

OUTLINE_SIDE = 1024
"""Outlines are found in images of so many pixels a side at most, and with twice as many of surfaces."""

NEAREST_MM = 1.0
"""To the source, along the axis: what is nearer counts as behind it."""

MOST_SENTENCES = 20
"""About single points of one X-ray; more of them are counted."""

SMOOTH_PX, SMALLEST_PX, TOLERANCE_PX = 0.8, 2.0, 0.1


@dataclass(frozen=True)
class PointShadow:
    """Where one point falls.

    Attributes
    ----------
    label : str
        Of the point.
    place : (2,) array
        (column, row), pixels of the X-ray; NaN behind the source.
    covariance : (2, 2) array
        Pixels^2; NaN where it is not known.
    where : str
        "in the picture", "beside the picture" or "behind the source".
    moved_by : str
        What carried it.

    """

    label: str
    place: np.ndarray
    covariance: np.ndarray
    where: str
    moved_by: str

    @property
    def drawn(self) -> bool:
        """Whether it lies in the picture."""
        return self.where == IN

    @property
    def half_axes_px(self) -> tuple[float, float]:
        """Half axes of the 95 % ellipse, ascending; NaN where it is not known."""
        if not np.isfinite(self.covariance).all():
            return float("nan"), float("nan")
        lengths, _ = half_axes(self.covariance)
        return float(lengths[0]), float(lengths[1])


IN, BESIDE, BEHIND = "in the picture", "beside the picture", "behind the source"


@dataclass(frozen=True)
class OutlineShadow:
    """The outline of a surface or a region."""

    name: str
    polygons: Polygons


@dataclass(frozen=True)
class ViewShadows:
    """Everything of a plan in one X-ray.

    Attributes
    ----------
    points : tuple of PointShadow
        All of them, drawn or not.
    lines : tuple of (2, 2) arrays
        Ends (column, row) of lines that lie before the source.
    outlines : tuple of OutlineShadow
        Of what shows.
    sentences : tuple of str
        About what does not.

    """

    points: tuple[PointShadow, ...]
    lines: tuple[np.ndarray, ...]
    outlines: tuple[OutlineShadow, ...]
    sentences: tuple[str, ...]


def view_shadows(view: CameraResult, parts: Sequence[PlanPart]) -> ViewShadows:
    """Where the parts of a plan fall in one X-ray."""
    points: list[PointShadow] = []
    lines: list[np.ndarray] = []
    outlines: list[OutlineShadow] = []
    sentences: list[str] = []
    for part in parts:
        if isinstance(part, PlanPoints):
            found = _points(view.camera, part)
            points += found
            sentences += _about_points(found, view)
            ends = [np.stack([found[first].place, found[second].place]) for first, second in part.lines]
            lines += [each for each in ends if np.isfinite(each).all()]
            continue
        drawn = _surface(view, part) if isinstance(part, PlanSurface) else _regions(view, part)
        for outline, sentence in drawn:
            outlines += [outline] if outline.polygons else []
            sentences += [sentence] if sentence else []
    return ViewShadows(tuple(points), tuple(lines), tuple(outlines), tuple(sentences))


def _points(camera: Camera, part: PlanPoints) -> list[PointShadow]:
    places = camera.project(part.carried.points)
    places[camera.depth(part.carried.points) < NEAREST_MM] = np.nan
    covariances = projected_covariances(camera, part.carried.points, part.carried.covariances)
    last = np.array([camera.width, camera.height]) - 0.5
    inside = np.all((places >= -0.5) & (places <= last), axis=1).tolist()
    where = [
        BEHIND if np.isnan(place[0]) else IN if within else BESIDE
        for place, within in zip(places, inside, strict=True)
    ]
    rows = zip(part.labels, places, covariances, where, part.carried.moved_by, strict=True)
    return [PointShadow(*each) for each in rows]


def _about_points(points: Sequence[PointShadow], view: CameraResult) -> list[str]:
    """Sentences about points that are not drawn."""
    xray = label_of(view.name)
    lost = [each for each in points if not each.drawn]
    sentences = []
    for each in lost[:MOST_SENTENCES]:
        if each.where == BEHIND:
            sentences.append(f'The point "{each.label}" lies behind the source of {xray} and is not drawn.')
        else:
            column, row = each.place
            sentences.append(
                f'The point "{each.label}" falls beside {xray} (column {column:.0f}, row {row:.0f} of {view.width} x '
                f"{view.height} pixels) and is not drawn."
            )
    if len(lost) > MOST_SENTENCES:
        sentences.append(
            f"{len(lost) - MOST_SENTENCES} more points fall beside {xray} or behind its source and are not drawn."
        )
    return sentences


def _surface(view: CameraResult, part: PlanSurface) -> list[tuple[OutlineShadow, str]]:
    """The outline of a surface's shadow, without the triangles that reach behind the source."""
    corners = part.vertices[part.triangles]
    before = (view.camera.depth(corners) >= NEAREST_MM).all(axis=1)
    small, factor = review_camera(view.camera, OUTLINE_SIDE)
    # At twice the resolution: the centre of a pixel lies then between two.
    places = 2 * small.project(corners[before]) + 0.5
    limit = 1e7  # farther off, a shadow's edge is as good as straight, and rows are whole numbers
    mask = covered(np.clip(places, -limit, limit), (2 * small.height, 2 * small.width))
    smooth = gaussian_filter(np.pad(mask.astype(np.float32), 4, mode="edge"), SMOOTH_PX)[4:-4, 4:-4]
    polygons = [
        ((simplified(each, TOLERANCE_PX) - 0.5) / 2 + 0.5) * factor - 0.5
        for each in traced(smooth, 0.5)
        if abs(area(each)) >= SMALLEST_PX
    ]
    hidden = 1 - before.mean()
    sentence = ""
    if hidden == 1:
        sentence = f'"{part.name}" lies behind the source of {label_of(view.name)} and is not drawn.'
    elif hidden > 0:
        sentence = (
            f'{max(1, round(100 * hidden))} % of "{part.name}" lies behind the source of {label_of(view.name)} and is '
            "not drawn."
        )
    elif not polygons:
        sentence = _nothing(part.name, view)
    return [(OutlineShadow(part.name, polygons), sentence)]


def _regions(view: CameraResult, part: PlanRegions) -> list[tuple[OutlineShadow, str]]:
    small, factor = review_camera(view.camera, OUTLINE_SIDE)
    silhouettes = Silhouettes(part.labels, len(part.names), select_backend())
    found = []
    for number, name in enumerate(part.names):
        polygons = [(each + 0.5) * factor - 0.5 for each in silhouettes.outlines(number, small, np.eye(4))]
        found.append((OutlineShadow(name, polygons), "" if polygons else _nothing(name, view)))
    return found


def _nothing(name: str, view: CameraResult) -> str:
    return f'"{name}" does not show in {label_of(view.name)}: it falls beside it, or lies behind its source.'
