"""Outlines of labelled structures as a camera sees them."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import find_objects

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.grid import Grid
from PolyPoseLib.geometry.outlines import area, simplified, traced
from PolyPoseLib.rendering.backend import Backend
from PolyPoseLib.rendering.rigid import Body, project_body

FINEST_MM, FINEST_SHARE = 1.2, 1 / 80
"""Structures are averaged to voxels of about this size first, or this share of the structure, whichever is less."""

GRAZING = 0.75
"""Rays count as inside a structure from this many voxels of path on: outlines of spheres then lie a quarter to two
fifths of a voxel outside the labels, and a structure one voxel thin still has one."""

SMALLEST_PX = 4.0
"""Area in pixels of an outline below which it is left out."""

TOLERANCE_PX = 0.15
"""An outline is drawn with as few points as keep it within this."""


class Silhouettes:
    """The structures of a label map, ready to be seen through any camera.

    Parameters
    ----------
    labels : Volume
        In the CT's frame, 0 where no structure is, n for the nth.
    count : int
        How many structures there are.
    backend : Backend
        Carries out the rays.

    """

    def __init__(self, labels: Volume, count: int, backend: Backend) -> None:
        self._backend = backend
        boxes = find_objects(labels.voxels.astype(np.int32, copy=False), max_label=count)
        self._bodies = [
            None if box is None else _body(labels, n, box) for n, box in enumerate(boxes, start=1)
        ]

    def outlines(self, number: int, camera: Camera, fixed_to_moving: np.ndarray) -> list[np.ndarray]:
        """Outlines of one structure under a pose.

        Parameters
        ----------
        number : int
            Counted from 0.
        camera : Camera
            Of the image.
        fixed_to_moving : (4, 4) array
            The structure's pose, LPS mm.

        Returns
        -------
        list of (N, 2) arrays
            Closed polygons, (column, row) in pixels of the camera; none where the structure does not project into the
            image, or has no voxel.

        """
        body = self._bodies[number]
        if body is None or not _lies_before(body, camera, fixed_to_moving):
            return []
        voxel = float(np.linalg.norm(body.affine[:3, :3], axis=0).mean())
        part = project_body(body, camera, fixed_to_moving, voxel / 2, self._backend)
        if 0 in part.image.shape:
            return []
        lines = traced(part.image, GRAZING * voxel)
        corner = np.array([part.window[2], part.window[0]], float)
        return [simplified(each, TOLERANCE_PX) + corner for each in lines if abs(area(each)) >= SMALLEST_PX]


def _lies_before(body: Body, camera: Camera, fixed_to_moving: np.ndarray) -> bool:
    """Whether all of a body lies between the camera's source and infinity; it has no outline otherwise."""
    inverse = np.linalg.inv(fixed_to_moving)
    return bool((camera.depth(body.corners @ inverse[:3, :3].T + inverse[:3, 3]) > 1.0).all())


def _body(labels: Volume, number: int, box: tuple[slice, ...]) -> Body:
    affine = labels.affine.copy()
    affine[:3, 3] += affine[:3, :3] @ [part.start for part in reversed(box)]
    longest = float((labels.spacing * [part.stop - part.start for part in reversed(box)]).max())
    whole = Grid((labels.voxels[box] == number).astype(np.float32), affine)
    grid = whole.coarsened(min(FINEST_MM, FINEST_SHARE * longest)).padded()
    return Body(grid.voxels, grid.affine, grid.affine[:3, 3])
