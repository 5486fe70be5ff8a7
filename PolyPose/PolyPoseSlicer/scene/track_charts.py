"""A joint's angles and translations over time as Slicer's plots, with the frame that is shown."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import slicer
from slicer.i18n import tr as _

from PolyPoseLib.data.tracking.joint_curves import Curve, JointCurves
from PolyPoseLib.errors import one_line

from .motions import set_table
from .names import free_name
from .track_parts import TrackParts

FRAME, TIME = "frame", "time_s"
"""Columns of every table, named as in joints.csv."""

_COLORS = ((0.12, 0.47, 0.71), (0.17, 0.55, 0.17), (0.80, 0.36, 0.0))
_DOUBTFUL_COLOR, _CURSOR_COLOR = (0.85, 0.1, 0.55), (0.25, 0.25, 0.25)
_BAND_OPACITY = 0.35


@dataclass(frozen=True)
class _Kind:
    """Angles, or translations."""

    key: str
    title: str
    axis: str
    doubtful: str
    cursor: str


def make_charts(parts: TrackParts, joints: Sequence[JointCurves]) -> None:
    """Two charts for every joint."""
    for number, joint in enumerate(joints):
        for place, kind in enumerate(_kinds(joint.name)):
            _Maker(parts, joint, 2 * number + place, kind).make()


def move_cursors(parts: TrackParts, seconds: float) -> None:
    """Let the cursor of every chart stand at a time."""
    for node in parts.all_of("cursor"):
        column = node.GetTable().GetColumnByName(TIME)
        if column is None or column.GetValue(0) == seconds:
            continue
        for row in range(column.GetNumberOfTuples()):
            column.SetValue(row, seconds)
        column.Modified()
        node.GetTable().Modified()


def frame_of_point(series: slicer.vtkMRMLPlotSeriesNode | None, point: int) -> int | None:
    """The frame to which a point of a curve, band or marker belongs; None for those of other plots."""
    table = series.GetTableNode() if series is not None else None
    column = table.GetTable().GetColumnByName(FRAME) if table is not None else None
    if column is None or not 0 <= point < column.GetNumberOfTuples():
        return None
    value = column.GetVariantValue(point).ToDouble()
    return None if np.isnan(value) else round(value)


def _kinds(joint: str) -> tuple[_Kind, _Kind]:
    joint = one_line(joint)
    return (
        _Kind(
            "angles",
            _("{joint} angles").format(joint=joint),
            _("angle [deg]"),
            _("{joint} angles, doubtful").format(joint=joint),
            _("{joint} angles, this frame").format(joint=joint),
        ),
        _Kind(
            "translations",
            _("{joint} translations").format(joint=joint),
            _("translation [mm]"),
            _("{joint} translations, doubtful").format(joint=joint),
            _("{joint} translations, this frame").format(joint=joint),
        ),
    )


class _Maker:
    """Makes one chart; number: its place among all charts of the track."""

    def __init__(self, parts: TrackParts, joint: JointCurves, number: int, kind: _Kind) -> None:
        self._parts, self._joint, self._number, self._kind = parts, joint, number, kind
        self._curves: tuple[Curve, ...] = getattr(joint, kind.key)
        self._series: list[slicer.vtkMRMLPlotSeriesNode] = []

    def make(self) -> None:
        """Make tables, series and the chart."""
        table = self._table("table", _("{title}, values").format(title=self._kind.title), self._values())
        bands = self._table("bands", _("{title}, intervals").format(title=self._kind.title), self._bands())
        for curve, color in zip(self._curves, _colors(), strict=False):
            name = _("{quantity}, 95 %").format(quantity=self._words(curve))
            self._add(bands, curve.name, name, color).SetOpacity(_BAND_OPACITY)
        for curve, color in zip(self._curves, _colors(), strict=False):
            self._add(table, curve.name, self._words(curve), color).SetLineWidth(2)
        if self._joint.doubtful.any():
            self._mark_doubtful()
        low, high = self._range()
        cursor = self._table(
            "cursor",
            _("{title}, cursor").format(title=self._kind.title),
            {TIME: [0.0, 0.0], "value": [low, high]},
        )
        series = self._add(cursor, "value", self._kind.cursor, _CURSOR_COLOR)
        series.SetLineStyle(series.LineStyleDash)
        self._chart()

    def _words(self, curve: Curve) -> str:
        return f"{one_line(self._joint.name)} {curve.name.replace('_', ' ')}"

    def _values(self) -> dict[str, list]:
        columns: dict[str, list] = {FRAME: self._joint.frames.tolist(), TIME: self._joint.seconds.tolist()}
        for curve in self._curves:
            columns[curve.name] = curve.values.tolist()
            columns[f"{curve.name}_95"] = curve.half_widths_95.tolist()
        return columns

    def _bands(self) -> dict[str, list]:
        """Slicer's plots fill no areas: every interval is a bar, and there is a gap between bars."""
        nothing = np.full(len(self._joint.frames), np.nan)
        columns = {FRAME: _threes(*[self._joint.frames] * 3), TIME: _threes(*[self._joint.seconds] * 3)}
        for curve in self._curves:
            half = np.where(np.isfinite(curve.half_widths_95), curve.half_widths_95, np.nan)
            columns[curve.name] = _threes(curve.values - half, curve.values + half, nothing)
        return columns

    def _mark_doubtful(self) -> None:
        rows = np.flatnonzero(self._joint.doubtful)
        values = np.concatenate([curve.values[rows] for curve in self._curves])
        known = np.isfinite(values)
        columns = {
            FRAME: np.tile(self._joint.frames[rows], len(self._curves))[known].tolist(),
            TIME: np.tile(self._joint.seconds[rows], len(self._curves))[known].tolist(),
            "value": values[known].tolist(),
        }
        table = self._table("doubtful", _("{title}, doubtful frames").format(title=self._kind.title), columns)
        series = self._add(table, "value", self._kind.doubtful, _DOUBTFUL_COLOR)
        series.SetLineStyle(series.LineStyleNone)
        series.SetMarkerStyle(series.MarkerStyleCross)
        series.SetMarkerSize(10)

    def _range(self) -> tuple[float, float]:
        """Of everything that is plotted."""
        values = np.concatenate([curve.values for curve in self._curves] or [np.zeros(1)])
        halves = np.concatenate([curve.half_widths_95 for curve in self._curves] or [np.zeros(1)])
        halves = np.where(np.isfinite(halves), halves, 0.0)
        if not np.isfinite(values).any():
            return 0.0, 1.0
        return float(np.nanmin(values - halves)), float(np.nanmax(values + halves))

    def _table(self, role: str, name: str, columns: dict[str, list]) -> slicer.vtkMRMLTableNode:
        node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLTableNode", free_name(name))
        set_table(node, columns)
        return self._parts.made(role, self._number, node)

    def _add(
        self, table: slicer.vtkMRMLTableNode, column: str, name: str, color: tuple[float, float, float]
    ) -> slicer.vtkMRMLPlotSeriesNode:
        series = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLPlotSeriesNode", free_name(name))
        series.SetAndObserveTableNodeID(table.GetID())
        series.SetXColumnName(TIME)
        series.SetYColumnName(column)
        series.SetPlotType(series.PlotTypeScatter)
        series.SetMarkerStyle(series.MarkerStyleNone)
        series.SetColor(*color)
        self._series.append(series)
        return self._parts.made(f"series{self._number}", len(self._series) - 1, series)

    def _chart(self) -> None:
        chart = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLPlotChartNode", free_name(self._kind.title))
        for series in self._series:
            chart.AddAndObservePlotSeriesNodeID(series.GetID())
        chart.SetTitle(self._kind.title)
        chart.SetXAxisTitle(_("time [s]"))
        chart.SetYAxisTitle(self._kind.axis)
        chart.SetTitleFontSize(12)
        chart.SetAxisTitleFontSize(11)
        chart.SetLegendFontSize(8)
        chart.SetLegendVisibility(True)
        self._parts.made("chart", self._number, chart)


def _threes(first: np.ndarray, second: np.ndarray, third: np.ndarray) -> list:
    """The values in turn."""
    return np.stack([first, second, third], axis=1).ravel().tolist()


def _colors() -> Iterator[tuple[float, float, float]]:
    while True:
        yield from _COLORS
