"""One camera as ITK-RTK describes a projection: a source, the first pixel, and the directions of rows and columns."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from PolyPoseLib.geometry.camera import Camera


class RtkProjection(NamedTuple):
    """What ThreeDCircularProjectionGeometry.AddProjection takes; images are handed over with their rows reversed.

    RTK wants (along a row) x (along a column) to point toward the source, while rows of an image run downward; so the
    last row comes first, and columns run upward.

    Attributes
    ----------
    source : (3,) array
        World, mm.
    corner : (3,) array
        World, mm: the centre of the first column's pixel in the last row.
    along_row, along_column : (3,) array
        Unit vectors in the world, toward the next column and toward the row before.
    pitch : (2,) array
        mm between columns and between rows.

    """

    source: np.ndarray
    corner: np.ndarray
    along_row: np.ndarray
    along_column: np.ndarray
    pitch: np.ndarray


def rtk_projection(camera: Camera, depth_mm: float) -> RtkProjection:
    """The camera with its detector at a depth (mm) along its axis; line integrals are the same at every depth.

    The camera must have no skew.
    """
    fx, fy, cx, cy = (camera.intrinsics[index] for index in ((0, 0), (1, 1), (0, 2), (1, 2)))
    pitch = np.array([depth_mm / fx, depth_mm / fy])
    rotation = camera.extrinsic[:3, :3]
    first_row_last = camera.height - 1
    corner = camera.source + rotation.T @ [-cx * pitch[0], (first_row_last - cy) * pitch[1], depth_mm]
    return RtkProjection(camera.source, corner, rotation[0], -rotation[1], pitch)
