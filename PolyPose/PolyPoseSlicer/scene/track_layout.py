"""The layout of a track: its X-rays in a row, below them bones in 3D and plots.

Its X-ray views are others than those of a registration, so that either layout finds its pictures as it left them.
"""

from __future__ import annotations

from dataclasses import dataclass

import slicer

from .layout_items import THREE_D, item, layout, plot_item, xray_item

LAYOUT = 6180
"""Number of the layout with one X-ray; each further X-ray adds one."""

MOST_VIEWS = 6

PLOT_VIEWS = ("PolyPoseTrackPlot1", "PolyPoseTrackPlot2")
"""Layout names of the plots of angles and of translations."""

_FIRST_GROUP = 6220


@dataclass(frozen=True)
class TrackArrangement:
    """One of the layouts: for so many X-rays."""

    views: int

    @property
    def number(self) -> int:
        """The layout's number."""
        return LAYOUT + self.views - 1

    @property
    def description(self) -> str:
        """The layout's XML."""
        xrays = [xray_item(view_name(each), each + 1, view_group(each)) for each in range(self.views)]
        plots = layout("vertical", [plot_item(name, f"P{place}") for place, name in enumerate(PLOT_VIEWS, 1)])
        below = layout("horizontal", [THREE_D, item(plots)])
        return layout("vertical", [item(layout("horizontal", xrays), 550), item(below, 450)])


ALL = tuple(TrackArrangement(views) for views in range(1, MOST_VIEWS + 1))


def view_name(number: int) -> str:
    """The layout name of the slice view of X-ray `number`, from 0."""
    return f"PolyPoseTrackXray{number + 1}"


def view_group(number: int) -> int:
    """The view group of that view: one of its own, as slice views of one group follow each other's jumps."""
    return _FIRST_GROUP + number


def slice_logic(number: int) -> slicer.vtkMRMLSliceLogic | None:
    """The logic of that view; None when the layout has no such view."""
    return slicer.app.applicationLogic().GetSliceLogicByLayoutName(view_name(number))


def shown() -> bool:
    """Whether the layout is the current one."""
    manager = slicer.app.layoutManager()
    if manager is None:
        return False
    return manager.layoutLogic().GetLayoutNode().GetViewArrangement() in {each.number for each in ALL}
