"""The panel's table of motions: absolute or relative to a structure, copied and saved."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import qt
from slicer.i18n import tr as _

from ..scene.motions import MotionRow, motion_rows, motions_of
from ..study.parameters import PolyPoseParameterNode

_ROW_HEIGHT = 24
_UNCERTAINTY = 7
"""The column of the table; tool tips and saved tables have the details."""

_NUMBERS = re.compile(r"-|[-+]?[0-9.]+(?:, [-+]?[0-9.]+)*")
"""Cells of numbers alone, which may begin with a sign, or of nothing."""


def motion_header(relative_to: str | None) -> list[str]:
    """Titles of the columns."""
    shift = _("Displacement [mm]")
    return [
        _("Structure") if relative_to is None else _("Relative to {name}").format(name=relative_to),
        _("Rotation [deg]"),
        shift,
        _("Right [mm]"),
        _("Anterior [mm]"),
        _("Superior [mm]"),
        _("Axis (R, A, S)"),
        _("Uncertainty"),
        _("Doubts"),
    ]


def motion_line(row: MotionRow) -> list[str]:
    """One row of the table as texts."""
    right, front, up = row.translation_mm
    return [
        row.name,
        _decimals(row.rotation_deg),
        _decimals((right**2 + front**2 + up**2) ** 0.5),
        _decimals(right),
        _decimals(front),
        _decimals(up),
        ", ".join(_decimals(part) for part in row.axis) if row.rotation_deg > 1e-3 else "-",
        uncertainty_text(row.uncertainty),
        "; ".join(row.doubts),
    ]


def _decimals(number: float) -> str:
    """Two decimals, without a minus before zero."""
    return f"{round(float(number), 2) + 0.0:.2f}"


def uncertainty_text(numbers: dict[str, float]) -> str:
    """The uncertainties as people read them; empty when there are none."""
    return "; ".join(f"{name.replace('_', ' ')} {value:.2g}" for name, value in numbers.items())


def uncertainty_summary(numbers: dict[str, float]) -> str:
    """The largest uncertainty of the place and of the rotation, in a few characters; empty when there are none."""
    parts = []
    for unit, sign in (("[mm]", " mm"), ("[deg]", "\u00b0")):
        values = [value for name, value in numbers.items() if unit in name]
        if values:
            parts.append(f"\u00b1 {max(values):.2g}{sign}")
    return ", ".join(parts)


class MotionsPart:
    """Shows the motions of the result's table node."""

    def __init__(self, ui: Any) -> None:
        """Prepare the table of the loaded form."""
        self._ui = ui
        self._motions: dict[str, Any] = {}
        self._rows: list[list[str]] = []
        table = ui.motionsTable
        table.verticalHeader().setVisible(False)
        table.verticalHeader().setDefaultSectionSize(_ROW_HEIGHT)
        table.setEditTriggers(qt.QAbstractItemView.NoEditTriggers)
        table.horizontalHeader().setSectionResizeMode(qt.QHeaderView.ResizeToContents)
        ui.relativeTo.connect("currentIndexChanged(int)", self._fill)
        ui.copyMotions.connect("clicked()", self.copy)
        ui.saveMotions.connect("clicked()", self._ask_file)

    @property
    def relative_to(self) -> str | None:
        """The structure that is held still, None for the anchor's frame."""
        index = self._ui.relativeTo.currentIndex
        return list(self._motions)[index - 1] if 0 < index <= len(self._motions) else None

    def show(self, parameters: PolyPoseParameterNode | None) -> None:
        """Show the motions of the parameter node's result."""
        motions = motions_of(parameters.outputMotions) if parameters is not None else {}
        if list(motions) != list(self._motions):
            combo = self._ui.relativeTo
            blocked = combo.blockSignals(True)
            combo.clear()
            combo.addItem(_("the CT (absolute)"))
            for name in motions:
                combo.addItem(name)
            combo.currentIndex = 0
            combo.blockSignals(blocked)
        self._motions = motions
        for name in ("copyMotions", "saveMotions", "relativeTo"):
            getattr(self._ui, name).enabled = bool(motions)
        self._fill()

    @property
    def lines(self) -> list[list[str]]:
        """The rows of the table as texts."""
        return [list(row) for row in self._rows]

    def text(self, separator: str = "\t") -> str:
        """The table as text with a header: tabs for the clipboard, commas for a file."""
        lines = [motion_header(self.relative_to), *self._rows]
        return "\n".join(separator.join(_quoted(cell, separator) for cell in line) for line in lines) + "\n"

    def copy(self) -> None:
        """Put the table on the clipboard."""
        qt.QApplication.clipboard().setText(self.text())

    def save(self, path: str) -> None:
        """Write the table as CSV; raises OSError when that fails."""
        Path(path).write_text(self.text(","), encoding="utf-8-sig")

    def _fill(self, *_ignored: Any) -> None:
        rows = motion_rows(self._motions, self.relative_to) if self._motions else []
        self._rows = [motion_line(row) for row in rows]
        table, header = self._ui.motionsTable, motion_header(self.relative_to)
        table.columnCount = len(header)
        table.setHorizontalHeaderLabels(header)
        table.rowCount = len(self._rows)
        table.setColumnHidden(len(header) - 1, not any(row.doubts for row in rows))
        for number, line in enumerate(self._rows):
            shown = [
                *line[:_UNCERTAINTY],
                uncertainty_summary(rows[number].uncertainty),
                *line[_UNCERTAINTY + 1 :],
            ]
            for column, text in enumerate(line):
                item = qt.QTableWidgetItem(shown[column])
                item.setToolTip(text)
                if column:
                    item.setTextAlignment(qt.Qt.AlignRight | qt.Qt.AlignVCenter)
                table.setItem(number, column, item)

    def _ask_file(self) -> None:
        window = self._ui.motionsTable.window()
        path = qt.QFileDialog.getSaveFileName(window, _("Save motions"), "motions.csv", _("Tables (*.csv)"))
        if path:
            try:
                self.save(str(path))
            except OSError as error:
                self._ui.reviewState.text = _(
                    "{path} cannot be written ({reason}): choose another folder."
                ).format(path=path, reason=error.strerror)


def _quoted(cell: str, separator: str) -> str:
    """A cell as tables are written: in quotation marks where it must be, and text that no spreadsheet computes.

    Names are whatever a segmentation brings; one that begins like a formula would be run where the table is opened.
    """
    if cell[:1] in ("=", "+", "-", "@", "\t", "\r") and not _NUMBERS.fullmatch(cell):
        cell = "'" + cell
    if any(each in cell for each in (separator, '"', "\n", "\r", "\t")):
        return '"' + cell.replace('"', '""') + '"'
    return cell
