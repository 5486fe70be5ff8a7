"""The Motion section's settings: how to track, kept in the parameter node."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import qt

from ..study.parameters import PolyPoseParameterNode
from ..study.track_plan import TrackPlan
from ..study.track_request import Start, TrackRequest, TrackSettings

_STARTS = tuple(Start)
_WIDGETS = (
    "trackRate", "trackFirst", "trackLast", "trackReference", "trackStart", "trackStill", "trackBackward",
    "trackSmooth",
)  # fmt: skip


class TrackForm:
    """Shows the settings of the parameter node, and stores what a person changes."""

    def __init__(self, ui: Any) -> None:
        """Connect the widgets of the loaded form."""
        self._ui = ui
        self._parameters: PolyPoseParameterNode | None = None
        self._showing = False
        for start in _STARTS:
            ui.trackStart.addItem(start.label())
        for name, signal, field, read in (
            ("trackRate", "valueChanged(double)", "frames_per_second", lambda: float(ui.trackRate.value)),
            ("trackFirst", "valueChanged(int)", "first", lambda: int(ui.trackFirst.value)),
            ("trackLast", "valueChanged(int)", "last", self._last),
            (
                "trackReference",
                "currentIndexChanged(int)",
                "reference",
                lambda: str(ui.trackReference.currentText),
            ),
            (
                "trackStart",
                "currentIndexChanged(int)",
                "start",
                lambda: _STARTS[max(ui.trackStart.currentIndex, 0)],
            ),
            ("trackStill", "itemChanged(QListWidgetItem*)", "still", self._still),
            ("trackBackward", "toggled(bool)", "backward", lambda: bool(ui.trackBackward.checked)),
            ("trackSmooth", "toggled(bool)", "smooth", lambda: bool(ui.trackSmooth.checked)),
        ):
            getattr(ui, name).connect(signal, partial(self._edited, field, read))

    def show(
        self, parameters: PolyPoseParameterNode | None, request: TrackRequest | None, plan: TrackPlan
    ) -> None:
        """Show the settings, in the ranges that the images give them."""
        self._parameters = parameters
        self._showing = True
        ui = self._ui
        settings = TrackSettings() if request is None else request.settings
        names = [] if request is None else list(request.by_structure())
        ui.trackRate.value = settings.frames_per_second
        last = max(plan.available - 1, 0)
        for name, value in (("trackFirst", plan.frames.start), ("trackLast", max(plan.frames.stop - 1, 0))):
            box = getattr(ui, name)
            box.maximum = last
            box.value = min(value, last)
        _offer(ui.trackReference, names)
        reference = "" if request is None else request.reference
        ui.trackReference.currentIndex = names.index(reference) if reference in names else -1
        ui.trackStart.currentIndex = _STARTS.index(settings.start)
        ui.trackBackward.checked = settings.backward
        ui.trackSmooth.checked = settings.smooth
        self._show_still(names, settings.still)
        self._showing = False

    def enable(self, on: bool) -> None:
        """Let the settings be changed, or not while a tracking is running."""
        for name in _WIDGETS:
            getattr(self._ui, name).enabled = on

    def _show_still(self, names: Sequence[str], still: Sequence[str]) -> None:
        box = self._ui.trackStill
        if [box.item(row).text() for row in range(box.count)] != list(names):
            box.clear()
            for name in names:
                item = qt.QListWidgetItem(name)
                item.setFlags(qt.Qt.ItemIsUserCheckable | qt.Qt.ItemIsEnabled)
                box.addItem(item)
        for row, name in enumerate(names):
            box.item(row).setCheckState(qt.Qt.Checked if name in still else qt.Qt.Unchecked)

    def _edited(self, field: str, read: Callable[[], Any], *_ignored: Any) -> None:
        """Store one setting; those that nobody touches stay what the images make of them."""
        if not self._showing and self._parameters is not None:
            before = TrackSettings.of(self._parameters.tracking)
            self._parameters.tracking = replace(before, **{field: read()}).text()

    def _last(self) -> int | None:
        """The last frame; None for the end, also where images come later."""
        box = self._ui.trackLast
        return None if box.value == box.maximum else int(box.value)

    def _still(self) -> tuple[str, ...]:
        box = self._ui.trackStill
        rows = [box.item(row) for row in range(box.count)]
        return tuple(each.text() for each in rows if each.checkState() == qt.Qt.Checked)


def _offer(box: Any, names: Sequence[str]) -> None:
    """Fill a list with names, unless it holds them already."""
    if [box.itemText(number) for number in range(box.count)] != list(names):
        box.clear()
        for name in names:
            box.addItem(name)
