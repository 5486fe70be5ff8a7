"""Lines over pictures, as SVG: outlines of bones on slices and X-rays, carried points with their ellipsoids."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

import numpy as np

from PolyPoseLib.data.carried import CHI2_95
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.projected_ellipse import ellipse, projected_covariances
from PolyPoseLib.viewer.content import Bone, NamedPoints
from PolyPoseLib.viewer.planes import Frame

POINT_COLOUR = "#ffffff"
NEAR_MM = 10.0
"""Points this far from a slice are still drawn on it, the fainter the farther."""


def _svg(left: float, top: float, width: float, height: float, parts: Iterable[str]) -> str:
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{left:.3f} {top:.3f} {width:.3f} {height:.3f}" '
        f'preserveAspectRatio="none">{"".join(parts)}</svg>'
    )


def slice_outlines(bones: Sequence[Bone], frame: Frame, moved: bool) -> str:
    """Where a slice cuts the bones: as X-rayed, or dashed where the CT has them."""
    parts = []
    for bone in bones:
        surface = bone.surface.moved(bone.motion) if moved else bone.surface
        lines = [frame.on_picture(line) for line in surface.cut(frame.axis, frame.position)]
        if not lines:
            continue
        path = "".join("M" + "L".join(f"{x:.2f} {y:.2f}" for x, y in line.tolist()) for line in lines)
        parts.append(_path(path, bone.colour, dashed=not moved))
    return _svg(frame.left, frame.top, frame.width, frame.height, parts)


def view_outlines(
    outlines: Sequence[list[np.ndarray]], bones: Sequence[Bone], camera: Camera, dashed: bool
) -> str:
    """Outlines of bones on an X-ray."""
    parts = []
    for lines, bone in zip(outlines, bones, strict=False):
        path = "".join("M" + "L".join(f"{x:.2f} {y:.2f}" for x, y in line.tolist()) + "Z" for line in lines)
        if path:
            parts.append(_path(path, bone.colour, dashed))
    return _svg(-0.5, -0.5, camera.width, camera.height, parts)


def _path(path: str, colour: str, dashed: bool) -> str:
    dashes = ' stroke-dasharray="5 4"' if dashed else ""
    return (
        f'<path d="{path}" fill="none" stroke="{colour}" stroke-width="1.6"{dashes} '
        'vector-effect="non-scaling-stroke" stroke-linejoin="round"/>'
    )


def slice_points(points: NamedPoints, frame: Frame, moved: bool) -> str:
    """Points near a slice; as X-rayed with the section of their 95 % ellipsoids."""
    places = points.carried.points if moved else points.in_ct
    size = 0.012 * max(frame.width, frame.height)
    parts = []
    for n, name in enumerate(points.names):
        off = places[n, frame.axis] - frame.position
        ring = _section(points.carried.covariances[n], frame.axis, off) if moved else None
        if abs(off) > NEAR_MM and ring is None:
            continue
        x, y = frame.on_picture(places[n])
        faint = max(0.25, 1 - abs(off) / NEAR_MM)
        turned = x > frame.left + 0.7 * frame.width
        parts.append(_cross(x, y, size, name, faint, turned))
        if ring is not None:
            parts.append(_ring(frame.on_picture(places[n] + ring), faint=1.0))
    return _svg(frame.left, frame.top, frame.width, frame.height, parts)


def _section(covariance: np.ndarray, axis: int, off: float) -> np.ndarray | None:
    """(M, 3) ring around a point in which a slice cuts its 95 % ellipsoid; None where it does not.

    `off` is how far the point lies beyond the slice along its axis. In the slice, the ellipsoid d' C^-1 d = q with
    d[axis] = -off is the ellipse of the conditional normal distribution.
    """
    if not np.isfinite(covariance).all():
        return None
    rest = [each for each in range(3) if each != axis]
    along = max(float(covariance[axis, axis]), 1e-12)
    left = CHI2_95 - off**2 / along
    if left <= 0:
        return None
    mean = covariance[rest, axis] * (-off / along)
    spread = covariance[np.ix_(rest, rest)] - np.outer(covariance[rest, axis], covariance[axis, rest]) / along
    ring = np.zeros((48, 3))
    ring[:, rest] = mean + np.sqrt(left) * _circle(48) @ _root(spread).T
    ring[:, axis] = -off
    return ring


def view_points(points: NamedPoints, camera: Camera) -> str:
    """Points as X-rayed on an X-ray, with 95 % ellipses of where they are seen, to first order."""
    size = 0.012 * max(camera.width, camera.height)
    parts = []
    for n, name in enumerate(points.names):
        place = points.carried.points[n]
        x, y = camera.project(place)
        if not (np.isfinite(x) and 0 <= x <= camera.width and 0 <= y <= camera.height):
            continue
        parts.append(_cross(x, y, size, name, 1.0, turned=x > 0.7 * camera.width))
        covariance = points.carried.covariances[n]
        if np.isfinite(covariance).all():
            spread = projected_covariances(camera, place[None], covariance[None])[0]
            parts.append(_ring(ellipse(np.array([x, y]), spread, 48), 1.0))
    return _svg(-0.5, -0.5, camera.width, camera.height, parts)


def _circle(count: int) -> np.ndarray:
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def _root(spread: np.ndarray) -> np.ndarray:
    """A matrix A with A A^T = spread."""
    values, vectors = np.linalg.eigh((spread + spread.T) / 2)
    return vectors * np.sqrt(values.clip(min=0))


def _ring(points: np.ndarray, faint: float) -> str:
    path = "M" + "L".join(f"{x:.2f} {y:.2f}" for x, y in points.tolist()) + "Z"
    return (
        f'<path d="{path}" fill="{POINT_COLOUR}" fill-opacity="0.15" stroke="{POINT_COLOUR}" opacity="{faint:.2f}" '
        'stroke-width="1.2" vector-effect="non-scaling-stroke"/>'
    )


def _cross(x: float, y: float, size: float, name: str, faint: float, turned: bool) -> str:
    """A cross with its name beside it: to its right, or to its left where it is turned."""
    side, anchor = (-1, "end") if turned else (1, "start")
    lines = f"M{x - size:.2f} {y:.2f}h{2 * size:.2f}M{x:.2f} {y - size:.2f}v{2 * size:.2f}"
    style = 'fill="none" vector-effect="non-scaling-stroke"'
    return (
        f'<g opacity="{faint:.2f}"><path d="{lines}" stroke="#000000" stroke-width="3" {style}/>'
        f'<path d="{lines}" stroke="{POINT_COLOUR}" stroke-width="1.4" {style}/>'
        f'<text x="{x + side * 1.3 * size:.2f}" y="{y - 1.3 * size:.2f}" font-size="{2.6 * size:.2f}" '
        f'text-anchor="{anchor}" '
        f'font-family="sans-serif" fill="{POINT_COLOUR}" stroke="#000000" stroke-width="{0.35 * size:.2f}" '
        f'paint-order="stroke">{escape(name)}</text></g>'
    )
