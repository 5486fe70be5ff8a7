"""PolyPose's own layout: large X-rays in a row, below them the 3D view and three slices; the similarity on demand."""

from __future__ import annotations

import slicer

from .xray_views import view_group, view_name

LAYOUT = 6120
"""Number of the layout with one X-ray; each further X-ray adds one."""

MOST_VIEWS = 6
WITH_PLOT = 10
"""Added to the number of a layout that shows the similarity's curve as well."""

_ALL = [(views, plot) for views in range(1, MOST_VIEWS + 1) for plot in (False, True)]
"""Numbers of X-rays, with the curve and without, for which there is a layout."""

PLOT_VIEW = "PolyPosePlot"
THREE_D_VIEW = "1"
"""Slicer's own first 3D view."""

_XRAY = """<item><view class="vtkMRMLSliceNode" singletontag="{name}">
<property name="orientation" action="default">Axial</property>
<property name="viewlabel" action="default">X{number}</property>
<property name="viewgroup" action="default">{group}</property>
<property name="viewcolor" action="default">#E0A030</property></view></item>"""
_SLICE = """<item><view class="vtkMRMLSliceNode" singletontag="{name}">
<property name="orientation" action="default">{orientation}</property>
<property name="viewlabel" action="default">{name[0]}</property>
<property name="viewcolor" action="default">{color}</property></view></item>"""
_SLICES = (("Red", "Axial", "#F34A33"), ("Yellow", "Sagittal", "#EDD54C"), ("Green", "Coronal", "#6EB04B"))


def description(views: int, plot: bool = False) -> str:
    """The layout's XML for a number of X-rays, with the similarity's curve or without."""
    xrays = "".join(
        _XRAY.format(name=view_name(each), number=each + 1, group=view_group(each)) for each in range(views)
    )
    curve = (
        f'<item><view class="vtkMRMLPlotViewNode" singletontag="{PLOT_VIEW}">'
        '<property name="viewlabel" action="default">P</property></view></item>'
    )
    three = (
        f'<item><view class="vtkMRMLViewNode" singletontag="{THREE_D_VIEW}">'
        '<property name="viewlabel" action="default">1</property></view></item>'
    )
    slices = "".join(
        _SLICE.format(name=name, orientation=orientation, color=color) for name, orientation, color in _SLICES
    )
    return (
        '<layout type="vertical" split="true">'
        f'<item splitSize="600"><layout type="horizontal" split="true">{xrays}</layout></item>'
        f'<item splitSize="400"><layout type="horizontal" split="true">{three}{slices}{curve if plot else ""}'
        "</layout></item></layout>"
    )


def register() -> None:
    """Make the layouts known: a scene that was saved in one of them opens in it, and not in an empty window."""
    manager = slicer.app.layoutManager()
    if manager is None:
        return
    node = manager.layoutLogic().GetLayoutNode()
    for views, plot in _ALL:
        if not node.IsLayoutDescription(number_of(views, plot)):
            node.AddLayoutDescription(number_of(views, plot), description(views, plot))
    if shown():  # a scene that was loaded before the layouts were known
        node.SetViewArrangement(node.GetViewArrangement())


def number_of(views: int, plot: bool = False) -> int:
    """The number of the layout for so many X-rays, of which it shows the first ones."""
    return LAYOUT + min(max(views, 1), MOST_VIEWS) - 1 + (WITH_PLOT if plot else 0)


def show(views: int, plot: bool = False) -> bool:
    """Switch to the layout; False when there is no main window."""
    manager = slicer.app.layoutManager()
    if manager is None:
        return False
    register()
    manager.setLayout(number_of(views, plot))
    return True


def shown() -> bool:
    """Whether the layout is the current one."""
    manager = slicer.app.layoutManager()
    if manager is None:
        return False
    current = manager.layoutLogic().GetLayoutNode().GetViewArrangement()
    return current in {number_of(*each) for each in _ALL}


def show_plot(chart: slicer.vtkMRMLPlotChartNode | None) -> None:
    """Put a chart into the layout's plot view."""
    for view in slicer.util.getNodesByClass("vtkMRMLPlotViewNode"):
        if view.GetLayoutName() == PLOT_VIEW:
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
    xrays = {view_name(each) for each in range(MOST_VIEWS)}
    return [node for node in nodes if node.GetLayoutName() not in xrays]
