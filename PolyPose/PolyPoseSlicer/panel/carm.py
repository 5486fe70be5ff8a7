"""The panel's C-arm: sliders for its angles and distances, and the CT's rendering live on the X-ray."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import qt
import slicer
from slicer.i18n import tr as _

from PolyPoseLib.errors import PolyPoseError
from PolyPoseLib.geometry.camera import REVIEW_PIXELS, Camera, review_camera

from ..process.renderer import Renderer
from ..scene import xray_views
from ..scene.cameras import set_camera
from ..scene.carm_placement import Placement, intrinsics_at
from ..scene.compare import Mode, compared, shrunk
from ..scene.drawing import drawn_once
from ..scene.frames import flip_vectors
from ..scene.names import free_name
from ..scene.xray_views import XrayPicture
from ..study.parameters import PolyPoseParameterNode, structures_of
from .pictures import IN_3D_MS
from .xrays import XraysPart

if TYPE_CHECKING:
    from PolyPoseLib.data.xray import Xray

_SLIDERS = {
    "carmPrimary": "primary_deg",
    "carmSecondary": "secondary_deg",
    "carmRotation": "rotation_deg",
    "carmIsocenterDistance": "source_to_isocenter_mm",
    "carmDetectorDistance": "source_to_detector_mm",
}
_ROUND = ("carmPrimary", "carmRotation")
"""Sliders of a full turn: beyond half of it they go on at the other end."""

_TABLE = ("carmLateral", "carmVertical", "carmLongitudinal")
_PURPOSE = "C-arm"


class CarmPart:
    """Sliders, live overlay, and the initial camera that they set."""

    def __init__(self, ui: Any, xrays: XraysPart, renderer: Renderer, show_views: Callable[[], None]) -> None:
        """show_views: called to bring the X-ray views up when the overlay is switched on."""
        self._ui, self._xrays, self._renderer, self._show_views = ui, xrays, renderer, show_views
        self._parameters: PolyPoseParameterNode | None = None
        self._setting = False
        self._grey: tuple[Any, np.ndarray] | None = None
        self._rendering: tuple[Any, np.ndarray] | None = None
        self.seconds: list[float] = []
        self._placed: tuple[int, XrayPicture] | None = None
        self._in_3d = qt.QTimer()
        self._in_3d.setSingleShot(True)
        self._in_3d.interval = IN_3D_MS
        self._in_3d.connect("timeout()", self._show_in_3d)
        for name in (*_SLIDERS, *_TABLE):
            getattr(ui, name).connect("valueChanged(double)", self._moved)
        for name in _ROUND:
            getattr(ui, name).connect("valueChanged(double)", partial(self._turned, getattr(ui, name)))
        ui.carmOpacity.connect("valueChanged(double)", self._blend)
        ui.carmLive.connect("toggled(bool)", self._toggled)
        ui.carmReset.connect("clicked()", self.reset)
        ui.carmUse.connect("clicked()", self.use)

    def show(self, parameters: PolyPoseParameterNode | None) -> None:
        """Another parameter node, or the same that changed."""
        self._parameters = parameters
        self._enable()

    def xray_selected(self) -> None:
        """Another X-ray is selected, or its geometry changed: the sliders follow it."""
        self._enable()
        self.reset()

    def stop(self) -> None:
        """Stop the live overlay."""
        self._ui.carmLive.checked = False

    def placement(self) -> Placement:
        """The placement that the sliders show."""
        values = {field: getattr(self._ui, name).value for name, field in _SLIDERS.items()}
        return Placement(**values, table_mm=tuple(getattr(self._ui, name).value for name in _TABLE))

    def reset(self) -> None:
        """Put the sliders where the X-ray's own geometry says, or to a frontal view."""
        xray = self._xray()
        if xray is None or self._ct() is None:
            return
        distance = xray.source_to_detector_mm
        placement = Placement(source_to_isocenter_mm=0.7 * distance, source_to_detector_mm=distance)
        if xray.extrinsic is not None:
            placement = Placement.of(xray.extrinsic, distance, self.reference())
        self._set(placement)

    def look_at(self, extrinsic: np.ndarray) -> None:
        """Show a camera, (4, 4) world LPS mm to camera, live on the selected X-ray; nothing is stored."""
        xray = self._xray()
        if xray is None or self._ct() is None:
            return
        self._set(Placement.of(extrinsic, xray.source_to_detector_mm, self.reference()))
        self._ui.carmLive.checked = True

    def use(self) -> None:
        """Make the shown camera the X-ray's initial one: a transform node and the distance that was set."""
        source, xray, camera = self._xrays.source, self._xray(), self._camera()
        if source is None or xray is None or camera is None:
            return
        node = source.camera_transform
        if node is None:
            name = free_name(_("Initial camera of {name}").format(name=source.name))
            node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLLinearTransformNode", name)
        set_camera(node, camera)
        fields: dict[str, Any] = {"mirrored": xray.mirrored, "extrinsic": None}
        distance = float(self._ui.carmDetectorDistance.value)
        if abs(distance - xray.source_to_detector_mm) > 0.5:
            fields |= {"source_to_detector_mm": distance, "intrinsics": None}
        self._xrays.set_initial_camera(node, fields)
        self._ui.carmStatus.text = _("The registration of '{name}' will start from this camera.").format(
            name=source.name
        )

    def reference(self) -> np.ndarray:
        """The patient's reference point (3,), LPS mm: the middle of the anchor's segments, or of the CT.

        The origin while no CT is chosen.
        """
        parameters = self._parameters
        if parameters is None or parameters.ct is None:
            return np.zeros(3)
        segments = structures_of(parameters).get(parameters.anchor, [])
        centers = [parameters.segmentation.GetSegmentCenterRAS(each) for each in segments]
        centers = [each for each in centers if each is not None]
        if centers:
            return flip_vectors(np.mean(centers, axis=0))
        bounds = [0.0] * 6
        parameters.ct.GetRASBounds(bounds)
        return flip_vectors(np.array(bounds).reshape(3, 2).mean(axis=1))

    def _xray(self) -> Xray | None:
        report = self._xrays.report()
        return report.xray if report is not None else None

    def _ct(self) -> slicer.vtkMRMLScalarVolumeNode | None:
        return self._parameters.ct if self._parameters is not None else None

    def _camera(self) -> Camera | None:
        """The camera of the sliders for the selected X-ray at its own size."""
        xray = self._xray()
        if xray is None or self._ct() is None:
            return None
        placement = self.placement()
        intrinsics = intrinsics_at(
            xray.intrinsics, xray.source_to_detector_mm, placement.source_to_detector_mm
        )
        return Camera(intrinsics, placement.extrinsic(self.reference()), *xray.image.shape)

    def _set(self, placement: Placement) -> None:
        """Move the sliders, and render once."""
        self._setting = True
        for name, field in _SLIDERS.items():
            getattr(self._ui, name).setValue(getattr(placement, field))
        for name, value in zip(_TABLE, placement.table_mm, strict=True):
            getattr(self._ui, name).setValue(value)
        self._setting = False
        self._moved()

    def _enable(self) -> None:
        """Say what is missing before the C-arm can be placed."""
        ui = self._ui
        possible = self._xray() is not None and self._ct() is not None
        for name in ("carmLive", "carmReset", "carmUse"):
            getattr(ui, name).enabled = possible
        if not possible:
            self.stop()
            ui.carmStatus.text = (
                _("Choose the CT first.") if self._ct() is None else _("Select an X-ray that is ready.")
            )

    def _toggled(self, live: bool) -> None:
        if live:
            self._ui.carmStatus.text = _("Preparing the CT...")
            self._show_views()
            self._moved()
        else:
            self._renderer.forget(_PURPOSE)
            self._rendering = self._placed = None
            self._in_3d.stop()
            self._ui.carmStatus.text = ""

    def _turned(self, slider: Any, value: float) -> None:
        """Go on at the other end: 181 degrees are -179."""
        if abs(value) > 180:
            slider.setValue(value - np.copysign(360.0, value))

    def _moved(self, *_ignored: Any) -> None:
        """A slider moved: ask for the new rendering, the newest only."""
        if self._setting or not self._ui.carmLive.checked:
            return
        try:
            camera = self._camera()
        except PolyPoseError as error:
            self._ui.carmStatus.text = str(error)
            return
        ct, xray = self._ct(), self._xray()
        if camera is not None and ct is not None:
            done = partial(self._rendered, xray)
            self._renderer.ask(ct, review_camera(camera)[0], done, _PURPOSE)

    def _rendered(self, xray: Xray | None, rendering: np.ndarray, seconds: float) -> None:
        """A rendering for an X-ray came: lay it over that, unless another is selected by now."""
        if not self._ui.carmLive.checked or xray is not self._xray():
            return
        self._rendering = (xray, rendering)
        self.seconds.append(seconds)
        self._ui.carmStatus.text = _("Live ({milliseconds:.0f} ms per image).").format(
            milliseconds=1000 * seconds
        )
        self._blend()

    @drawn_once
    def _blend(self, *_ignored: Any) -> None:
        xray, camera = self._xray(), self._camera()
        if xray is None or camera is None or self._rendering is None or not self._ui.carmLive.checked:
            return
        rendered_for, rendering = self._rendering
        if rendered_for is not xray:
            return
        factor = max(1, -(-max(xray.image.shape) // (2 * REVIEW_PIXELS)))
        if self._grey is None or self._grey[0] is not xray:
            self._grey = (xray, shrunk(xray.image, factor) if factor > 1 else xray.image)
        rgb = compared(self._grey[1], rendering, Mode.BLEND, self._ui.carmOpacity.value / 100)
        picture = XrayPicture(
            xray.name, camera, self._ui.carmDetectorDistance.value, xray.image, mirrored=xray.mirrored
        )
        number = self._xrays.number
        xray_views.show_image(number, picture, rgb)
        xray_views.aim_view(number, picture, self._ui.fromDetector.checked)
        self._placed = (number, picture)
        self._in_3d.start()

    def _show_in_3d(self) -> None:
        """Put the C-arm in 3D where its X-ray is now, once the sliders rest."""
        if self._placed is not None and self._ui.carmLive.checked:
            xray_views.show_carm(*self._placed)
