"""Plot views: MRML's charts drawn off screen by VTK, as the application's qMRMLPlotView maps them.

What is mapped here is what qMRMLPlotView.cxx does with charts and series: points and lines, styles, axes, titles, the
legend, and the signal of a click.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import slicer
import vtk

from .application import Signals

_LINE_STYLES = ("None", "Solid", "Dash", "Dot", "DashDot", "DashDotDot")
_MARKERS = ("None", "Cross", "Plus", "Square", "Circle", "Diamond")
_AXES = (vtk.vtkAxis.BOTTOM, vtk.vtkAxis.TOP, vtk.vtkAxis.LEFT, vtk.vtkAxis.RIGHT)


class PlotView(Signals):
    """Stands for qMRMLPlotView on a real vtkChartXY."""

    def __init__(self, node: slicer.vtkMRMLPlotViewNode, size: tuple[int, int]) -> None:
        super().__init__("dataSelected(vtkStringArray*,vtkCollection*)")
        self._node, self._chart_node, self._tag = node, None, 0
        self._plots: dict[str, vtk.vtkPlotLine] = {}
        self._context = vtk.vtkContextView()
        self._window = self._context.GetRenderWindow()
        self._window.SetOffScreenRendering(1)
        self._window.SetSize(*size)
        self._context.GetRenderer().SetBackground(1, 1, 1)
        self._chart = vtk.vtkChartXY()
        self._context.GetScene().AddItem(self._chart)
        button = vtk.vtkContextMouseEvent.LEFT_BUTTON
        self._chart.SetClickActionToButton(vtk.vtkChart.SELECT, button)
        self._chart.AddObserver(vtk.vtkCommand.SelectionChangedEvent, self._selected)
        node.AddObserver(node.PlotChartNodeChangedEvent, self._chart_changed)
        self._context.GetInteractor().Initialize()
        self._chart_changed()

    def mrmlPlotViewNode(self) -> slicer.vtkMRMLPlotViewNode:
        """The view's node."""
        return self._node

    def chart(self) -> vtk.vtkChartXY:
        """The chart that is drawn."""
        return self._chart

    def RemovePlotSelections(self) -> None:
        """Unselect all points."""
        self._chart.RemovePlotSelections()

    def save(self, path: str | Path) -> Path:
        """Draw, and write a PNG file."""
        self._window.Render()
        grabber = vtk.vtkWindowToImageFilter()
        grabber.SetInput(self._window)
        grabber.ReadFrontBufferOff()
        writer = vtk.vtkPNGWriter()
        writer.SetInputConnection(grabber.GetOutputPort())
        writer.SetFileName(str(path))
        writer.Write()
        return Path(path)

    def click(self, x: float, y: float) -> None:
        """Click with the left button where the axes have x and y."""
        self._window.Render()
        place = [self._pixel(axis, side, value) for axis, side, value in (("BOTTOM", 0, x), ("LEFT", 1, y))]
        interactor = self._context.GetInteractor()
        interactor.SetEventInformation(*place, 0, 0)
        for event in ("MouseMoveEvent", "LeftButtonPressEvent", "LeftButtonReleaseEvent"):
            interactor.InvokeEvent(event)

    def _pixel(self, name: str, side: int, value: float) -> int:
        axis = self._chart.GetAxis(getattr(vtk.vtkAxis, name))
        start, end = axis.GetPoint1()[side], axis.GetPoint2()[side]
        low, high = axis.GetMinimum(), axis.GetMaximum()
        return round(start + (value - low) / (high - low) * (end - start))

    def _chart_changed(self, *_ignored: Any) -> None:
        if self._chart_node is not None:
            self._chart_node.RemoveObserver(self._tag)
        identifier = self._node.GetPlotChartNodeID()
        self._chart_node = slicer.mrmlScene.GetNodeByID(identifier) if identifier else None
        if self._chart_node is not None:
            self._tag = self._chart_node.AddObserver(vtk.vtkCommand.ModifiedEvent, self._update)
        self._update()

    def _update(self, *_ignored: Any) -> None:
        node = self._chart_node
        series = (
            []
            if node is None
            else [node.GetNthPlotSeriesNode(n) for n in range(node.GetNumberOfPlotSeriesNodes())]
        )
        wanted = {each.GetID(): each for each in series if each is not None and _has_columns(each)}
        for identifier in [each for each in self._plots if each not in wanted]:
            self._chart.RemovePlotInstance(self._plots.pop(identifier))
        for identifier, each in wanted.items():
            if identifier not in self._plots:
                self._plots[identifier] = vtk.vtkPlotLine()
                self._chart.AddPlot(self._plots[identifier])
            _set_plot(self._plots[identifier], each)
        if node is not None:
            self._set_chart(node)
        self._context.GetScene().SetDirty(True)

    def _set_chart(self, node: slicer.vtkMRMLPlotChartNode) -> None:
        chart = self._chart
        chart.SetTitle(node.GetTitle() or "" if node.GetTitleVisibility() else "")
        chart.GetTitleProperties().SetFontSize(node.GetTitleFontSize())
        chart.SetShowLegend(node.GetLegendVisibility())
        chart.GetLegend().GetLabelProperties().SetFontSize(node.GetLegendFontSize())
        for side in _AXES:
            axis = chart.GetAxis(side)
            across = side in (vtk.vtkAxis.BOTTOM, vtk.vtkAxis.TOP)
            axis.SetTitle((node.GetXAxisTitle() if across else node.GetYAxisTitle()) or "")
            automatic = node.GetXAxisRangeAuto() if across else node.GetYAxisRangeAuto()
            axis.SetBehavior(vtk.vtkAxis.AUTO if automatic else vtk.vtkAxis.FIXED)
            if not automatic:
                low_high = [0.0, 0.0]
                (node.GetXAxisRange if across else node.GetYAxisRange)(low_high)
                axis.SetUnscaledRange(low_high)
            axis.SetGridVisible(node.GetGridVisibility())
            axis.GetTitleProperties().SetFontSize(node.GetAxisTitleFontSize())
            axis.GetLabelProperties().SetFontSize(node.GetAxisLabelFontSize())

    def _selected(self, *_ignored: Any) -> None:
        identifiers, selections = vtk.vtkStringArray(), vtk.vtkCollection()
        for identifier, plot in self._plots.items():
            selection = plot.GetSelection()
            if selection is not None and selection.GetNumberOfValues() > 0:
                selections.AddItem(selection)
                identifiers.InsertNextValue(identifier)
        self.emit("dataSelected(vtkStringArray*,vtkCollection*)", identifiers, selections)


class PlotWidget:
    """Stands for qMRMLPlotWidget."""

    def __init__(self, node: slicer.vtkMRMLPlotViewNode, size: tuple[int, int]) -> None:
        self._view = PlotView(node, size)

    def plotView(self) -> PlotView:
        """The view in it."""
        return self._view

    def mrmlPlotViewNode(self) -> slicer.vtkMRMLPlotViewNode:
        """The view's node."""
        return self._view.mrmlPlotViewNode()


def _has_columns(series: slicer.vtkMRMLPlotSeriesNode) -> bool:
    table = series.GetTableNode()
    names = (series.GetXColumnName(), series.GetYColumnName())
    columns = [] if table is None else [table.GetTable().GetColumnByName(name) for name in names]
    return bool(columns) and all(each is not None and not each.IsA("vtkStringArray") for each in columns)


def _set_plot(plot: vtk.vtkPlotLine, series: slicer.vtkMRMLPlotSeriesNode) -> None:
    plot.SetWidth(series.GetLineWidth())
    plot.SetColorF(*series.GetColor())
    plot.SetOpacity(series.GetOpacity())
    plot.GetPen().SetOpacityF(series.GetOpacity())
    styles = {getattr(series, f"LineStyle{name}"): number for number, name in enumerate(_LINE_STYLES)}
    plot.GetPen().SetLineType(styles[series.GetLineStyle()])  # vtkPen counts them in the same order
    markers = {getattr(series, f"MarkerStyle{name}"): number for number, name in enumerate(_MARKERS)}
    plot.SetMarkerSize(series.GetMarkerSize())
    plot.SetMarkerStyle(markers[series.GetMarkerStyle()])  # so does vtkPlotPoints
    plot.SetUseIndexForXSeries(False)
    plot.SetInputData(series.GetTableNode().GetTable(), series.GetXColumnName(), series.GetYColumnName())
    plot.SetLabel(series.GetName())
