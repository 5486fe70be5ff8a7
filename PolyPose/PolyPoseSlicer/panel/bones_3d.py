"""The Review section's bones in 3D: made piece by piece, and moved with Before and After."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import qt

from ..scene import layouts
from ..scene.bone_models import BoneModels
from ..scene.drawing import drawn_once
from ..scene.motions import motions_of
from ..study.parameters import PolyPoseParameterNode, structures_of


class Bones3DPart:
    """Shows the bones while PolyPose's layout is the current one and the box is checked."""

    def __init__(self, ui: Any) -> None:
        """Connect the box of the loaded form."""
        self._box = ui.bones3D
        self._parameters: PolyPoseParameterNode | None = None
        self._after = False
        self._models = BoneModels()
        self._steps: Iterator[None] | None = None
        self._made_from: Any = None
        self._timer = qt.QTimer()
        self._timer.interval = 0
        self._timer.connect("timeout()", self._step)
        self._box.connect("toggled(bool)", self._toggled)

    @property
    def busy(self) -> bool:
        """Whether surfaces are still being made."""
        return self._steps is not None

    def show(self, parameters: PolyPoseParameterNode | None, after: bool) -> None:
        """Show the bones of a parameter node: where the X-rays have them, or where the CT has them."""
        self._parameters, self._after = parameters, after
        wanted = self._box.checked and layouts.shown()
        source = _source(parameters) if parameters is not None and wanted else None
        if parameters is None or source is None:
            self.clear()
        elif source != self._made_from or (not self.busy and set(self._models.names) != set(source[1])):
            self._made_from = source
            self._steps = self._models.build(parameters.segmentation, source[1])
            self._timer.start()
        elif not self.busy:
            self._place()

    def follow(self, parameters: PolyPoseParameterNode) -> None:
        """The parameter node changed: bones that are shown may be others now, or gone."""
        if self._made_from is not None:
            self.show(parameters, self._after)

    def clear(self) -> None:
        """Take the bones away."""
        self._timer.stop()
        self._steps, self._made_from = None, None
        self._models.clear()

    @drawn_once
    def _step(self) -> None:
        """Make one more surface."""
        parameters, steps = self._parameters, self._steps
        if steps is None or parameters is None or _source(parameters) != self._made_from:
            self.clear()
            return
        try:
            next(steps)
        except StopIteration:
            self._timer.stop()
            self._steps = None
            self._place()

    @drawn_once
    def _place(self) -> None:
        parameters = self._parameters
        motions = motions_of(parameters.outputMotions) if parameters is not None and self._after else {}
        self._models.place({name: each.matrix for name, each in motions.items()})

    def _toggled(self, _on: bool) -> None:
        self.show(self._parameters, self._after)


def _source(parameters: PolyPoseParameterNode) -> tuple[str, dict[str, list[str]]] | None:
    """What the surfaces are made from; None while there is nothing."""
    structures = structures_of(parameters)
    if parameters.segmentation is None or not structures:
        return None
    return parameters.segmentation.GetID(), structures
