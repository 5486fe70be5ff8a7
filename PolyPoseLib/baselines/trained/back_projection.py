"""Back-projection: every node of a grid takes the value of the pixel that its ray from the source meets."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import map_coordinates

from PolyPoseLib.geometry.camera import Camera


def back_projected(image: np.ndarray, camera: Camera, points: np.ndarray) -> np.ndarray:
    """The image's value at the projection of every point, bilinear between pixels.

    Parameters
    ----------
    image : (H, W) array
        As the camera took it.
    camera : Camera
        Of H rows and W columns.
    points : (..., 3) array
        LPS mm.

    Returns
    -------
    (...) array of float32
        0 where a point projects beyond the outermost pixels' centres, or lies at or behind the source.

    References
    ----------
    L. Tian et al., "LiftReg: Limited Angle 2D/3D Deformable Registration", MICCAI 2022, which lifts X-rays into the
    CT's volume this way (for cameras whose detector is parallel to the CT; here they stand anywhere).

    """
    pixels = camera.project(points)
    column, row = pixels[..., 0], pixels[..., 1]
    height, width = image.shape
    with np.errstate(invalid="ignore"):
        seen = (column >= 0) & (column <= width - 1) & (row >= 0) & (row <= height - 1)
    values = np.zeros(seen.shape, np.float32)
    values[seen] = map_coordinates(
        np.asarray(image, np.float32), [row[seen], column[seen]], order=1, mode="nearest"
    )
    return values
