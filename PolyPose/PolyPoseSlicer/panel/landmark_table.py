"""The panel's table of landmarks: how far each projects from its counterpart, and whether it is used."""

from __future__ import annotations

from html import escape
from typing import Any

import qt
from slicer.i18n import tr as _

from ..study.landmark_fit import LandmarkFit, fit_sentence
from .xrays import WARNING_COLOR

_ROW_HEIGHT = 22


class LandmarkTable:
    """The table and the sentences below it."""

    def __init__(self, ui: Any) -> None:
        """Prepare the table of the loaded form."""
        self._ui = ui
        self._indices: list[tuple[int, int]] = []
        table = ui.landmarksTable
        table.columnCount = 4
        table.setHorizontalHeaderLabels([_("Landmark"), _("Error [mm]"), _("Error [px]"), _("State")])
        table.verticalHeader().setVisible(False)
        table.verticalHeader().setDefaultSectionSize(_ROW_HEIGHT)
        table.setEditTriggers(qt.QAbstractItemView.NoEditTriggers)
        table.horizontalHeader().setStretchLastSection(True)
        table.connect("itemSelectionChanged()", self._enable)
        self.show(None)

    def selected(self) -> tuple[int, int] | None:
        """Places in the CT's and in the X-ray's list of the selected pair."""
        row = self._ui.landmarksTable.currentRow()
        return self._indices[row] if 0 <= row < len(self._indices) else None

    def show(self, fit: LandmarkFit | None) -> None:
        """Show a fit, or none."""
        lines = [] if fit is None else _lines(fit)
        self._indices = (
            [] if fit is None else list(zip(fit.pairs.ct_indices, fit.pairs.xray_indices, strict=True))
        )
        table = self._ui.landmarksTable
        blocked = table.blockSignals(True)
        row = table.currentRow()
        table.rowCount = len(lines)
        for number, (texts, uncertain) in enumerate(lines):
            for column, text in enumerate(texts):
                item = qt.QTableWidgetItem(text)
                if uncertain:
                    item.setForeground(qt.QBrush(qt.QColor(WARNING_COLOR)))
                table.setItem(number, column, item)
        if 0 <= row < len(lines):
            table.selectRow(row)
        table.blockSignals(blocked)
        if fit is None:
            self.say("")
        else:
            self.say(fit_sentence(fit), uncertain=not fit.sure)
        self._enable()

    def say(self, text: str, uncertain: bool = True) -> None:
        """Sentences below the table; what needs attention is marked."""
        html = escape(text, quote=False).replace("\n", "<br>")
        if text and uncertain:
            html = f'<span style="color:{WARNING_COLOR}">&#9888; {html}</span>'
        self._ui.landmarksText.text = html

    def _enable(self) -> None:
        self._ui.removeLandmark.enabled = self.selected() is not None


def _lines(fit: LandmarkFit) -> list[tuple[tuple[str, ...], bool]]:
    """The cells of each row, and whether it needs attention."""
    found, lines = fit.solution, []
    for number, name in enumerate(fit.pairs.names):
        if found is None:
            lines.append(((name, "-", "-", _("pending")), False))
            continue
        used = bool(found.inliers[number])
        errors = f"{found.errors_mm[number]:.1f}", f"{found.errors_px[number]:.1f}"
        lines.append(
            ((name, *errors, _("used") if used else _("excluded: inconsistent with the others")), not used)
        )
    lines += [((name, "-", "-", _("only in the CT")), True) for name in fit.pairs.ct_alone]
    lines += [((name, "-", "-", _("only in the X-ray")), True) for name in fit.pairs.xray_alone]
    lines += [((name, "-", "-", _("not on the X-ray")), True) for name in fit.pairs.off_image]
    return lines
