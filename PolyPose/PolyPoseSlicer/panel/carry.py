"""The Review section's tab Carry along: nodes of the CT's posture that follow Before and After."""

from __future__ import annotations

from typing import Any

import numpy as np
import qt
from slicer.i18n import tr as _

from PolyPoseLib.data.carried import CarriedPoints
from PolyPoseLib.errors import PolyPoseError

from ..process.background import Background
from ..scene.carried_nodes import carriable_nodes, is_points, moved_nodes, put_back, put_under
from ..scene.carried_points import CarriedMarkups, defined_points, through_transform
from ..scene.drawing import drawn_once
from ..scene.ellipsoids import EllipsoidModel
from ..study.carried_points import PointSet, carry_sets, said_of
from ..study.parameters import PolyPoseParameterNode, carried_nodes, own_nodes, store_carried
from ..study.scene_result import missing_for_bones, point_carrier


class CarryPart:
    """Lists what can be carried along, and shows what is picked in the posture of the X-rays.

    Models, segmentations and volumes are put under the result's transform. Markups stay as they are and copies of them
    are shown instead, since points inside bones take the bone's own motion.
    """

    def __init__(self, ui: Any) -> None:
        """Connect the widgets of the loaded form."""
        self._list, self._state, self._box = ui.carryList, ui.carryState, ui.carryEllipsoids
        self._parameters: PolyPoseParameterNode | None = None
        self._after = self._running = self._filling = False
        self._listed: list[tuple[str, str]] = []
        self.markups, self.ellipsoids = CarriedMarkups(), EllipsoidModel()
        self._background = Background()
        self._carrier: Any = None
        self._made_from: Any = None
        self._shown: Any = None
        self._list.connect("itemChanged(QListWidgetItem*)", self._picked)
        self._box.connect("toggled(bool)", self._box_toggled)

    @property
    def busy(self) -> bool:
        """Whether points are being carried."""
        return self._background.busy

    def show(self, parameters: PolyPoseParameterNode | None, after: bool, running: bool = False) -> None:
        """Another parameter node or posture, or the same that changed; running: whether a registration is."""
        self._parameters, self._after, self._running = parameters, after, running
        if parameters is None:
            self._background.drop()
            self._shown = None
            return
        self._fill(parameters)
        self._place(parameters)

    @drawn_once
    def close(self) -> None:
        """Put everything back where it was."""
        self._stop_points()
        self._carrier = self._made_from = None
        self.markups.keep([])
        for node in moved_nodes():
            put_back(node)

    def _fill(self, parameters: PolyPoseParameterNode) -> None:
        """Show what can be picked."""
        nodes = carriable_nodes(own_nodes(parameters))
        picked = {each.GetID() for each in carried_nodes(parameters)}
        listed = [(each.GetID(), each.GetName()) for each in nodes]
        self._filling = True
        if listed != self._listed:
            self._listed = listed
            self._list.clear()
            for node in nodes:
                item = qt.QListWidgetItem(node.GetName())
                item.setToolTip(_tip(node))
                item.setCheckState(qt.Qt.Unchecked)
                self._list.addItem(item)
        for row, (identifier, _name) in enumerate(listed):
            wanted = qt.Qt.Checked if identifier in picked else qt.Qt.Unchecked
            if self._list.item(row).checkState() != wanted:
                self._list.item(row).setCheckState(wanted)
        self._filling = False

    def _picked(self, *_ignored: Any) -> None:
        """Somebody has checked or unchecked a node."""
        if self._filling or self._parameters is None:
            return
        checked = {
            identifier
            for row, (identifier, _name) in enumerate(self._listed)
            if self._list.item(row).checkState() == qt.Qt.Checked
        }
        nodes = carriable_nodes(own_nodes(self._parameters))
        store_carried(self._parameters, [each for each in nodes if each.GetID() in checked])
        self._place(self._parameters)

    @drawn_once
    def _place(self, parameters: PolyPoseParameterNode) -> None:
        """Bring every node to where the shown posture has it."""
        picked, transform = carried_nodes(parameters), parameters.outputTransform
        after = self._after and transform is not None
        # While a registration runs, its transform is all that is known of the bones' motions.
        under = [each for each in picked if after and (self._running or not is_points(each))]
        points = [each for each in picked if after and each not in under]
        stay = {each.GetID() for each in under}
        for node in moved_nodes():
            if node.GetID() not in stay:
                put_back(node)
        for node in under:
            put_under(node, transform)
        self.markups.keep(points)
        if points:
            self._show_points(parameters, points)
        else:
            self._stop_points()
            self._say(parameters, picked)

    def _stop_points(self) -> None:
        self._background.drop()
        self._shown = None
        self.ellipsoids.clear()

    def _show_points(self, parameters: PolyPoseParameterNode, nodes: list[Any]) -> None:
        """Show markups where the displacement field has them, at once, and then where the core carries them."""
        sets = {
            node.GetID(): PointSet(points, node.IsA("vtkMRMLMarkupsLineNode") and len(points) == 2)
            for node in nodes
            for points in [defined_points(node)]
        }
        made_from = _bones_key(parameters)
        wanted = made_from, {name: each.key for name, each in sets.items()}
        if wanted == self._shown and all(self.markups.copy_of(each) is not None for each in nodes):
            return
        self._shown = wanted
        for node in nodes:
            points = sets[node.GetID()].points
            moved = through_transform(parameters.outputTransform, points)
            self.markups.place(node, moved, [""] * len(points))
        if made_from != self._made_from:
            self._carrier, self._made_from = None, made_from
        known = self._carrier
        try:
            make = point_carrier(parameters) if known is None else lambda: known
        except PolyPoseError as error:
            self._failed(error)
            return

        def work() -> Any:
            carrier = make()
            return carrier, carry_sets(carrier, sets)

        self._state.text = _("Computing...")
        self._background.run(work, lambda outcome: self._carried(nodes, *outcome), self._failed)

    @drawn_once
    def _carried(self, nodes: list[Any], carrier: Any, carried: dict[str, CarriedPoints]) -> None:
        """The core has carried the points."""
        self._carrier = carrier
        for node in nodes:
            if node.GetScene() is not None and node.GetID() in carried:
                each = carried[node.GetID()]
                self.markups.place(node, each.points, each.moved_by)
        points = np.concatenate([each.points for each in carried.values()])
        covariances = np.concatenate([each.covariances for each in carried.values()])
        self.ellipsoids.show(points, covariances, bool(self._box.checked))
        self._state.text = said_of(carried)

    def _failed(self, error: Exception) -> None:
        self.ellipsoids.clear()
        self._state.text = _("Points follow the displacement field alone: {reason}").format(reason=error)

    def _say(self, parameters: PolyPoseParameterNode, picked: list[Any]) -> None:
        """What is missing for something to be carried, or what to do."""
        missing = missing_for_bones(parameters)
        if not self._listed:
            text = _("Nothing to carry: load or make markups, models, segmentations or volumes of the CT.")
        elif not picked:
            text = missing or _("Check what shall follow Before and After.")
        else:
            text = missing or _("Choose After in the tab Compare to see it in the posture of the X-rays.")
            if self._after and not missing:
                text = _("Shown in the posture of the X-rays.")
        self._state.text = text

    def _box_toggled(self, on: bool) -> None:
        self.ellipsoids.set_visible(bool(on))


def _bones_key(parameters: PolyPoseParameterNode) -> Any:
    """What the carrier of points is made from."""
    nodes = (parameters.ct, parameters.segmentation, parameters.outputTransform, parameters.outputMotions)
    content = parameters.segmentation.GetSegmentation() if parameters.segmentation is not None else None
    times = [None if each is None else (each.GetID(), each.GetMTime()) for each in nodes]
    return times, content and content.GetMTime(), parameters.structures


def _tip(node: Any) -> str:
    if is_points(node):
        return _(
            "Points inside a bone take the bone's own motion; all others, the displacement field. The markups "
            "themselves stay as they are: copies of them are shown."
        )
    return _("Is put under the result's transform while After is shown, and back for Before.")
