"""What a report shows of every X-ray: its images, the outlines of the bones in it, and where to look closer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from PolyPoseLib.data.result import CameraResult, Result
from PolyPoseLib.data.view_names import view_name
from PolyPoseLib.io.report.pictures import Overlays, grey, shrunk
from PolyPoseLib.io.report.words import is_still

Polygons = list[np.ndarray]
"""Each (N, 2), closed, (column, row) in pixels of the shown picture, centres of pixels at whole numbers."""

PIXELS_OF_ALL = 6e6
"""All X-rays together are shown with about so many pixels at most."""

LARGEST_SIDE, SMALLEST_SIDE = 1024, 512
"""Pixels of a shown X-ray's longer side, by how many there are."""

OVERLAY_SIDE = 640

MARGIN, LEAST_MARGIN_PX = 0.18, 8.0
"""A close-up goes beyond a bone's outlines by this share of their size, and by so many pixels at least."""


@dataclass(frozen=True)
class BoneOutline:
    """A structure's outlines in one view: where the CT has it, and as it was found; "flagged" is doubtful.

    kind: "anchor", "moving" or "flagged".
    """

    name: str
    kind: str
    before: Polygons
    after: Polygons


@dataclass(frozen=True)
class ReportView:
    """One X-ray.

    Attributes
    ----------
    name : str
        Of the X-ray.
    similarity : float
        Final, NaN when it is not known.
    shape : tuple[int, int]
        Rows and columns of the shown picture.
    xray, before, after : (H, W) uint8 arrays or None
        The X-ray and the renderings; None where they were not kept.
    overlay_before, overlay_after : (h, w, 3) uint8 arrays or None
        X-ray and rendering over each other.
    outlines : tuple of BoneOutline
        Of the structures that show in it.

    """

    name: str
    similarity: float
    shape: tuple[int, int]
    xray: np.ndarray | None
    before: np.ndarray | None
    after: np.ndarray | None
    overlay_before: np.ndarray | None
    overlay_after: np.ndarray | None
    outlines: tuple[BoneOutline, ...]

    @property
    def picture(self) -> np.ndarray | None:
        """What outlines are drawn on: the X-ray, or where it was not kept the rendering."""
        return self.after if self.xray is None else self.xray

    def outline(self, name: str) -> BoneOutline | None:
        """Of one structure; None when it does not show."""
        return next((each for each in self.outlines if each.name == name), None)


@dataclass(frozen=True)
class CloseUp:
    """A part of a view around one bone: its box as (column, row, width, height) in pixels of the shown picture."""

    view: ReportView
    bone: BoneOutline
    box: tuple[float, float, float, float]

    @property
    def part(self) -> np.ndarray:
        """The shown picture inside the box, (h, w) uint8; a black pixel where there is no picture."""
        column, row, width, height = (round(each) for each in self.box)
        picture = np.zeros((1, 1), np.uint8) if self.view.picture is None else self.view.picture
        return picture[
            max(row, 0) : max(row, 0) + max(height, 1), max(column, 0) : max(column, 0) + max(width, 1)
        ]


def report_views(result: Result) -> list[ReportView]:
    """Every X-ray of a result, ready to be shown."""
    side = int(np.clip(np.sqrt(PIXELS_OF_ALL / max(len(result.cameras), 1)), SMALLEST_SIDE, LARGEST_SIDE))
    outlines = _outlines(result, side)
    return [_view(result, number, side, outlines[number]) for number in range(len(result.cameras))]


def close_ups(views: list[ReportView], name: str) -> list[CloseUp]:
    """The parts of all views around one bone, in the order of the views."""
    found = []
    for view in views:
        bone = view.outline(name)
        if bone is not None and bone.after:
            found.append(CloseUp(view, bone, _box(np.concatenate([*bone.before, *bone.after]), view.shape)))
    return found


def name_places(view: ReportView, before: bool, size: float) -> dict[str, tuple[float, float]]:
    """Where to write the names of moving bones, so that they do not hide each other.

    size: height of the letters in pixels. Returns (column, row) of the middle of each name's base line, by name.
    """
    wanted = []
    for bone in view.outlines:
        lines = bone.before if before else bone.after
        if bone.kind != "anchor" and lines:
            points = max(lines, key=len)
            column, row = (points.min(axis=0) + points.max(axis=0)) / 2
            half = 0.32 * size * len(bone.name)
            column = float(
                np.clip(column, min(half, view.shape[1] / 2), max(view.shape[1] - half, view.shape[1] / 2))
            )
            wanted.append((float(row), column, half, bone.name))
    places: dict[str, tuple[float, float]] = {}
    taken: list[tuple[float, float, float]] = []
    for row, column, half, name in sorted(wanted):
        row = float(np.clip(row, 1.2 * size, view.shape[0] - 0.5 * size))
        for other, middle, width in sorted(taken):
            if abs(column - middle) < half + width and abs(row - other) < 1.15 * size:
                row = other + 1.15 * size
        taken.append((row, column, half))
        places[name] = (column, row)
    return places


def _box(points: np.ndarray, shape: tuple[int, int]) -> tuple[float, float, float, float]:
    """A box around points (N, 2) that is not too narrow, inside the picture."""
    low, high = points.min(axis=0), points.max(axis=0)
    size = high - low + 2 * np.maximum(MARGIN * (high - low), LEAST_MARGIN_PX)
    size = np.maximum(size, size.max() / 1.6)
    limits = np.array([shape[1], shape[0]], float)
    size = np.minimum(size, limits)
    corner = np.clip((low + high) / 2 - size / 2, -0.5, limits - 0.5 - size)
    return float(corner[0]), float(corner[1]), float(size[0]), float(size[1])


def _view(result: Result, number: int, side: int, outlines: tuple[BoneOutline, ...]) -> ReportView:
    camera: CameraResult = result.cameras[number]
    xray, before, after, mask = (
        _at(images, number)
        for images in (
            result.xray_images,
            result.renderings_before,
            result.renderings_after,
            result.xray_masks,
        )
    )

    def shown(image: np.ndarray | None, masked: bool = False) -> np.ndarray | None:
        if image is None:
            return None
        small = None if mask is None or not masked else shrunk(mask, side)[0] > 0.5
        return grey(shrunk(image, side)[0], small)

    overlays = None
    if xray is not None:
        seen = None if mask is None else shrunk(mask, OVERLAY_SIDE)[0] > 0.5
        overlays = Overlays(shrunk(xray, OVERLAY_SIDE)[0], seen)

    def over(rendering: np.ndarray | None) -> np.ndarray | None:
        if overlays is None or xray is None or rendering is None or rendering.shape != xray.shape:
            return None
        return (255 * overlays(shrunk(rendering, OVERLAY_SIDE)[0])).astype(np.uint8)

    name = camera.name or view_name(number)
    pictures = shown(xray, masked=True), shown(before), shown(after)
    shape = next(
        (each.shape for each in (pictures[0], pictures[2]) if each is not None), (camera.height, camera.width)
    )
    return ReportView(name, camera.similarity, shape, *pictures, over(before), over(after), outlines)


def _at(images: list[np.ndarray], number: int) -> np.ndarray | None:
    return images[number] if number < len(images) else None


def _outlines(result: Result, side: int) -> list[tuple[BoneOutline, ...]]:
    """Outlines of all structures in every view, in pixels of the shown pictures; none when labels are not known."""
    if result.structure_labels is None or not result.structures:
        return [()] * len(result.cameras)
    from PolyPoseLib.geometry.camera import review_camera
    from PolyPoseLib.rendering.select import select_backend
    from PolyPoseLib.rendering.silhouettes import Silhouettes

    silhouettes = Silhouettes(result.structure_labels, len(result.structures), select_backend())
    found = []
    for each in result.cameras:
        camera, _ = review_camera(each.camera, side)
        bones = (
            BoneOutline(
                name,
                _kind(result, name),
                silhouettes.outlines(number, camera, np.eye(4)),
                silhouettes.outlines(number, camera, bone.fixed_to_moving),
            )
            for number, (name, bone) in enumerate(result.structures.items())
        )
        found.append(tuple(each for each in bones if each.before or each.after))
    return found


def _kind(result: Result, name: str) -> str:
    if is_still(result, name):
        return "anchor"
    return "flagged" if result.structures[name].doubts else "moving"
