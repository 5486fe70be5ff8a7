"""How an RT image lies on the receptor of a treatment machine (PS3.3 C.8.8.2, IEC 61217)."""

from __future__ import annotations

import numpy as np

from PolyPoseLib.io.xray.tags import XrayTags


def rt_image_axes(tags: XrayTags) -> tuple[np.ndarray, np.ndarray]:
    """Directions (2,) of columns and rows in the IEC receptor's x and y (PS3.3 C.8.8.2.7).

    Without RT Image Orientation (3002,0010), rows run along +Xr and columns along -Yr.
    """
    cosines = tags.numbers("RTImageOrientation")
    if cosines is None or len(cosines) != 6:
        return np.array([1.0, 0.0]), np.array([0.0, -1.0])
    return np.array(cosines[:2]), np.array(cosines[3:5])


def rt_principal_point(
    tags: XrayTags, shape: tuple[int, int], spacing: tuple[float, float]
) -> tuple[float, float] | None:
    """Where the beam's axis meets the image, (column, row) px; None when neither tag says.

    Parameters
    ----------
    tags
        The frame's attributes.
    shape
        (H, W) of the image.
    spacing
        Pitch at the receptor in mm, (between rows, between columns).

    """
    position = tags.pair("RTImagePosition")
    shift = tags.triple("XRayImageReceptorTranslation")
    if position is None and shift is None:
        return None
    angle = np.deg2rad(tags.number("XRayImageReceptorAngle") or 0.0)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    axis = turn @ -np.array((shift or (0.0, 0.0, 0.0))[:2])
    columns, rows = rt_image_axes(tags)
    if position is None:
        first = np.array([(shape[1] - 1) / 2, (shape[0] - 1) / 2])
        return (float(first[0] + axis @ columns / spacing[1]), float(first[1] + axis @ rows / spacing[0]))
    from_first = axis - np.array(position)
    return float(from_first @ columns / spacing[1]), float(from_first @ rows / spacing[0])
