"""The sections of the form as steps: one is open at a time, and those that are done bear a check mark."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import qt

SECTIONS = (
    "inputsSection",
    "xraysSection",
    "cameraSection",
    "carmSection",
    "registerSection",
    "reviewSection",
    "motionSection",
)
_NEXT = {"inputsSection": "xraysSection", "xraysSection": "registerSection"}
"""What opens when a step is done: the optional steps are skipped."""

_GROWING = "inputsSection"
"""The section whose table takes the height that is left."""


class Steps:
    """Opens, closes and marks the sections."""

    def __init__(self, ui: Any) -> None:
        """Connect the sections of the loaded form."""
        self._sections = {name: getattr(ui, name) for name in SECTIONS}
        self._titles = {name: section.text for name, section in self._sections.items()}
        self._done: dict[str, bool] = {}
        self._opening = False
        self._area, self._contents = ui.stepsArea, ui.steps
        for name, section in self._sections.items():
            section.connect("contentsCollapsed(bool)", partial(self._toggled, name))
            self._toggled(name, section.collapsed)

    @property
    def current(self) -> str:
        """The open section's name; empty when none is."""
        return next((name for name, section in self._sections.items() if not section.collapsed), "")

    def open(self, name: str) -> None:
        """Open a section, and close the others."""
        self._opening = True
        for each, section in self._sections.items():
            section.collapsed = each != name
        self._opening = False
        self._widen()
        self._area.verticalScrollBar().setValue(0)

    def show(self, done: Mapping[str, bool]) -> None:
        """Mark what is done, by section; when the open step has just been done, the next one opens."""
        self._widen()
        before, self._done = self._done, dict(done)
        for name, section in self._sections.items():
            title = self._titles[name]
            section.text = f"\u2713 {title}" if done.get(name) else title
        current = self.current
        following = _NEXT.get(current, "")
        just_done = before and done.get(current) and not before.get(current)
        if just_done and following and not done.get(following):
            self.open(following)

    def _widen(self) -> None:
        """Ask for the contents' width: a scroll area does not, and would cut them off."""
        bar = self._area.style().pixelMetric(qt.QStyle.PM_ScrollBarExtent)
        self._area.setMinimumWidth(self._contents.minimumSizeHint.width() + bar)

    def _toggled(self, name: str, collapsed: bool) -> None:
        if name == _GROWING:
            layout = self._contents.layout()
            layout.setStretch(layout.indexOf(self._sections[name]), 0 if collapsed else 1)
        if not collapsed and not self._opening:
            self.open(name)
