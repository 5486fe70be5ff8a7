"""Brings up the track's layout: the X-rays whole, the bones in 3D, the plots."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import slicer

from . import layouts, track_layout
from .track_layout import MOST_VIEWS as MOST_VIEWS
from .xray_views import aim


def show(views: int) -> bool:
    """Switch to the layout for so many X-rays; False when there is no main window."""
    manager = slicer.app.layoutManager()
    if manager is None:
        return False
    layouts.register()
    manager.setLayout(track_layout.TrackArrangement(min(max(views, 1), MOST_VIEWS)).number)
    return True


def aim_at(
    number: int, image: slicer.vtkMRMLVolumeNode | None, plane: np.ndarray, shape: tuple[int, int]
) -> None:
    """Let the view of X-ray `number` show it whole, as seen from the source; nothing while there is no such view.

    plane: (4, 4) from (column, row, slice, 1) to RAS mm. shape: (H, W) of the X-ray.
    """
    logic = track_layout.slice_logic(number)
    if logic is not None:
        logic.GetSliceNode().SetViewGroup(track_layout.view_group(number))
        aim(logic, image, plane, shape, from_detector=False)


def show_charts(charts: Sequence[slicer.vtkMRMLPlotChartNode], joint: int = 0) -> None:
    """Put a joint's charts into the layout's plot views."""
    for place, name in enumerate(track_layout.PLOT_VIEWS):
        number = len(track_layout.PLOT_VIEWS) * joint + place
        layouts.show_plot(charts[number] if number < len(charts) else None, name)


def show_player(browser: slicer.vtkMRMLSequenceBrowserNode) -> None:
    """Let Slicer's toolbar of sequences play a browser."""
    slicer.modules.sequences.setToolBarActiveBrowserNode(browser)
    slicer.modules.sequences.showSequenceBrowser(browser)
