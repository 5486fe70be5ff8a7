"""Where the perpendicular from the source meets the image: as given, from DICOM, or the image's centre."""

from __future__ import annotations

from PolyPoseLib.data.notes import Notes
from PolyPoseLib.io.xray.fields import XrayFields
from PolyPoseLib.io.xray.rt_image import rt_principal_point
from PolyPoseLib.io.xray.tags import XrayTags

Point = tuple[float, float]

_LARGEST_OFFSET = 5
"""Image sizes from the centre beyond which a given principal point gets a warning."""


def principal_point(
    tags: XrayTags | None, fields: XrayFields, shape: tuple[int, int], spacing: Point, notes: Notes
) -> Point:
    """Principal point (column, row) px of the stored image, centres at whole numbers.

    Parameters
    ----------
    tags
        The frame's attributes, None for files that are not DICOM.
    fields
        The study file's entry, which wins over DICOM.
    shape
        (H, W) of the image.
    spacing
        Pitch at the detector in mm, (between rows, between columns).
    notes
        Receives the origin.

    """
    centre = ((shape[1] - 1) / 2, (shape[0] - 1) / 2)
    found, origin = _of_tags(tags, shape, spacing, notes) if tags else (None, "")
    given = fields.principal_point_px
    if given is not None:
        also = f" (DICOM {origin} says {found[0]:.2f}, {found[1]:.2f})" if found else ""
        notes.say(f"principal_point_px {given[0]:.2f}, {given[1]:.2f} from {notes.entry}{also}")
        reach = max(shape) * _LARGEST_OFFSET
        if max(abs(given[0] - centre[0]), abs(given[1] - centre[1])) > reach:
            notes.warn("the principal point lies far outside the image; it is [column, row] in pixels.")
        return given
    if found is not None:
        notes.say(f"principal_point_px {found[0]:.2f}, {found[1]:.2f} from DICOM {origin}")
        return found
    notes.say(
        f"principal_point_px {centre[0]:.2f}, {centre[1]:.2f}: the image's centre, nothing says otherwise"
    )
    return centre


def _of_tags(
    tags: XrayTags, shape: tuple[int, int], spacing: Point, notes: Notes
) -> tuple[Point | None, str]:
    """Principal point of the stored image, with the tags that say so; (None, "") when none do."""
    if tags.text("Modality") == "RTIMAGE":
        return (
            rt_principal_point(tags, shape, spacing),
            "RT Image Position (3002,0012) and receptor tags",
        )
    if tags.text("Modality") == "MG":
        notes.warn(
            "in mammography the source stands above the chest wall, not above the detector's centre; add "
            '"principal_point_px".'
        )
        return None, ""
    for name, center in (
        ("Position of Isocenter Projection (0018,9430)", tags.pair("PositionOfIsocenterProjection")),
        ("the active detector's centre (0018,7026), (0018,7028)", _active_centre(tags)),
    ):
        found = None if center is None else _on_stored_image(center, tags, shape, spacing)
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
    element = tags.positive_pair("DetectorElementSpacing")
    size = tags.positive_pair("DetectorActiveDimensions")
    if element is None or size is None:
        return None
    origin = tags.pair("DetectorActiveOrigin") or (0.0, 0.0)
    return origin[0] + size[0] / element[0] / 2 - 0.5, origin[1] + size[1] / element[1] / 2 - 0.5


def _on_stored_image(point: Point, tags: XrayTags, shape: tuple[int, int], spacing: Point) -> Point | None:
    """Take a point of the physical detector to the stored image (PS3.3 C.8.11.4.1.1).

    The field of view is a rectangle of the detector, binned to pixels, turned clockwise and then flipped.

    Parameters
    ----------
    point
        (row, column) in detector elements, from the centre of the first one.
    tags
        The frame's attributes.
    shape
        (H, W) of the stored image.
    spacing
        Its pitch in mm.

    Returns
    -------
    tuple or None
        (column, row) px, None when the tags do not say how the image lies on the detector.

    """
    origin = tags.pair("FieldOfViewOrigin")
    element = tags.positive_pair("DetectorElementSpacing")
    rotation = tags.number("FieldOfViewRotation") or 0.0
    turns = round(rotation / 90)
    if origin is None or element is None or rotation != 90 * turns:
        return None
    upright_spacing = spacing if turns % 2 == 0 else spacing[::-1]
    height, width = shape if turns % 2 == 0 else shape[::-1]
    row, column = (
        (point[axis] + 0.5 - origin[axis]) * element[axis] / upright_spacing[axis] - 0.5 for axis in (0, 1)
    )
    for _ in range(turns % 4):
        row, column = column, height - 1 - row
        height, width = width, height
    if tags.text("FieldOfViewHorizontalFlip") == "YES":
        column = width - 1 - column
    return column, row
