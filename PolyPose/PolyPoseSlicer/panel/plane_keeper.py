"""Keeps the slice views of X-rays on their images: whatever moves all slices would leave them black."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import qt
import slicer
import vtk

from ..scene.frames import from_vtk, to_vtk
from ..scene.xray_views import XrayPicture, plane_of, slice_logic

_TOLERANCE_MM = 1e-3


class PlaneKeeper:
    """Follows the slice nodes of X-ray views.

    A person scrolls such a view with its slider, or jumps to a landmark, which moves every slice: the image is one
    plane, and beside it there is nothing to see. Panning and zooming stay.
    """

    def __init__(self) -> None:
        """Follow no view yet."""
        self._kept: dict[Any, tuple[Callable[[], np.ndarray | None], int]] = {}
        # Later: what draws a view ignores changes of its slice that come while it takes one in.
        self._later = qt.QTimer()
        self._later.setSingleShot(True)
        self._later.interval = 0
        self._later.connect("timeout()", self._return_all)

    def keep(self, number: int, picture: XrayPicture) -> None:
        """Keep a view on its picture, which may be moved or drawn anew later."""
        logic = slice_logic(number)
        if logic is not None:
            self.keep_on(logic.GetSliceNode(), partial(plane_of, number, picture.xray.shape[1]))

    def keep_on(self, node: slicer.vtkMRMLSliceNode, plane: Callable[[], np.ndarray | None]) -> None:
        """Keep a view on a plane: (4, 4) from (column, row, slice, 1) to RAS mm, None where there is none now."""
        tag = self._kept[node][1] if node in self._kept else None
        if tag is None:
            tag = node.AddObserver(vtk.vtkCommand.ModifiedEvent, self._modified)
        self._kept[node] = (plane, tag)

    def release(self) -> None:
        """Follow no view any more."""
        self._later.stop()
        for node, (_plane, tag) in self._kept.items():
            node.RemoveObserver(tag)
        self._kept.clear()

    def _modified(self, node: slicer.vtkMRMLSliceNode, _event: str) -> None:
        if node in self._kept and self._way_back(node) is not None:
            self._later.start()

    def _return_all(self) -> None:
        """Put slices that have left their images back onto them."""
        for node in list(self._kept):
            back = self._way_back(node)
            if back is not None:
                shown = from_vtk(node.GetSliceToRAS())
                shown[:3, 3] += back
                node.GetSliceToRAS().DeepCopy(to_vtk(shown))
                node.UpdateMatrices()

    def _way_back(self, node: slicer.vtkMRMLSliceNode) -> np.ndarray | None:
        """From a slice to its image, (3,) RAS mm; None where it lies there, or is being aimed."""
        plane = self._kept[node][0]()
        if plane is None:
            return None
        shown = from_vtk(node.GetSliceToRAS())
        normal = np.cross(plane[:3, 0], plane[:3, 1])
        normal /= np.linalg.norm(normal)
        parallel = abs(shown[:3, 2] @ normal) > 1 - 1e-6
        away = float((plane[:3, 3] - shown[:3, 3]) @ normal)
        return away * normal if parallel and abs(away) > _TOLERANCE_MM else None
