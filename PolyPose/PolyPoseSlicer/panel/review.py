"""The panel's Review section: the layout, before and after, X-ray versus rendering, maps and the report."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import qt
from slicer.i18n import tr as _

from PolyPoseLib.errors import PolyPoseError
from PolyPoseLib.geometry.camera import review_camera

from ..process.renderer import Renderer
from ..scene import fitting, layouts
from ..scene.compare import Mode
from ..scene.drawing import drawn_once
from ..study.parameters import PolyPoseParameterNode, outputs_of, store_outputs
from ..study.result_origin import made_from
from ..study.snapshot import Snapshot
from ..study.xray_reading import XrayReport
from .bones_3d import Bones3DPart
from .carry import CarryPart
from .maps import MapsPart, set_checked
from .motions import MotionsPart
from .pictures import Pictures, pictures_of_inputs, pictures_of_result
from .posture import show_only_bones, show_posture
from .undo import UndoPart
from .verdict import verdict_of

FLICKER_MS = 400
RESIZED_MS = 100
"""New views get their final size about this long after the layout has changed."""

BEFORE_PIXELS = 400
"""Longer side, at most, of the CT rendered as it was scanned."""

_PURPOSE = "before"


class ReviewPart:
    """Looks at the inputs before, and at the result after a registration."""

    def __init__(
        self,
        ui: Any,
        logic: Any,
        renderer: Renderer,
        reports: Callable[[], list[XrayReport]],
        reference: Callable[[], np.ndarray],
    ) -> None:
        """reports: of the X-rays in the table. reference: a point of the patient, (3,) LPS mm."""
        self._ui, self._logic, self._renderer = ui, logic, renderer
        self._reports, self._reference = reports, reference
        self._parameters: PolyPoseParameterNode | None = None
        self._shown: Any = None
        self._after = self._running = False
        self._setting = False
        self.report_png: bytes | None = None
        self.pictures = Pictures()
        self.undo = UndoPart(ui, self._result_goes, self._result_returned)
        self.motions = MotionsPart(ui)
        self.maps = MapsPart(ui)
        self.bones = Bones3DPart(ui)
        self.carry = CarryPart(ui)
        self._flicker = qt.QTimer()
        self._flicker.interval = FLICKER_MS
        self._flicker.connect("timeout()", self.pictures.flicker)
        self._aimed_at: Any = None
        self._fitted: Any = None
        self._new = False
        self._resized = qt.QTimer()
        self._resized.setSingleShot(True)
        self._resized.interval = RESIZED_MS
        self._resized.connect("timeout()", self._aim_again)
        ui.showBefore.checked = True
        ui.layoutButton.connect("clicked()", self.enter_layout)
        ui.loadResultButton.connect("clicked()", self._ask_result)
        ui.showAfter.connect("toggled(bool)", self.set_after)
        ui.bonesOnly.connect("toggled(bool)", self._bones_only)
        ui.compareView.connect("currentIndexChanged(int)", self._view_chosen)
        ui.compareMode.connect("currentIndexChanged(int)", self._compare)
        ui.compareAmount.connect("valueChanged(double)", self._compare)
        ui.fromDetector.connect("toggled(bool)", self._turn)
        ui.showCurve.connect("toggled(bool)", self._curve_toggled)

    def show(self, parameters: PolyPoseParameterNode | None, running: bool = False) -> None:
        """Another parameter node, or the same that changed; running: whether a registration is."""
        self._parameters, self._running = parameters, running
        self.undo.show(parameters, running)
        self.motions.show(parameters)
        self.maps.show(parameters)
        self.carry.show(parameters, self._after, running)
        self._ui.showAfter.enabled = parameters is not None and parameters.outputTransform is not None
        self._show_verdict(parameters)
        self.follow_cameras()
        if parameters is not None:
            self.bones.follow(parameters)
        if parameters is not None and layouts.shown() and self._fitted not in (None, self._subject()):
            self.show_layout()

    def _show_verdict(self, parameters: PolyPoseParameterNode | None) -> None:
        """Say whether the result may be used, or that there is none."""
        ui = self._ui
        if parameters is None or parameters.outputTransform is None:
            ui.verdictLabel.setVisible(False)
            ui.reviewState.text = _("No result yet: register, or load an earlier result.")
            return
        verdict = verdict_of(outputs_of(parameters))
        ui.verdictLabel.setVisible(True)
        ui.verdictLabel.text = verdict.headline
        ui.verdictLabel.setStyleSheet(verdict.style)
        ui.reviewState.text = "\n".join(verdict.lines)

    @drawn_once
    def result_came(self, nodes: Any) -> None:
        """A registration has ended: show what it found."""
        self.report_png = nodes.report
        self._fitted = None
        self.show_after()

    def show_after(self) -> None:
        """Bring up PolyPose's layout in the posture of the X-rays, all drawn once."""
        set_checked(self._ui.showAfter, True)
        self._after = True
        self.show_layout()
        self.carry.show(self._parameters, self._after, self._running)

    def _result_goes(self) -> None:
        """Another result takes the place of this one: nothing may lie under its transform, or show its maps."""
        self.maps.hide()
        self.set_after(False)

    def _result_returned(self) -> None:
        """Show the result that is there now; the pictures of the inputs where there is none."""
        self.report_png = None
        there = self._parameters is not None and self._parameters.outputTransform is not None
        self._fitted = None
        if there and not layouts.shown():
            self._ui.showAfter.checked = True
            return
        if there:
            self.show_after()
        elif layouts.shown():
            self.show_layout()

    def refresh_pictures(self, force: bool = False) -> None:
        """Make the views' pictures from the result, or from the table while there is none."""
        if self._parameters is None:
            return
        outputs, reports = outputs_of(self._parameters), self._reports()
        state = (
            [id(each) for each in outputs.cameras],
            [id(each) for each in reports],
            self._parameters.ct and self._parameters.ct.GetID(),
        )
        if state == self._shown and not force:
            return
        self._shown = state
        items = pictures_of_result(outputs, reports)
        if not items and self._parameters.ct is not None:
            items = pictures_of_inputs(reports, self._reference())
        self.pictures.set(items)
        if items:
            set_checked(self._ui.fromDetector, items[0].mirrored)
            self.pictures.from_detector = items[0].mirrored
        self._setting = True
        view = self._ui.compareView
        view.clear()
        view.addItem(_("all"))
        for picture in items:
            view.addItem(picture.name)
        self._setting = False
        self._view_chosen()
        self.pictures.before = not self._after
        self.pictures.draw()

    def follow_cameras(self) -> None:
        """Put the pictures of the table's X-rays where their cameras are now; those of a result stay."""
        if self._parameters is None or not self.pictures.items or outputs_of(self._parameters).cameras:
            return
        moved = self.pictures.move_to(pictures_of_inputs(self._reports(), self._reference()))
        if moved and not self._after and not self._ui.carmLive.checked:
            self._render_before()

    def enter_layout(self) -> None:
        """Bring up PolyPose's layout, everything in it whole and in the middle."""
        self._fitted = None
        self.show_layout()

    @drawn_once
    def show_layout(self) -> None:
        """Bring up PolyPose's layout with all pictures and C-arms.

        Slices and 3D view are fitted where they are new or show another CT or result, and else stay as the user left
        them.
        """
        if not layouts.shown():
            self._fitted = None
        self.refresh_pictures(force=True)
        if not layouts.show(len(self.pictures.items), self._ui.showCurve.checked):
            self._ui.reviewState.text = _("Slicer has no main window to show the views in.")
        self.pictures.draw_carms()
        self.pictures.aim()
        self._resized.start()
        if self._parameters is not None:
            layouts.show_plot(self._parameters.outputPlot)
        self._show_slices()
        self._new = self._fitted != self._subject()
        if self._new:
            self._fitted = self._subject()
            self._fit()
        self._aimed_at = self._view_sizes()
        self.bones.show(self._parameters, self._after)
        self._run_flicker()
        if not self._after:
            self._render_before()

    @drawn_once
    def _aim_again(self) -> None:
        """Once the views have their final size, unless the panel was left meanwhile."""
        sizes = self._view_sizes()
        if self._parameters is not None and layouts.shown() and sizes != self._aimed_at:
            self._aimed_at = sizes
            self.pictures.aim()
            if self._new:
                self._fit()

    def _fit(self) -> None:
        """Show the patient and the C-arms whole."""
        if self._parameters is not None:
            fitting.fit_slices()
            fitting.fit_3d(self._parameters.ct, self._parameters.segmentation)

    def _subject(self) -> Any:
        """What slices and 3D view show: another one makes them new."""
        parameters = self._parameters
        if parameters is None:
            return None
        nodes = (parameters.ct, parameters.outputTransform)
        return tuple(node and node.GetID() for node in nodes)

    def _view_sizes(self) -> Any:
        return self.pictures.view_sizes(), fitting.view_sizes()

    def swap_posture(self) -> None:
        """Show the other posture."""
        if self._ui.showAfter.enabled:
            other = self._ui.showBefore if self._after else self._ui.showAfter
            other.checked = True

    def swap_flicker(self) -> None:
        """Let the chosen view, or all, flicker between X-ray and rendering, or blend them again."""
        flickers = self._ui.compareMode.currentIndex == Mode.FLICKER.value
        self._ui.compareMode.currentIndex = (Mode.BLEND if flickers else Mode.FLICKER).value

    @drawn_once
    def set_after(self, after: bool) -> None:
        """Show the posture of the X-rays, or that of the CT."""
        self._after = bool(after)
        self._ui.showBefore.checked = not after
        self._show_slices()
        self.pictures.before = not self._after
        self.pictures.draw()
        self.bones.show(self._parameters, self._after)
        self.carry.show(self._parameters, self._after, self._running)
        if not self._after:
            self._render_before()

    def list_carriable(self) -> None:
        """Nodes were added to the scene: show those that can be carried along."""
        self.carry.show(self._parameters, self._after, self._running)

    @drawn_once
    def load_result(self, folder: str) -> None:
        """Open the folder of an earlier registration in place of the result that is shown."""
        parameters = self._parameters
        if parameters is None:
            return
        before = Snapshot.of(parameters)
        try:
            bones = parameters.segmentation if made_from(folder, parameters.segmentation) else None
            nodes = self._logic.loadResult(folder, parameters.ct, bones)
        except PolyPoseError as error:
            self._ui.reviewState.text = str(error)
            return
        store_outputs(parameters, nodes)
        self.undo.remember(before)
        self.result_came(nodes)

    def close(self) -> None:
        """Stop the timers and take the pictures out of the scene."""
        self.pause()
        self._shown = self._fitted = None
        self.report_png = None
        self.bones.clear()
        self.carry.close()
        self.pictures.clear()

    def pause(self) -> None:
        """The module is left: nothing moves until it is opened again."""
        self._flicker.stop()
        self._resized.stop()

    def _show_slices(self) -> None:
        if self._parameters is not None:
            show_posture(self._parameters, self._after)
            if self._ui.bonesOnly.checked:
                show_only_bones(self._parameters, True)

    def _bones_only(self, only: bool) -> None:
        if self._parameters is not None:
            show_only_bones(self._parameters, bool(only))

    def _render_before(self, number: int = 0) -> None:
        """Render the CT as it was scanned through the final cameras, one view after another."""
        ct = self._parameters.ct if self._parameters is not None else None
        if ct is None or self._after or number >= len(self.pictures.items):
            return
        picture = self.pictures.items[number]
        if picture.before is not None:
            self._render_before(number + 1)
            return

        def done(image: np.ndarray, _seconds: float) -> None:
            parameters, items = self._parameters, self.pictures.items
            wanted = parameters is not None and parameters.ct is ct
            if wanted and number < len(items) and items[number] is picture:
                picture.before = image
                self.pictures.draw(number)
                self._render_before(number + 1)

        self._renderer.ask(ct, review_camera(picture.camera, BEFORE_PIXELS)[0], done, _PURPOSE)

    def _view_chosen(self, *_ignored: Any) -> None:
        """Show how the chosen view is compared."""
        if self._setting:
            return
        number = max(self._ui.compareView.currentIndex - 1, 0)
        if number < len(self.pictures.items):
            self._setting = True
            self._ui.compareMode.currentIndex = self.pictures.mode[number].value
            self._ui.compareAmount.setValue(100 * self.pictures.amount[number])
            self._setting = False

    @drawn_once
    def _compare(self, *_ignored: Any) -> None:
        """Compare the chosen view, or all, by the chosen method."""
        if self._setting:
            return
        chosen = self._ui.compareView.currentIndex - 1
        numbers = range(len(self.pictures.items)) if chosen < 0 else [chosen]
        for number in numbers:
            self.pictures.mode[number] = Mode(self._ui.compareMode.currentIndex)
            self.pictures.amount[number] = self._ui.compareAmount.value / 100
            self.pictures.draw(number)
        self._run_flicker()

    def _run_flicker(self) -> None:
        if self.pictures.flickers:
            self._flicker.start()
        else:
            self._flicker.stop()

    def _curve_toggled(self, _on: bool) -> None:
        if layouts.shown():
            self.show_layout()

    def _turn(self, from_detector: bool) -> None:
        self.pictures.from_detector = bool(from_detector)
        self.pictures.aim()

    def _ask_result(self) -> None:
        window = self._ui.reviewSection.window()
        folder = qt.QFileDialog.getExistingDirectory(window, _("Load a result folder"))
        if folder:
            self.load_result(str(folder))
