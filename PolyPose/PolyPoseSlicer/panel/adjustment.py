"""The Review section's Adjust tab: a bone is moved by hand, and the result is refined from there."""

from __future__ import annotations

from typing import Any

import numpy as np
from slicer.i18n import tr as _

from ..scene import fitting
from ..scene.bone_handles import BoneHandles, surface_of
from ..scene.drawing import drawn_once
from ..scene.motions import motions_of
from ..study.parameters import PolyPoseParameterNode, structures_of
from .register import RegisterPart
from .review import ReviewPart

_LEAST_MM, _LEAST_DEG = 0.05, 0.05
"""Smaller adjustments are none."""


class AdjustmentPart:
    """Handles for the bones of a result, one at a time; those that were moved stay moved until `close`."""

    def __init__(self, ui: Any, review: ReviewPart, register: RegisterPart) -> None:
        """review: shows the X-rays on which outlines follow. register: refines."""
        self._ui, self._review, self._register = ui, review, register
        self._parameters: PolyPoseParameterNode | None = None
        self._handles: dict[str, BoneHandles] = {}
        self._filling = False
        ui.adjustBone.connect("currentIndexChanged(int)", self._chosen)
        ui.adjustToggle.connect("toggled(bool)", self._toggled)
        ui.adjustReset.connect("clicked()", self.reset)
        ui.refineButton.connect("clicked()", self.refine)

    def show(self, parameters: PolyPoseParameterNode | None) -> None:
        """Another parameter node, or the same that changed."""
        self._parameters = parameters
        names = self._names()
        combo = self._ui.adjustBone
        if [combo.itemText(number) for number in range(combo.count)] != names:
            self.close()
            self._filling = True
            combo.clear()
            for name in names:
                combo.addItem(name)
            self._filling = False
        self._enable()

    @property
    def adjustments(self) -> dict[str, np.ndarray]:
        """How bones were moved by hand in the X-rays' posture, (4, 4) LPS mm; those that were not are left out."""
        found = {name: each.motion for name, each in self._handles.items() if each.present}
        return {name: motion for name, motion in found.items() if not _is_identity(motion)}

    @drawn_once
    def reset(self) -> None:
        """Put all bones back where the result has them."""
        for handles in self._handles.values():
            if handles.present:
                handles.reset()

    def refine(self) -> None:
        """Fit all bones again, from where they are now."""
        adjustments = self.adjustments
        self.stop()
        self._register.start(adjustments)

    def stop(self) -> None:
        """Take the handles away; what was moved is remembered."""
        self._ui.adjustToggle.checked = False

    @drawn_once
    def close(self) -> None:
        """Forget everything that was moved."""
        self.stop()
        for handles in self._handles.values():
            handles.remove()
        self._handles.clear()

    def _names(self) -> list[str]:
        """The bones of the result that may be moved."""
        parameters = self._parameters
        if parameters is None or parameters.outputSegmentation is None:
            return []
        present = structures_of(parameters)
        motions = motions_of(parameters.outputMotions)
        return [name for name in motions if name in present and name != parameters.anchor]

    def _enable(self) -> None:
        ui, ready = self._ui, bool(self._names()) and not self._register.running
        for name in ("adjustBone", "adjustToggle", "adjustReset", "refineButton"):
            getattr(ui, name).enabled = ready
        if not ready:
            self.stop()
        ui.adjustText.text = (
            _(
                "Move a bone with the handles in 3D and in the slices: its outline on the X-rays follows. Then refine: "
                "all bones are fitted from where they are, and none is looked for elsewhere."
            )
            if ready
            else _("Bones can be adjusted once there is a result.")
        )

    def _chosen(self, _index: int) -> None:
        if not self._filling and self._ui.adjustToggle.checked:
            self._show_handles()

    @drawn_once
    def _toggled(self, on: bool) -> None:
        if on:
            if self._parameters is None:
                return
            self._review.show_after()
            self._show_handles()
            return
        for handles in self._handles.values():
            handles.hide()

    @drawn_once
    def _show_handles(self) -> None:
        """Show the chosen bone's handles, and the outlines of all that were moved."""
        name = self._ui.adjustBone.currentText
        handles = self._handles.get(name)
        if handles is not None and not handles.present:
            handles.remove()
            handles = None
        if handles is None:
            handles = self._new_handles(name)
        if handles is None:
            return
        self._handles[name] = handles
        pictures = self._review.pictures.items
        moved = self.adjustments
        for each, other in self._handles.items():
            if each == name or each in moved:
                other.show(pictures, handles=each == name)
            else:
                other.hide()
        fitting.look_at(handles.model)

    def _new_handles(self, name: str) -> BoneHandles | None:
        parameters = self._parameters
        if parameters is None:
            return None
        segments = structures_of(parameters).get(name, [])
        content = parameters.outputSegmentation.GetSegmentation()
        segments = [each for each in segments if content.GetSegment(each) is not None]
        surface = surface_of(parameters.outputSegmentation, segments)
        if surface.GetNumberOfCells() == 0:
            self._ui.adjustText.text = _(
                "'{name}' has no voxel in the warped segmentation: register again, or choose another bone."
            ).format(name=name)
            return None
        return BoneHandles(name, surface, content.GetSegment(segments[0]).GetColor())


def _is_identity(motion: np.ndarray) -> bool:
    """Whether a motion (4, 4) is too small to be one."""
    turn = np.degrees(np.arccos(np.clip((np.trace(motion[:3, :3]) - 1) / 2, -1, 1)))
    return bool(turn < _LEAST_DEG and np.linalg.norm(motion[:3, 3]) < _LEAST_MM)
