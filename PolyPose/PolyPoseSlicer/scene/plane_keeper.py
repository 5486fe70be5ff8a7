"""Keeps the slice views of X-rays on their images: whatever moves all slices would leave them black."""

from __future__ import annotations

from typing import Any

import numpy as np
import slicer
import vtk

from .frames import from_vtk, to_vtk
from .xray_views import XrayPicture, plane_of, slice_logic

_TOLERANCE_MM = 1e-3


class PlaneKeeper:
    """Follows the slice nodes of X-ray views.

    A person scrolls such a view with its slider, or jumps to a landmark, which moves every slice: the image is one
    plane, and beside it there is nothing to see. Panning and zooming stay.
    """

    def __init__(self) -> None:
        """Follow no view yet."""
        self._kept: dict[Any, tuple[int, int, int]] = {}
        self._returning = False

    def keep(self, number: int, picture: XrayPicture) -> None:
        """Keep a view on its picture, which may be moved or drawn anew later."""
        logic = slice_logic(number)
        if logic is None:
            return
        node = logic.GetSliceNode()
        tag = (
            self._kept[node][2]
            if node in self._kept
            else node.AddObserver(vtk.vtkCommand.ModifiedEvent, self._modified)
        )
        self._kept[node] = (number, picture.xray.shape[1], tag)

    def release(self) -> None:
        """Follow no view any more."""
        for node, (_number, _width, tag) in self._kept.items():
            node.RemoveObserver(tag)
        self._kept.clear()

    def _modified(self, node: slicer.vtkMRMLSliceNode, _event: str) -> None:
        """Put a slice that has left its image back onto it."""
        if self._returning or node not in self._kept:
            return
        number, width, _tag = self._kept[node]
        plane = plane_of(number, width)
        if plane is None:
            return
        shown = from_vtk(node.GetSliceToRAS())
        normal = np.cross(plane[:3, 0], plane[:3, 1])
        normal /= np.linalg.norm(normal)
        parallel = abs(shown[:3, 2] @ normal) > 1 - 1e-6
        away = float((plane[:3, 3] - shown[:3, 3]) @ normal)
        if not parallel or abs(away) < _TOLERANCE_MM:
            return  # it is being aimed, or lies on its image
        shown[:3, 3] += away * normal
        self._returning = True
        try:
            node.GetSliceToRAS().DeepCopy(to_vtk(shown))
            node.UpdateMatrices()
        finally:
            self._returning = False
