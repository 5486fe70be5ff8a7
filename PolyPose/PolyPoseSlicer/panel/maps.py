"""The panel's Deformation box: the transform as a grid or as arrows, the volume change, and a structure's weight."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from slicer.i18n import tr as _

from PolyPoseLib.data.options import USUAL_EPSILON
from PolyPoseLib.errors import PolyPoseError

from ..process.background import Background
from ..scene import deformation, layouts
from ..scene.drawing import drawn_once
from ..study.parameters import PolyPoseParameterNode, Preset, structures_of

_OVERLAY_OPACITY = 0.55


class MapsPart:
    """Shows how the result's transform deforms the CT; one overlay at a time."""

    def __init__(self, ui: Any) -> None:
        """Connect the widgets of the loaded form."""
        self._ui = ui
        self._parameters: PolyPoseParameterNode | None = None
        self._setting = False
        self._background = Background()
        ui.showGrid.connect("toggled(bool)", self._grid_toggled)
        ui.showGlyphs.connect("toggled(bool)", self._glyphs_toggled)
        ui.showJacobian.connect("toggled(bool)", self._jacobian_toggled)
        ui.weightStructure.connect("currentIndexChanged(int)", self._weight_chosen)

    @property
    def busy(self) -> bool:
        """Whether a map is being computed."""
        return self._background.busy

    def show(self, parameters: PolyPoseParameterNode | None) -> None:
        """Another parameter node, or the same that changed."""
        if parameters is None:
            self._background.drop()
        self._parameters = parameters
        ui = self._ui
        for name in ("showGrid", "showGlyphs", "showJacobian"):
            getattr(ui, name).enabled = parameters is not None and parameters.outputTransform is not None
        names = list(structures_of(parameters)) if parameters is not None else []
        if [ui.weightStructure.itemText(n) for n in range(1, ui.weightStructure.count)] != names:
            self._setting = True
            ui.weightStructure.clear()
            for name in (_("nothing"), *names):
                ui.weightStructure.addItem(name)
            self._setting = False

    @drawn_once
    def hide(self) -> None:
        """Show no map."""
        for name in ("showGrid", "showGlyphs", "showJacobian"):
            getattr(self._ui, name).checked = False
        self._ui.weightStructure.currentIndex = 0

    def _grid_toggled(self, on: bool) -> None:
        if on:
            set_checked(self._ui.showGlyphs, False)
        self._show_transform()

    def _glyphs_toggled(self, on: bool) -> None:
        if on:
            set_checked(self._ui.showGrid, False)
        self._show_transform()

    @drawn_once
    def _show_transform(self) -> None:
        ui, parameters = self._ui, self._parameters
        if parameters is not None and parameters.outputTransform is not None:
            what = "grid" if ui.showGrid.checked else "glyphs" if ui.showGlyphs.checked else ""
            deformation.show_transform(parameters.outputTransform, parameters.outputVolume, what)

    def _jacobian_toggled(self, on: bool) -> None:
        self._background.drop()
        if not on or self._parameters is None:
            self._ui.jacobianText.text = ""
            _overlay(None)
            return
        try:
            work = deformation.volume_change(self._parameters.outputTransform)
        except PolyPoseError as error:
            self._failed(error)
            return
        self._setting = True
        self._ui.weightStructure.currentIndex = 0
        self._setting = False
        self._compute(work, self._show_change)

    @drawn_once
    def _show_change(self, change: deformation.VolumeChange) -> None:
        self._ui.jacobianText.text = change.text
        _overlay(deformation.show_volume_change(change))

    def _weight_chosen(self, index: int) -> None:
        if self._setting or self._parameters is None:
            return
        self._background.drop()
        set_checked(self._ui.showJacobian, False)
        if index <= 0:
            self._ui.jacobianText.text = ""
            _overlay(None)
            return
        parameters, name = self._parameters, self._ui.weightStructure.itemText(index)
        options = json.loads(parameters.options or "{}")
        usual = "mass" if parameters.preset is Preset.PAPER else "rigid"
        weighting = deformation.Weighting(
            options.get("weights") or usual, options.get("epsilon") or USUAL_EPSILON
        )
        try:
            work = deformation.structure_weight(
                parameters.segmentation, structures_of(parameters), name, weighting
            )
        except PolyPoseError as error:
            self._failed(error)
            return
        self._compute(work, partial(self._show_weight, name))

    @drawn_once
    def _show_weight(self, name: str, weight: tuple[np.ndarray, np.ndarray]) -> None:
        self._ui.jacobianText.text = _("Black: '{name}' has no influence; yellow: only '{name}' has.").format(
            name=name
        )
        _overlay(deformation.show_weight(*weight, name))

    def _compute(self, work: Callable[[], Any], done: Callable[[Any], None]) -> None:
        """Compute a map without holding up the application."""
        self._ui.jacobianText.text = _("Computing...")
        self._background.run(work, done, self._failed)

    def _failed(self, error: Exception) -> None:
        _overlay(None)
        self._ui.jacobianText.text = str(error)


def set_checked(box: Any, checked: bool) -> None:
    """Check a box without emitting its signal."""
    blocked = box.blockSignals(True)
    box.checked = checked
    box.blockSignals(blocked)


def _overlay(volume: Any) -> None:
    """Lay a map over the slices, or take it away."""
    for composite in layouts.anatomy_views():
        composite.SetForegroundVolumeID(volume.GetID() if volume is not None else None)
        composite.SetForegroundOpacity(_OVERLAY_OPACITY if volume is not None else 0.0)
