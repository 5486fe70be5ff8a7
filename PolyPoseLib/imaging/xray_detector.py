"""Where the central ray meets the stored image, from detector, field of view and RT image tags."""

from __future__ import annotations

import numpy as np

from PolyPoseLib.imaging.xray_dicom import XrayTags
from PolyPoseLib.imaging.xray_notes import Notes

Point = tuple[float, float]


def principal_point_of_tags(
    tags: XrayTags, shape: tuple[int, int], spacing: Point, notes: Notes
) -> tuple[Point | None, str]:
    """Principal point (column, row) px of the stored image, with the tags that say so; None when none do.

    Args:
        tags: the frame's attributes.
        shape: (H, W).
        spacing: pitch at the detector in mm, (between rows, between columns).
        notes: receives doubts.

    """
    if tags.text("Modality") == "RTIMAGE":
        return _of_rt_image(tags, shape, spacing), "RT Image Position (3002,0012) and receptor tags"
    if tags.text("Modality") == "MG":
        notes.warn(
            "in mammography the source stands above the chest wall, not above the detector's centre; add "
            '"principal_point_px".'
        )
        return None, ""
    for name, center in (
        ("Position of Isocenter Projection (0018,9430)", tags.numbers("PositionOfIsocenterProjection", 2)),
        ("the active detector's centre (0018,7026), (0018,7028)", _active_centre(tags)),
    ):
        found = _on_stored_image(center, tags, shape, spacing)
        if found is None:
            continue
        offset = max(abs(found[0] / (shape[1] - 1) - 0.5), abs(found[1] / (shape[0] - 1) - 0.5))
        if offset <= 1:
            return found, f"{name} and the field of view's origin, rotation and flip"
        notes.warn(f"{name} lies {offset:.1f} image sizes off the image's centre and was ignored.")
    return None, ""


def _active_centre(tags: XrayTags) -> Point | None:
    """Centre of the active area in detector elements, (row, column) from the first element's centre.

    For a tube that is centred on its detector, the usual stand, the central ray hits there.
    """
    element = tags.numbers("DetectorElementSpacing", 2)
    size = tags.numbers("DetectorActiveDimensions", 2)
    if element is None or size is None or min(element) <= 0 or min(size) <= 0:
        return None
    origin = tags.numbers("DetectorActiveOrigin", 2) or (0.0, 0.0)
    return tuple(origin[axis] + size[axis] / element[axis] / 2 - 0.5 for axis in (0, 1))


def _on_stored_image(
    point: Point | None, tags: XrayTags, shape: tuple[int, int], spacing: Point
) -> Point | None:
    """Take a point of the physical detector to the stored image (PS3.3 C.8.11.4.1.1).

    The field of view is a rectangle of the detector, binned to pixels, turned clockwise and then flipped.

    Args:
        point: (row, column) in detector elements, from the centre of the first one.
        tags: the frame's attributes.
        shape: (H, W) of the stored image.
        spacing: its pitch in mm.

    Returns:
        (column, row) px, None when the tags do not say how the image lies on the detector.

    """
    origin = tags.numbers("FieldOfViewOrigin", 2)
    element = tags.numbers("DetectorElementSpacing", 2)
    rotation, flip = tags.number("FieldOfViewRotation") or 0.0, tags.text("FieldOfViewHorizontalFlip")
    turns = round(rotation / 90)
    if point is None or origin is None or element is None or min(element) <= 0 or rotation != 90 * turns:
        return None
    upright_spacing = spacing if turns % 2 == 0 else spacing[::-1]
    height, width = shape if turns % 2 == 0 else shape[::-1]
    row, column = (
        (point[axis] + 0.5 - origin[axis]) * element[axis] / upright_spacing[axis] - 0.5 for axis in (0, 1)
    )
    for _ in range(turns % 4):
        row, column = column, height - 1 - row
        height, width = width, height
    if flip == "YES":
        column = width - 1 - column
    return column, row


def rt_image_axes(tags: XrayTags) -> tuple[np.ndarray, np.ndarray]:
    """Directions (2,) of columns and rows in the IEC receptor's x and y (PS3.3 C.8.8.2.7).

    Without RT Image Orientation (3002,0010), rows run along +Xr and columns along -Yr.
    """
    cosines = tags.numbers("RTImageOrientation", 6)
    if cosines is None:
        return np.array([1.0, 0.0]), np.array([0.0, -1.0])
    return np.array(cosines[:2]), np.array(cosines[3:5])


def _of_rt_image(tags: XrayTags, shape: tuple[int, int], spacing: Point) -> Point | None:
    """Where the beam's axis meets an RT image, (column, row) px; None when neither tag says."""
    position = tags.numbers("RTImagePosition", 2)
    shift = tags.numbers("XRayImageReceptorTranslation", 3)
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
