"""The panel's table of segments: which move as a bone, in which structure, and which structure is the anchor."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import qt
from slicer.i18n import tr as _

from PolyPoseLib.data.label_names import propose_anchor, structure_of

from ..study.parameters import PolyPoseParameterNode, structures_of

_SEGMENT, _STRUCTURE, _ANCHOR = range(3)
_DETAILS = ("regions", "bones")

_ROW_HEIGHT = 24


@dataclass(frozen=True)
class _Line:
    """What one row of the table shows."""

    segment: str
    name: str
    color: tuple[float, float, float]
    structure: str
    anchor: bool


class StructuresPart:
    """Shows and edits `structures` and `anchor` of the parameter node."""

    def __init__(self, ui: Any) -> None:
        """Prepare the table of the loaded form."""
        self._ui = ui
        self._parameters: PolyPoseParameterNode | None = None
        self._lines: list[_Line] = []
        self._remembered: dict[str, str] = {}
        self._order: list[str] = []
        table = ui.structuresTable
        table.columnCount = 3
        table.setHorizontalHeaderLabels([_("Segment (moves)"), _("Structure"), _("Anchor")])
        table.verticalHeader().setVisible(False)
        table.verticalHeader().setDefaultSectionSize(_ROW_HEIGHT)
        header = table.horizontalHeader()
        header.setSectionResizeMode(_SEGMENT, qt.QHeaderView.Stretch)
        header.setSectionResizeMode(_STRUCTURE, qt.QHeaderView.Stretch)
        header.setSectionResizeMode(_ANCHOR, qt.QHeaderView.ResizeToContents)
        table.connect("cellChanged(int,int)", self._edited)
        ui.proposeButton.connect("clicked()", self.propose)
        ui.segmentFilter.connect("textChanged(QString)", self._filter)
        ui.includedOnly.connect("toggled(bool)", self._filter)

    def show(self, parameters: PolyPoseParameterNode | None) -> None:
        """Show the parameter node as it is now."""
        self._parameters = parameters
        lines = self._ordered(_lines_of(parameters))
        self._ui.proposeButton.enabled = bool(lines)
        if lines != self._lines:
            self._lines = lines
            self._fill()
        self._filter()
        self._ui.structuresSentence.text = self._sentence()

    def propose(self) -> None:
        """Group the segments by the names of bones, and choose an anchor."""
        detail = _DETAILS[self._ui.detailSelector.currentIndex]
        proposed = {line.segment: structure_of(line.name, detail) for line in self._lines}
        proposed = {segment: structure for segment, structure in proposed.items() if structure}
        if not proposed:
            self._ui.structuresSentence.text = _(
                "No segment has the name of a bone, such as femur_left or 'Left femur': rename the segments, or "
                "type the structures into the table."
            )
            return
        self._order = []
        self._store(proposed, propose_anchor(list(dict.fromkeys(proposed.values()))) or "")

    def _ordered(self, lines: list[_Line]) -> list[_Line]:
        """The bones first; a row stays where it is while the table is edited."""
        if {line.segment for line in lines} != set(self._order):
            lines = sorted(lines, key=lambda line: not line.structure)
            self._order = [line.segment for line in lines]
        return sorted(lines, key=lambda line: self._order.index(line.segment))

    def _fill(self) -> None:
        """Write all rows again."""
        table = self._ui.structuresTable
        blocked = table.blockSignals(True)
        table.rowCount = len(self._lines)
        for row, line in enumerate(self._lines):
            segment = _item(line.name, checkable=True, checked=bool(line.structure))
            segment.setData(qt.Qt.DecorationRole, qt.QColor.fromRgbF(*line.color))
            segment.setToolTip(_("Checked: this segment moves as a bone."))
            table.setItem(row, _SEGMENT, segment)
            table.setItem(row, _STRUCTURE, _item(line.structure, editable=True))
            anchor = _item(_("anchor") if line.anchor else "", checkable=True, checked=line.anchor)
            if not line.structure:
                anchor.setFlags(qt.Qt.NoItemFlags)
            table.setItem(row, _ANCHOR, anchor)
        table.blockSignals(blocked)

    def _edited(self, row: int, column: int) -> None:
        """The user changed a cell."""
        if self._parameters is None or row >= len(self._lines):
            return
        line = self._lines[row]
        chosen = json.loads(self._parameters.structures or "{}")
        item = self._ui.structuresTable.item(row, column)
        anchor = self._parameters.anchor
        if column == _STRUCTURE:
            self._set(chosen, line, item.text().strip())
        elif column == _SEGMENT:
            included = item.checkState() == qt.Qt.Checked
            name = self._remembered.get(line.segment) or structure_of(line.name) or line.name
            self._set(chosen, line, name if included else "")
        elif item.checkState() == qt.Qt.Checked:
            anchor = line.structure
        if line.anchor and anchor not in chosen.values():
            anchor = chosen.get(line.segment, "")  # the anchor was renamed, or left out
        self._store(chosen, anchor)

    def _set(self, chosen: dict[str, str], line: _Line, structure: str) -> None:
        """Give one segment a structure; an empty name takes it out and is remembered."""
        if structure:
            chosen[line.segment] = structure
        elif line.segment in chosen:
            self._remembered[line.segment] = chosen.pop(line.segment)

    def _store(self, chosen: dict[str, str], anchor: str) -> None:
        """Write into the parameter node, in one change; the table follows it."""
        parameters = self._parameters
        if parameters is None:
            return
        known = {line.segment for line in self._lines}
        chosen = {segment: structure for segment, structure in chosen.items() if segment in known}
        self._lines = []  # what the user entered is shown again as it was understood
        was = parameters.StartModify()
        parameters.structures = json.dumps(chosen)
        parameters.anchor = anchor
        parameters.EndModify(was)
        self.show(parameters)

    def _filter(self, *_ignored: Any) -> None:
        """Hide the rows that were not asked for."""
        wanted = self._ui.segmentFilter.text.strip().lower()
        for row, line in enumerate(self._lines):
            found = wanted in line.name.lower() or wanted in line.structure.lower()
            hidden = not found or (self._ui.includedOnly.checked and not line.structure)
            self._ui.structuresTable.setRowHidden(row, hidden)

    def _sentence(self) -> str:
        """How many bones move, and about which."""
        if self._parameters is None or not self._lines:
            return _("Choose a CT and its segmentation; every bone needs a segment.")
        structures = structures_of(self._parameters)
        if not structures:
            return _("No segment is included yet: propose structures, or check segments in the table.")
        anchor = self._parameters.anchor
        if anchor not in structures:
            return _("{count} structures; now check the anchor, which stays where it is.").format(
                count=len(structures)
            )
        moving = ", ".join(name for name in structures if name != anchor)
        if not moving:
            return _(
                "Only the anchor, '{anchor}', is included: the cameras will be found, and no bone moves."
            ).format(anchor=anchor)
        return _("Moving relative to the anchor, '{anchor}': {names}.").format(anchor=anchor, names=moving)


def _lines_of(parameters: PolyPoseParameterNode | None) -> list[_Line]:
    """One line per segment, in the segmentation's order."""
    if parameters is None or parameters.segmentation is None:
        return []
    content = parameters.segmentation.GetSegmentation()
    chosen = json.loads(parameters.structures or "{}")
    lines = []
    for segment in content.GetSegmentIDs():
        structure = chosen.get(segment, "")
        found = content.GetSegment(segment)
        lines.append(
            _Line(
                segment,
                found.GetName(),
                tuple(found.GetColor()),
                structure,
                bool(structure) and structure == parameters.anchor,
            )
        )
    return lines


def _item(text: str, editable: bool = False, checkable: bool = False, checked: bool = False) -> Any:
    """A cell of the table."""
    item = qt.QTableWidgetItem(text)
    flags = qt.Qt.ItemIsEnabled | qt.Qt.ItemIsSelectable
    if editable:
        flags = flags | qt.Qt.ItemIsEditable
    if checkable:
        flags = flags | qt.Qt.ItemIsUserCheckable
        item.setCheckState(qt.Qt.Checked if checked else qt.Qt.Unchecked)
    item.setFlags(flags)
    return item
