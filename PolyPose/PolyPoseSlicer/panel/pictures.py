"""The pictures of all views: X-ray and rendering of each, and how they are compared."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import qt
import slicer
import vtk

from PolyPoseLib.geometry.camera import Camera

from ..scene import xray_views
from ..scene.cameras import camera_of
from ..scene.carm_placement import Placement
from ..scene.compare import Mode, compared, shrunk
from ..scene.frames import flip_affine, from_vtk
from ..scene.xray_views import XrayPicture
from ..study.results import OutputNodes
from ..study.xray_reading import XrayReport
from .plane_keeper import PlaneKeeper

if TYPE_CHECKING:
    from PolyPoseLib.data.xray import Xray

LONGEST_SIDE = 512
"""Pictures are drawn with at most this many pixels per side, so that they can follow a slider."""

IN_3D_MS = 250
"""The C-arms in 3D follow the pictures this long after the last change."""


class Pictures:
    """The views in order; `mode` and `amount` hold one entry per view."""

    def __init__(self) -> None:
        """No view yet."""
        self.items: list[XrayPicture] = []
        self.mode: list[Mode] = []
        self.amount: list[float] = []
        self.from_detector = True
        self.before = False
        self._phase = False
        self._keeper = PlaneKeeper()
        self._in_3d = qt.QTimer()
        self._in_3d.setSingleShot(True)
        self._in_3d.interval = IN_3D_MS
        self._in_3d.connect("timeout()", self._show_on_detectors)

    def set(self, items: list[XrayPicture], keep: bool = True) -> None:
        """Set the views; the comparison that was chosen for a view stays with its number."""
        kept = len(self.mode) if keep else 0
        self.items = items
        self.mode = [self.mode[n] if n < kept else Mode.BLEND for n in range(len(items))]
        self.amount = [self.amount[n] if n < kept else 0.5 for n in range(len(items))]
        xray_views.remove_from(len(items))

    def move_to(self, items: Sequence[XrayPicture]) -> bool:
        """Take the cameras of the same views; True when one has moved; other views are ignored."""
        if [each.name for each in items] != [each.name for each in self.items]:
            return False
        moved = [
            number
            for number, (old, new) in enumerate(zip(self.items, items, strict=True))
            if old.xray.shape == new.xray.shape and not np.allclose(old.plane, new.plane, atol=1e-6)
        ]
        for number in moved:
            self.items[number] = items[number]
            xray_views.move(number, items[number])
        return bool(moved)

    def clear(self) -> None:
        """Forget all views and take them out of the scene."""
        self._keeper.release()
        self._in_3d.stop()
        self.items, self.mode, self.amount = [], [], []
        xray_views.remove_all()

    def draw(self, number: int | None = None) -> None:
        """Draw one view, or all."""
        for each in range(len(self.items)) if number is None else [number]:
            picture = self.items[each]
            rendering = picture.before if self.before else picture.rendering
            factor = max(1, -(-max(picture.xray.shape) // LONGEST_SIDE))
            xray = shrunk(picture.xray, factor) if factor > 1 else picture.xray
            rgb = compared(xray, rendering, self.mode[each], self.amount[each], self._phase)
            xray_views.show_image(each, picture, rgb)
        if not self.flickers:
            self._in_3d.start()

    def _show_on_detectors(self) -> None:
        """Show the pictures on the detectors in 3D, once nothing changes them for a while."""
        for number in range(len(self.items)):
            xray_views.show_on_detector(number)

    def draw_carms(self) -> None:
        """Draw the C-arms in 3D."""
        for number, picture in enumerate(self.items):
            xray_views.show_carm(number, picture)

    def aim(self) -> None:
        """Let the layout's views show the pictures."""
        for number, picture in enumerate(self.items):
            xray_views.aim_view(number, picture, self.from_detector)
            self._keeper.keep(number, picture)

    def view_sizes(self) -> list[tuple[int, int] | None]:
        """Pixels across and down of each picture's view in the layout; None where it has none."""
        return [xray_views.view_size(number) for number in range(len(self.items))]

    def flicker(self) -> None:
        """Swap X-ray and rendering in the views that flicker."""
        self._phase = not self._phase
        for number, mode in enumerate(self.mode):
            if mode is Mode.FLICKER:
                self.draw(number)

    @property
    def flickers(self) -> bool:
        """Whether any view flickers."""
        return Mode.FLICKER in self.mode


def pictures_of_result(outputs: OutputNodes, reports: Sequence[XrayReport]) -> list[XrayPicture]:
    """The views of a result; without X-ray nodes, the X-rays as they are in the table."""
    pictures = []
    for number, node in enumerate(outputs.cameras):
        camera = camera_of(node)
        if camera is None or number >= len(outputs.renderings):
            continue
        rendering = _image_of(outputs.renderings[number])
        xray = _image_of(outputs.xrays[number]) if number < len(outputs.xrays) else None
        known = reports[number].xray if number < len(reports) else None
        if xray is None and known is not None and known.image.shape == rendering.shape:
            xray = known.image
        pictures.append(
            XrayPicture(
                node.GetName() if known is None else known.name,
                camera,
                _depth_of(outputs.renderings[number], camera),
                rendering if xray is None else xray,
                rendering,
                mirrored=known is None or known.mirrored,
            )
        )
    return pictures


def pictures_of_inputs(reports: Sequence[XrayReport], reference: np.ndarray) -> list[XrayPicture]:
    """The views of the table; an X-ray without a camera is put in front of the reference point (3,), LPS."""
    return [picture_of(report.xray, reference) for report in reports if report.xray is not None]


def picture_of(xray: Xray, reference: np.ndarray) -> XrayPicture:
    """An X-ray at its camera, or in front of the reference point (3,), LPS, while it has none."""
    extrinsic = Placement().extrinsic(reference) if xray.extrinsic is None else xray.extrinsic
    camera = Camera(xray.intrinsics, extrinsic, *xray.image.shape)
    return XrayPicture(xray.name, camera, xray.source_to_detector_mm, xray.image, mirrored=xray.mirrored)


def _image_of(node: slicer.vtkMRMLScalarVolumeNode) -> np.ndarray:
    return np.array(slicer.util.arrayFromVolume(node)[0])


def _depth_of(node: slicer.vtkMRMLScalarVolumeNode, camera: Camera) -> float:
    """Distance of an image's plane from the source along the axis, in mm."""
    matrix = vtk.vtkMatrix4x4()
    node.GetIJKToRASMatrix(matrix)
    return float(camera.depth(flip_affine(from_vtk(matrix))[:3, 3]))
