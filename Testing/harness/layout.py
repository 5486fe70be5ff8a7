"""A layout manager: Slicer's real layout logic, and an off-screen view for every slice, 3D and plot view."""

from __future__ import annotations

import types
from typing import Any

import slicer

from .plot_views import PlotWidget
from .views import SliceView, ThreeDView


class LayoutManager:
    """Stands for `slicer.app.layoutManager()`; the views are made when a layout asks for them."""

    def __init__(self, size: tuple[int, int] = (300, 260)) -> None:
        self._size = size
        self._logic = slicer.vtkMRMLLayoutLogic()
        self._logic.SetMRMLScene(slicer.mrmlScene)
        self.slices: dict[str, SliceView] = {}
        self.three_d: dict[str, ThreeDView] = {}
        self.plots: dict[str, PlotWidget] = {}
        self.width = 1500

    def layoutLogic(self) -> Any:
        """The real logic; it makes the view nodes."""
        return self._logic

    def viewport(self) -> Any:
        """What holds the views; only its width is known."""
        return types.SimpleNamespace(width=self.width)

    def setLayout(self, layout: int) -> None:
        """Switch to a layout and make the views that it needs.

        Like the application's, it does nothing when the number is the current one already, and shows another layout
        where the number is not known.
        """
        node = self._logic.GetLayoutNode()
        if node.GetViewArrangement() != layout:
            known = node.IsLayoutDescription(layout)
            node.SetViewArrangement(layout if known else node.SlicerLayoutConventionalView)
        nodes = self._logic.GetViewNodes()
        for view in [nodes.GetItemAsObject(index) for index in range(nodes.GetNumberOfItems())]:
            name = view.GetLayoutName()
            if view.IsA("vtkMRMLSliceNode") and name not in self.slices:
                self.slices[name] = SliceView(name, view.GetDefaultOrientation() or "Axial", self._size)
            elif view.IsA("vtkMRMLViewNode") and name not in self.three_d:
                self.three_d[name] = ThreeDView(name, self._size)
            elif view.IsA("vtkMRMLPlotViewNode") and name not in self.plots:
                self.plots[name] = PlotWidget(view, self._size)

    @property
    def plotViewCount(self) -> int:
        """How many plot views were made."""
        return len(self.plots)

    def plotWidget(self, number: int) -> PlotWidget:
        """One of the plot views."""
        return list(self.plots.values())[number]

    def names(self) -> list[str]:
        """Layout names of the views in the present layout."""
        nodes = self._logic.GetViewNodes()
        return [nodes.GetItemAsObject(index).GetLayoutName() for index in range(nodes.GetNumberOfItems())]

    def close(self) -> None:
        """Take the views out of the application."""
        for view in self.slices.values():
            view.close()
        self.slices.clear()
        self.three_d.clear()
        self.plots.clear()


def install(size: tuple[int, int] = (300, 260)) -> LayoutManager:
    """Give the application views, as its main window does."""
    manager = LayoutManager(size)
    slicer.app.setLayoutManager(manager)
    return manager
