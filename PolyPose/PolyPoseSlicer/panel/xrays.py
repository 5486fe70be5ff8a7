"""The panel's table of X-rays: one row each, with where its geometry comes from and how reliable it is."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import qt
from slicer.i18n import tr as _

from PolyPoseLib.errors import PolyPoseError

from ..study.camera_source import CameraSource
from ..study.dropped_xrays import without_known
from ..study.field_words import in_words
from ..study.parameters import PolyPoseParameterNode, store_xray_sources, xray_sources
from ..study.xray_reading import GEOMETRY_FIELDS, XrayReader, XrayReport, geometry_from_file
from ..study.xray_source import XraySource
from .node_choice import NodeChoice
from .xray_details import XrayDetails
from .xray_drop import XrayDrop

_ENDINGS = "*.dcm *.ima *.nrrd *.nhdr *.nii *.nii.gz *.mha *.mhd *.png *.tif *.tiff"

_ROW_HEIGHT = 24

WARNING_COLOR = "#b35900"
"""For what needs attention; readable on a light and on a dark background."""

_SUMMARISED = ("source_to_detector_mm", "pixel_spacing_mm", "angles", "extrinsic")
"""Beginnings of the lines of provenance that the summary shows."""


def summary(report: XrayReport) -> list[str]:
    """The most important details: what is wrong, otherwise the warnings and where the geometry comes from."""
    if report.xray is None:
        return list(report.details)
    warnings = list(report.details[: len(report.xray.warnings)])
    return warnings + [in_words(line) for line in report.xray.provenance if line.startswith(_SUMMARISED)]


class XraysPart:
    """Shows and edits the X-rays of the parameter node.

    selected: called whenever another X-ray is selected or the selected one changes.
    """

    def __init__(self, ui: Any, choice: NodeChoice, selected: Callable[[], None]) -> None:
        """Prepare the table of the loaded form."""
        self._ui, self.choice = ui, choice
        self._selected = selected
        self._parameters: PolyPoseParameterNode | None = None
        self._sources: list[XraySource] = []
        self._shown: list[tuple[tuple[str, ...], bool]] = []
        self._was_selected: tuple | None = None
        self.reader = XrayReader()
        self._details = XrayDetails(ui, choice, self._replace)
        table = ui.xraysTable
        self._drop = XrayDrop(table, self.add_dropped, self._say)
        table.columnCount = 4
        table.setHorizontalHeaderLabels([_("X-ray"), _("Geometry from"), _("Camera"), _("State")])
        table.verticalHeader().setVisible(False)
        table.verticalHeader().setDefaultSectionSize(_ROW_HEIGHT)
        table.setEditTriggers(qt.QAbstractItemView.NoEditTriggers)
        header = table.horizontalHeader()
        header.setSectionResizeMode(qt.QHeaderView.ResizeToContents)
        header.setStretchLastSection(True)
        table.connect("itemSelectionChanged()", self._select)
        ui.xraySelector.connect("currentNodeChanged(vtkMRMLNode*)", self._enable)
        ui.addXrayButton.connect("clicked()", self.add_node)
        ui.addFilesButton.connect("clicked()", self._ask_files)
        ui.removeXrayButton.connect("clicked()", self.remove)
        ui.geometryFileButton.connect("clicked()", self._ask_geometry)
        ui.clearGeometryButton.connect("clicked()", self.clear_geometry)

    @property
    def number(self) -> int:
        """The selected row, -1 when none is."""
        row = self._ui.xraysTable.currentRow()
        return row if 0 <= row < len(self._sources) else -1

    @property
    def source(self) -> XraySource | None:
        """The selected X-ray."""
        return self._sources[self.number] if self.number >= 0 else None

    @property
    def sources(self) -> list[XraySource]:
        """All X-rays of the table."""
        return list(self._sources)

    def report(self) -> XrayReport | None:
        """What is known of the selected X-ray."""
        return None if self.source is None else self.reader.report(self.source)

    def missing_until(self, end: int | None = None) -> str:
        """One sentence about the first X-ray, of those before row `end`, that cannot be used yet; empty without one."""
        for source in self._sources[:end]:
            if self.reader.report(source).xray is None:
                return _("The X-ray '{name}' is not ready: complete its geometry, or remove it.").format(
                    name=source.name
                )
        return ""

    @property
    def have_cameras(self) -> bool:
        """Whether every X-ray has a camera already, so that none has to be searched for."""
        reports = [self.reader.report(source) for source in self._sources]
        return bool(reports) and all(
            each.xray is not None and each.xray.extrinsic is not None for each in reports
        )

    def show(self, parameters: PolyPoseParameterNode | None) -> None:
        """Show the parameter node as it is now."""
        self._parameters = parameters
        self._sources = xray_sources(parameters) if parameters is not None else []
        reports = [self.reader.report(source) for source in self._sources]
        lines = [
            ((source.name, report.geometry, report.camera, report.state), report.uncertain)
            for source, report in zip(self._sources, reports, strict=True)
        ]
        if lines != self._shown:
            self._shown = lines
            self._fill(lines)
        self._select()

    def add_node(self) -> None:
        """Add the chosen node; a sequence gives its first frame."""
        node = self._ui.xraySelector.currentNode()
        if node is not None and self._parameters is not None:
            self._add([XraySource(node, frame=0 if node.IsA("vtkMRMLSequenceNode") else None)])
            self._ui.xraySelector.setCurrentNode(None)

    def add_files(self, paths: list[str]) -> None:
        """Add one X-ray for each file."""
        if self._parameters is not None and paths:
            self._add([XraySource(path=str(path)) for path in paths])

    def add_dropped(self, sources: list[XraySource]) -> None:
        """Add X-rays that were dropped; those that are in the table already stay once in it."""
        new = without_known(sources, self._sources)
        if self._parameters is not None and new:
            self._add(new)
        elif sources:
            self._say(_("What was dropped is in the table already."))

    def remove(self) -> None:
        """Take the selected X-ray out of the table."""
        if self.number >= 0:
            self._store([each for row, each in enumerate(self._sources) if row != self.number])

    def read_geometry(self, path: str) -> None:
        """Take the selected X-ray's geometry from a file, in place of what was entered."""
        source = self.source
        if source is None or not path:
            return
        try:
            fields = geometry_from_file(path, source, self.number)
        except PolyPoseError as error:
            self._ui.xrayState.text = str(error)
            return
        self._replace(_without_source(source, {**_without_geometry(source), **fields}))

    def clear_geometry(self) -> None:
        """Forget all that was entered or read about the selected X-ray's geometry."""
        source = self.source
        if source is not None:
            self._replace(_without_source(source, _without_geometry(source)))

    def set_initial_camera(self, transform: Any, fields: dict[str, Any]) -> None:
        """Make a transform that was placed by hand the selected X-ray's initial camera, with these fields."""
        source = self.source
        if source is not None:
            fields = {**source.fields, **fields, "camera": "initial"}
            changed = {"camera_transform": transform, "camera_source": CameraSource.CARM, "found": None}
            self._replace(replace(source, fields=fields, **changed))

    def close(self) -> None:
        """Forget what was dropped and is not in the table yet."""
        self._drop.close()

    def change(self, changed: Mapping[int, XraySource]) -> None:
        """Store changed versions of X-rays by their rows, and read again those whose nodes have changed."""
        sources = [changed.get(row, each) for row, each in enumerate(self._sources)]
        if sources != self._sources:
            self._store(sources)
        self.show(self._parameters)

    def _add(self, sources: list[XraySource]) -> None:
        self._store([*self._sources, *sources])
        self._ui.xraysTable.selectRow(len(self._sources) - 1)

    def _replace(self, source: XraySource) -> None:
        """Store a changed version of the selected X-ray."""
        if self.number >= 0 and source != self.source:
            changed = list(self._sources)
            changed[self.number] = source
            self._store(changed)

    def _store(self, sources: list[XraySource]) -> None:
        if self._parameters is not None:
            store_xray_sources(self._parameters, sources)

    def _fill(self, lines: list[tuple[tuple[str, ...], bool]]) -> None:
        table = self._ui.xraysTable
        row = table.currentRow()
        blocked = table.blockSignals(True)
        table.rowCount = len(lines)
        for number, (line, uncertain) in enumerate(lines):
            for column, text in enumerate(line):
                item = qt.QTableWidgetItem(text)
                item.setToolTip(text)
                if uncertain:
                    item.setForeground(qt.QBrush(qt.QColor(WARNING_COLOR)))
                table.setItem(number, column, item)
        if lines:
            table.selectRow(min(max(row, 0), len(lines) - 1))
        table.blockSignals(blocked)

    def _select(self) -> None:
        """Show the selected X-ray below the table."""
        source, report = self.source, self.report()
        self._ui.removeXrayButton.enabled = source is not None
        self._ui.xrayDetails.enabled = source is not None
        if report is not None and report.xray is None:
            self._ui.xrayDetails.collapsed = False
        self._details.show(source, report)
        if report is None:
            self._ui.xrayState.text = _("Add two or more X-rays from different directions.")
        else:
            self._ui.xrayState.text = "\n".join(summary(report))
            self._ui.xrayState.setToolTip("\n".join(report.details))
        now = (self.number, source, report)
        if now != self._was_selected:
            self._was_selected = now
            self._selected()

    def _say(self, text: str) -> None:
        """Say something about the table, until what it shows changes."""
        self._ui.xrayState.text = text

    def _enable(self, node: Any = None) -> None:
        self._ui.addXrayButton.enabled = self._ui.xraySelector.currentNode() is not None

    def _ask_files(self) -> None:
        window = self._ui.xraysTable.window()
        kinds = f"{_('X-rays')} ({_ENDINGS});;{_('All files')} (*)"
        self.add_files(list(qt.QFileDialog.getOpenFileNames(window, _("Add X-rays"), "", kinds)))

    def _ask_geometry(self) -> None:
        window = self._ui.xraysTable.window()
        self.read_geometry(
            qt.QFileDialog.getOpenFileName(window, _("Read geometry"), "", _("Study files (*.json)"))
        )


def _without_geometry(source: XraySource) -> dict[str, Any]:
    """The fields of an X-ray without those that a geometry file may hold."""
    return {key: value for key, value in source.fields.items() if key not in GEOMETRY_FIELDS}


def _without_source(source: XraySource, fields: Mapping[str, Any]) -> XraySource:
    """An X-ray with other fields, whose camera is whatever they give; picked points stay."""
    return replace(source, fields=fields, camera_transform=None, camera_source=CameraSource.AUTO, found=None)
