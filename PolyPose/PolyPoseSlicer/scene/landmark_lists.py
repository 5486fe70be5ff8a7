"""Landmarks as lists of points: those in the CT and those in an X-ray, and which of them belong together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import slicer

from .frames import flip_vectors
from .names import free_name
from .pixel_frames import frame_above

OFF_PLANE_PIXELS = 1.0
"""A point farther than this from the X-ray's plane was not picked on it."""

CAMERA_REFERENCE = "PolyPose.Camera"
"""Role of the reference from an X-ray's list to the transform of the camera that the landmarks gave."""

_CT_COLOR = (0.2, 0.9, 0.9)
_XRAY_COLOR = (1.0, 0.4, 0.1)
_PROJECTED_COLOR = (0.2, 0.9, 0.9)
_GLYPH_PERCENT = 2.5
_PROJECTED_PERCENT = 4.0


@dataclass(frozen=True)
class Point:
    """A picked point: its place in the list, its name, and where it is (LPS mm, or column, row, off-plane px)."""

    index: int
    name: str
    position: np.ndarray


@dataclass(frozen=True)
class Pairs:
    """Points of a CT (N, 3) LPS mm and pixels of an X-ray (N, 2) [column, row] of its file that belong together.

    names: (N,); ct_indices, xray_indices: (N,) places in the two lists.
    ct_alone, xray_alone: names of points without a partner; off_image: of points that do not lie on the X-ray.
    """

    names: tuple[str, ...]
    points: np.ndarray
    pixels: np.ndarray
    ct_indices: tuple[int, ...]
    xray_indices: tuple[int, ...]
    ct_alone: tuple[str, ...] = ()
    xray_alone: tuple[str, ...] = ()
    off_image: tuple[str, ...] = ()

    def same_as(self, other: Pairs) -> bool:
        """Whether these are the very same points under the same names."""
        return (
            self.names == other.names
            and np.array_equal(self.points, other.points)
            and np.array_equal(self.pixels, other.pixels)
        )

    def entries(self) -> list[dict[str, Any]]:
        """As the field "landmarks" of a study."""
        return [
            {"name": name, "point": point.tolist(), "pixel": pixel.tolist()}
            for name, point, pixel in zip(self.names, self.points, self.pixels, strict=True)
        ]


def pairs_of(
    ct: slicer.vtkMRMLMarkupsFiducialNode | None, xray: slicer.vtkMRMLMarkupsFiducialNode | None
) -> Pairs:
    """The pairs of two lists; an X-ray's list outside of every pixel frame has all of its points off the image."""
    in_ct = [Point(p.index, p.name, flip_vectors(p.position)) for p in _points(ct, world=True)]
    in_frame = frame_above(xray) is not None
    in_xray = _points(xray, world=not in_frame)
    lies = [in_frame and abs(p.position[2]) <= OFF_PLANE_PIXELS for p in in_xray]
    on_image = [p for p, good in zip(in_xray, lies, strict=True) if good]
    together = matched(in_ct, on_image)
    first, second = {a.index for a, _b in together}, {b.index for _a, b in together}
    return Pairs(
        names=tuple(a.name or b.name for a, b in together),
        points=np.array([a.position for a, _b in together]).reshape(-1, 3),
        pixels=np.array([b.position[:2] for _a, b in together]).reshape(-1, 2),
        ct_indices=tuple(a.index for a, _b in together),
        xray_indices=tuple(b.index for _a, b in together),
        ct_alone=tuple(p.name for p in in_ct if p.index not in first),
        xray_alone=tuple(p.name for p in on_image if p.index not in second),
        off_image=tuple(p.name for p, good in zip(in_xray, lies, strict=True) if not good),
    )


def matched(first: Sequence[Point], second: Sequence[Point]) -> list[tuple[Point, Point]]:
    """Points with equal names; where the lists share no name, points with the same place in their order."""
    by_name = {point.name: point for point in reversed(second)}
    together, used = [], set()
    for point in first:
        other = by_name.get(point.name)
        if other is not None and point.name not in used:
            used.add(point.name)
            together.append((point, other))
    return together or list(zip(first, second, strict=False))


def _points(node: slicer.vtkMRMLMarkupsFiducialNode | None, world: bool) -> list[Point]:
    """Points that were placed; the one that follows the mouse does not count yet."""
    if node is None:
        return []
    read = node.GetNthControlPointPositionWorld if world else node.GetNthControlPointPosition
    return [
        Point(n, node.GetNthControlPointLabel(n).strip(), np.array(read(n), dtype=np.float64))
        for n in range(node.GetNumberOfControlPoints())
        if node.GetNthControlPointPositionStatus(n) == slicer.vtkMRMLMarkupsNode.PositionDefined
    ]


def new_list(name: str, in_xray: bool) -> slicer.vtkMRMLMarkupsFiducialNode:
    """An empty list whose points are called 1, 2, 3, as those of its counterpart."""
    node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLMarkupsFiducialNode", free_name(name))
    node.SetControlPointLabelFormat("%d")
    _show(node, _XRAY_COLOR if in_xray else _CT_COLOR, slicer.vtkMRMLMarkupsDisplayNode.CrossDot2D)
    return node


def fill(
    node: slicer.vtkMRMLMarkupsFiducialNode, places: np.ndarray, names: Sequence[str] | None = None
) -> None:
    """Replace a list's points by places (N, 3) in its own coordinates; without names they are numbered.

    An empty name shows no text.
    """
    was = node.StartModify()
    node.RemoveAllControlPoints()
    for number, place in enumerate(np.asarray(places, dtype=np.float64)):
        # A list would replace an empty name by one of its own.
        node.AddControlPoint(place.tolist(), (names[number] or " ") if names else str(number + 1))
    node.EndModify(was)


def name_new_point(node: slicer.vtkMRMLMarkupsFiducialNode) -> None:
    """Give the last point the first number that is free, so that a point picked again finds its old partner."""
    last = node.GetNumberOfControlPoints() - 1
    if last < 0 or not node.GetNthControlPointLabel(last).isdigit():
        return
    taken = {node.GetNthControlPointLabel(n) for n in range(last)}
    free = next(str(n) for n in range(1, last + 2) if str(n) not in taken)
    if free != node.GetNthControlPointLabel(last):
        node.SetNthControlPointLabel(last, free)


def put_into_frame(node: slicer.vtkMRMLMarkupsFiducialNode, frame: slicer.vtkMRMLLinearTransformNode) -> None:
    """Let an X-ray's points follow its frame; they stay where they are now."""
    if node.GetParentTransformNode() is frame:
        return
    count = node.GetNumberOfControlPoints()
    places = [list(node.GetNthControlPointPositionWorld(n)) for n in range(count)]
    states = [node.GetNthControlPointPositionStatus(n) for n in range(count)]
    was = node.StartModify()
    node.SetAndObserveTransformNodeID(frame.GetID())
    for n, (place, state) in enumerate(zip(places, states, strict=True)):
        node.SetNthControlPointPositionWorld(n, place, state)
    node.EndModify(was)


def new_projected_list(name: str) -> slicer.vtkMRMLMarkupsFiducialNode:
    """A locked list that shows where landmarks project; no file and no selector has it."""
    node = slicer.mrmlScene.CreateNodeByClass("vtkMRMLMarkupsFiducialNode")
    node.UnRegister(None)
    node.SetName(free_name(name))
    node.SetSaveWithScene(False)
    node.SetHideFromEditors(True)
    node = slicer.mrmlScene.AddNode(node)
    node.SetLocked(True)
    _show(node, _PROJECTED_COLOR, slicer.vtkMRMLMarkupsDisplayNode.Cross2D)
    node.GetDisplayNode().SetGlyphScale(_PROJECTED_PERCENT)
    node.GetDisplayNode().SetSaveWithScene(False)
    return node


def set_projected(
    node: slicer.vtkMRMLMarkupsFiducialNode,
    frame: slicer.vtkMRMLLinearTransformNode | None,
    names: Sequence[str],
    pixels: np.ndarray,
) -> None:
    """Show pixels (N, 2) of the file, in a frame; those that are not finite are left out."""
    seen = np.isfinite(pixels[:, 0]) & np.isfinite(pixels[:, 1])
    was = node.StartModify()
    node.SetAndObserveTransformNodeID(frame.GetID() if frame is not None else None)
    places = np.column_stack([pixels, np.zeros(len(pixels))])[seen]
    fill(node, places, [name for name, good in zip(names, seen, strict=True) if good])
    node.EndModify(was)


def _show(node: slicer.vtkMRMLMarkupsFiducialNode, color: tuple[float, float, float], glyph: int) -> None:
    node.CreateDefaultDisplayNodes()
    display = node.GetDisplayNode()
    display.SetSelectedColor(*color)
    display.SetColor(*color)
    display.SetGlyphType(glyph)
    display.SetGlyphScale(_GLYPH_PERCENT)
