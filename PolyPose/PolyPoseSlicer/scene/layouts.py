"""PolyPose's own layout: large X-rays in a row, below them the 3D view and three slices; the similarity on demand."""

from __future__ import annotations

from dataclasses import dataclass

import slicer

from . import track_layout
from .layout_items import THREE_D, item, layout, plot_item, slice_item, xray_item
from .layout_items import THREE_D_VIEW as THREE_D_VIEW
from .xray_views import view_group, view_name

LAYOUT = 6120
"""Number of the layout with one X-ray; each further X-ray adds one."""

MOST_VIEWS = 6
WITH_PLOT = 10
"""Added to the number of a layout that shows the similarity's curve as well."""

NARROW = 20
"""Added to the number of a layout for a narrow window."""

SLICE_PX, THREE_D_PX = 340, 130
"""Least widths of a slice view and of a 3D view, bars and margins included: narrower windows are widened by them."""

_NARROW_ROW = 2
"""X-rays side by side in a narrow window."""

PLOT_VIEW = "PolyPosePlot"

_SLICES = (("Red", "Axial", "#F34A33"), ("Yellow", "Sagittal", "#EDD54C"), ("Green", "Coronal", "#6EB04B"))


@dataclass(frozen=True)
class Arrangement:
    """One of the layouts: for so many X-rays, with the similarity's curve or without, for a narrow window or not."""

    views: int
    plot: bool = False
    narrow: bool = False

    @property
    def number(self) -> int:
        """The layout's number."""
        return LAYOUT + self.views - 1 + (WITH_PLOT if self.plot else 0) + (NARROW if self.narrow else 0)

    @property
    def description(self) -> str:
        """The layout's XML."""
        xrays = [xray_item(view_name(each), each + 1, view_group(each)) for each in range(self.views)]
        slices = [slice_item(*each) for each in _SLICES]
        curve = [plot_item(PLOT_VIEW, "P")] if self.plot else []
        in_row = _NARROW_ROW if self.narrow else self.views
        rows = [layout("horizontal", xrays[first : first + in_row]) for first in range(0, self.views, in_row)]
        patient = [THREE_D, *slices, *curve]
        if self.narrow:
            patient = [THREE_D, item(layout("tab", [*slices, *curve], split=False))]
        return layout(
            "vertical",
            [
                *(item(row, 600 // len(rows)) for row in rows),
                item(layout("horizontal", patient), 400),
            ],
        )


_ALL = [
    Arrangement(views, plot, narrow)
    for views in range(1, MOST_VIEWS + 1)
    for plot in (False, True)
    for narrow in (False, True)
]


def register() -> None:
    """Make the layouts known: a scene that was saved in one of them opens in it, and not in an empty window."""
    manager = slicer.app.layoutManager()
    if manager is None:
        return
    node = manager.layoutLogic().GetLayoutNode()
    for each in (*_ALL, *track_layout.ALL):
        if not node.IsLayoutDescription(each.number):
            node.AddLayoutDescription(each.number, each.description)
    if shown() or track_layout.shown():  # a scene that was loaded before the layouts were known
        node.SetViewArrangement(node.GetViewArrangement())


def show(views: int, plot: bool = False) -> bool:
    """Switch to the layout for so many X-rays, of which it shows the first ones; False when there is no main window."""
    manager = slicer.app.layoutManager()
    if manager is None:
        return False
    register()
    views = min(max(views, 1), MOST_VIEWS)
    manager.setLayout(Arrangement(views, plot, _is_narrow(views, manager.viewport().width)).number)
    return True


def _is_narrow(views: int, width: int) -> bool:
    """Whether that many X-rays in a row, or the 3D view and three slices, would widen a window of so many pixels."""
    return width < max(THREE_D_PX + len(_SLICES) * SLICE_PX, views * SLICE_PX)


def shown() -> bool:
    """Whether the layout is the current one."""
    manager = slicer.app.layoutManager()
    if manager is None:
        return False
    current = manager.layoutLogic().GetLayoutNode().GetViewArrangement()
    return current in {each.number for each in _ALL}


def show_plot(chart: slicer.vtkMRMLPlotChartNode | None, name: str = PLOT_VIEW) -> None:
    """Put a chart into a plot view, by default the layout's."""
    for view in slicer.util.getNodesByClass("vtkMRMLPlotViewNode"):
        if view.GetLayoutName() == name:
            view.SetPlotChartNodeID(chart.GetID() if chart is not None else None)


def anatomy_views() -> list[slicer.vtkMRMLSliceCompositeNode]:
    """The composite nodes of the slice views that show anatomy."""
    return _without_xrays(slicer.util.getNodesByClass("vtkMRMLSliceCompositeNode"))


def set_background(volume: slicer.vtkMRMLVolumeNode) -> None:
    """Show a volume in all slice views of the anatomy."""
    for composite in anatomy_views():
        composite.SetBackgroundVolumeID(volume.GetID())


def patient_views() -> list[str]:
    """IDs of the slice and 3D views that show the patient, and not an X-ray."""
    slices = _without_xrays(slicer.util.getNodesByClass("vtkMRMLSliceNode"))
    return [node.GetID() for node in [*slices, *slicer.util.getNodesByClass("vtkMRMLViewNode")]]


def _without_xrays(nodes: list) -> list:
    """Those nodes of slice views that do not belong to an X-ray's."""
    xrays = {name(each) for each in range(MOST_VIEWS) for name in (view_name, track_layout.view_name)}
    return [node for node in nodes if node.GetLayoutName() not in xrays]
