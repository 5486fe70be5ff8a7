"""Clicks on points of the track's plots."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import slicer
import vtk

from .track_charts import frame_of_point
from .track_layout import PLOT_VIEWS

_SIGNAL = "dataSelected(vtkStringArray*,vtkCollection*)"


class PlotClicks:
    """Follows the plot views of the track's layout.

    Slicer's plot view emits its signal twice for a click, before and after the point is selected, and what was selected
    on other curves stays so: selections are taken back at once, and an empty one is no click.
    """

    def __init__(self, go_to: Callable[[int], None]) -> None:
        """go_to: called with the frame of the point that was clicked."""
        self._go_to = go_to
        self._views: list[Any] = []
        self._clearing = False

    def connect(self) -> None:
        """Follow the views that the layout has now."""
        manager = slicer.app.layoutManager()
        if manager is None:
            return
        for number in range(manager.plotViewCount):
            widget = manager.plotWidget(number)
            node = widget.mrmlPlotViewNode()
            view = widget.plotView()
            if node is not None and node.GetLayoutName() in PLOT_VIEWS and view not in self._views:
                view.connect(_SIGNAL, self._selected)
                self._views.append(view)

    def release(self) -> None:
        """Follow none any more."""
        for view in self._views:
            view.disconnect(_SIGNAL, self._selected)
        self._views.clear()

    def _selected(self, identifiers: vtk.vtkStringArray, selections: vtk.vtkCollection) -> None:
        if self._clearing or identifiers.GetNumberOfValues() == 0:
            return
        series = slicer.mrmlScene.GetNodeByID(identifiers.GetValue(0))
        points: Any = selections.GetItemAsObject(0)
        frame = frame_of_point(series, points.GetValue(0))
        self._clearing = True
        for view in self._views:
            view.RemovePlotSelections()
        self._clearing = False
        if frame is not None:
            self._go_to(frame)
