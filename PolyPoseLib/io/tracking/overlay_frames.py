"""One frame of a sequence as a picture: every view's X-ray side by side, the bones' outlines where they were found."""

from __future__ import annotations

import math
from collections.abc import Sequence as Many
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.data.tracking.sequence import Sequence, TrackView
from PolyPoseLib.data.tracking.track import Track, TrackedFrame
from PolyPoseLib.errors import InputError, one_line
from PolyPoseLib.geometry.camera import Camera, review_camera
from PolyPoseLib.io.report.figure import take_literally
from PolyPoseLib.io.report.figure_parts import AFTER_COLOUR, ANCHOR_COLOUR, FLAGGED_COLOUR
from PolyPoseLib.io.report.pictures import GreyScale, shrunk
from PolyPoseLib.io.report.views import BoneOutline, ReportView, name_places
from PolyPoseLib.rendering.select import select_backend
from PolyPoseLib.rendering.silhouettes import Silhouettes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TALLEST, WIDEST = 720, 2560
"""Pixels of the X-rays' height, and of the width of all together."""

LEAST_HEIGHT = 360
"""Small X-rays are enlarged to this many pixels, so that names can be read."""

STRIP = 34
"""Pixels of the strip above the X-rays, for frame and time, and of the one below, for the key."""

MOST_NAMES = 12
"""Of bones; more would hide the X-rays."""

LOOKED_AT = 5
"""Frames, evenly spread, by which each view gets one window of grey for all: any of them may be blank."""

KEY = "Blue: bones as found. Yellow: {reference}, the reference. Pink, dashed: flagged as uncertain."

_COLOURS = {"anchor": ANCHOR_COLOUR, "moving": AFTER_COLOUR, "flagged": FLAGGED_COLOUR}
_GAP = 6
_LETTERS = 12
_LONGEST = 40
_DPI = 100


@dataclass(frozen=True, eq=False)
class _Cell:
    """A view with its camera, binned to what is shown, and its axes in the figure."""

    view: TrackView
    camera: Camera
    place: Axes


class OverlayFrames:
    """Draws the frames of a track; what is prepared once serves all of them.

    Parameters
    ----------
    track : Track
        Poses.
    sequence : Sequence
        What was tracked: structures and X-rays.

    Attributes
    ----------
    height, width : int
        Of all pictures, even numbers of pixels.

    Raises
    ------
    InputError
        Matplotlib is missing, or the track is of other structures or views than the sequence.

    """

    def __init__(self, track: Track, sequence: Sequence) -> None:
        if track.names != sequence.structures.names or set(track.cameras) != {
            each.name for each in sequence.views
        }:
            raise InputError("The track is of other structures or cameras than the sequence: track it again.")
        try:
            from matplotlib.backends.backend_agg import FigureCanvasAgg
            from matplotlib.figure import Figure
        except ImportError as error:
            raise InputError(
                "The video needs matplotlib, which is not installed: pip install matplotlib."
            ) from error
        self._track = track
        labels = sequence.ct.with_voxels(sequence.structures.labels)
        self._silhouettes = Silhouettes(labels, len(track.names), select_backend())
        self._key = KEY.format(reference=_short(track.reference))
        self._scales: dict[str, GreyScale] = {}
        self._rows = _shown_height(sequence.views)
        widths = [
            max(round(self._rows * view.camera.width / view.camera.height), 2) for view in sequence.views
        ]
        self.height = self._rows + 2 * STRIP
        self.width = _even(sum(widths) + _GAP * (len(widths) - 1))
        self._figure = Figure(figsize=(self.width / _DPI, self.height / _DPI), dpi=_DPI, facecolor="#000000")
        self._canvas = FigureCanvasAgg(self._figure)
        left = 0
        self._cells = []
        for view, width in zip(sequence.views, widths, strict=True):
            camera, _ = review_camera(track.cameras[view.name], max(self._rows, width))
            self._cells.append(_Cell(view, camera, self._axes(left, width, camera)))
            left += width + _GAP

    def picture(self, frame: TrackedFrame) -> np.ndarray:
        """One frame as (height, width, 3) uint8; raises InputError where an X-ray cannot be read."""
        for text in [*self._figure.texts]:
            text.remove()
        for cell in self._cells:
            self._draw_view(cell, frame)
        seconds = frame.frame / self._track.frames_per_second
        smoothed = "   smoothed over time" if self._track.smoothed else ""
        lost = _short(", ".join(name for name in self._track.names if self._is_lost(frame, name)))
        missing = f"   lost: {lost}" if lost else ""
        line = f"frame {frame.frame}   {seconds:.3f} s{smoothed}{missing}"
        self._write(12, STRIP / 2, line, 15, "#ffffff")
        if self._track.distrust:
            self._write(self.width - 12, STRIP / 2, "NOT TO BE TRUSTED", 15, "#ff6b5e", right=True)
        self._write(12, self.height - STRIP / 2, self._key, 12, "#c5ccd3")
        self._canvas.draw()
        return np.asarray(self._canvas.buffer_rgba())[: self.height, : self.width, :3].copy()

    def _draw_view(self, cell: _Cell, frame: TrackedFrame) -> None:
        """An X-ray with the outlines of all bones that are not lost."""
        if cell.view.name not in self._scales:
            some = np.linspace(0, len(self._track.frames) - 1, LOOKED_AT).round().astype(int)
            shown = [self._shrunk(cell, self._track.frames[n]) for n in dict.fromkeys(some)]
            self._scales[cell.view.name] = GreyScale.of_several(shown)
        small, _ = self._shrunk(cell, frame)
        rows, columns = cell.camera.height, cell.camera.width
        place = cell.place
        for artist in [*place.images, *place.collections, *place.texts]:
            artist.remove()
        grey = self._scales[cell.view.name](small)
        place.imshow(grey, cmap="gray", vmin=0, vmax=255, interpolation="bilinear", aspect="auto")
        outlines = self._outlines(cell.camera, frame)
        for bone in outlines:
            _draw_outline(place, bone)
        if len(outlines) <= MOST_NAMES:
            size = (rows, columns)
            shown = ReportView("", math.nan, size, None, None, None, None, None, tuple(outlines))
            _draw_names(place, shown, _LETTERS * rows / self._rows)
        _draw_text(place, 0.012, 0.985, _short(cell.view.name), "#ffffff", corner=True)

    def _shrunk(self, cell: _Cell, frame: TrackedFrame) -> tuple[np.ndarray, np.ndarray]:
        """A view's image as it is shown and its mask, bool, both (H, W) of the binned camera."""
        image, mask = cell.view.images.read(cell.view.first + frame.frame)
        whole = self._track.cameras[cell.view.name]
        if image.shape != (whole.height, whole.width):
            raise InputError(
                f'The image of "{cell.view.name}" in frame {frame.frame} has {image.shape} pixels but its camera '
                f"{(whole.height, whole.width)}: give the images that were tracked."
            )
        largest = max(cell.camera.height, cell.camera.width)
        return shrunk(image, largest)[0], shrunk(mask, largest)[0] > 0.5

    def _outlines(self, camera: Camera, frame: TrackedFrame) -> list[BoneOutline]:
        found = []
        for k, name in enumerate(self._track.names):
            if self._is_lost(frame, name):
                continue
            kind = "flagged" if frame.doubts[k] else "anchor" if name == self._track.reference else "moving"
            polygons = self._silhouettes.outlines(k, camera, frame.poses[k])
            found.append(BoneOutline(_short(name), kind, [], polygons))
        return found

    def _is_lost(self, frame: TrackedFrame, name: str) -> bool:
        """Whether a structure has no pose in a frame."""
        k = self._track.names.index(name)
        return frame.sources[k] == "none" or not np.isfinite(frame.poses[k]).all()

    def _write(
        self, column: float, row: float, text: str, size: float, colour: str, right: bool = False
    ) -> None:
        """Write in pixels of the whole picture."""
        take_literally(
            self._figure.text(
                column / self.width, 1 - row / self.height, text, fontsize=size * 72 / _DPI, color=colour,
                va="center", ha="right" if right else "left",
            )
        )  # fmt: skip

    def _axes(self, left: int, width: int, camera: Camera) -> Axes:
        """Axes in pixels of a binned camera, between both strips."""
        bottom = STRIP / self.height
        place = self._figure.add_axes(
            (left / self.width, bottom, width / self.width, self._rows / self.height)
        )
        place.set_axis_off()
        place.set_autoscale_on(False)
        place.set_xlim(-0.5, camera.width - 0.5)
        place.set_ylim(camera.height - 0.5, -0.5)
        return place


def _shown_height(views: Many[TrackView]) -> int:
    """Pixels of height of all X-rays, so that none is too small, and all together are not too wide."""
    height = min(max(LEAST_HEIGHT, *(each.camera.height for each in views)), TALLEST)
    width = sum(height * each.camera.width / each.camera.height for each in views)
    return _even(min(height, height * WIDEST / width))


def _even(pixels: float) -> int:
    """A whole even number of pixels, as video needs it."""
    return max(2, 2 * math.ceil(pixels / 2))


def _draw_outline(place: Axes, bone: BoneOutline) -> None:
    from matplotlib.collections import LineCollection

    lines = [np.concatenate([each, each[:1]]) for each in bone.after]
    style = (0, (4, 2.5)) if bone.kind == "flagged" else "solid"
    place.add_collection(
        LineCollection(lines, colors=_COLOURS[bone.kind], linewidths=1.3, linestyles=[style]), autolim=False
    )


def _draw_names(place: Axes, view: ReportView, size: float) -> None:
    """Names of all bones but the reference, which the key names; size: of letters in pixels of the shown X-ray."""
    kinds = {bone.name: bone.kind for bone in view.outlines}
    for name, (column, row) in name_places(view, False, size).items():
        _draw_text(place, column, row, name, _COLOURS[kinds[name]])


def _draw_text(place: Axes, x: float, y: float, text: str, colour: str, corner: bool = False) -> None:
    """Write with a dark edge; corner: x and y are shares of the X-ray, of the text's upper left corner."""
    from matplotlib.patheffects import withStroke

    written = place.text(
        x, y, text, fontsize=_LETTERS * 72 / _DPI, color=colour, ha="left" if corner else "center",
        va="top" if corner else "baseline", transform=place.transAxes if corner else place.transData, clip_on=True,
        path_effects=[withStroke(linewidth=2, foreground="#000000")],
    )  # fmt: skip
    take_literally(written)


def _short(text: str) -> str:
    plain = one_line(text)
    return plain if len(plain) <= _LONGEST else plain[: _LONGEST - 3] + "..."
