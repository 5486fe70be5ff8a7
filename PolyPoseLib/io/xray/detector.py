"""The detector of one X-ray: distance, pixel pitch and principal point, each with its origin.

What K needs is the pitch at the detector's plane. DICOM says it in Imager Pixel Spacing (0018,1164); Pixel
Spacing (0028,0030) may have been calibrated to the patient (PS3.3 10.7.1) and is never taken for it in
silence.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from PolyPoseLib.data.notes import Notes, shown
from PolyPoseLib.data.xray import DISTANCE_RANGE_MM
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import intrinsics_matrix
from PolyPoseLib.io.dicom import XrayTags
from PolyPoseLib.io.xray.fields import SPACING_RANGE_MM, XrayFields

Point = tuple[float, float]


_DISTANCE_TAGS = (("RTImageSID", "(3002,0026)"), ("DistanceSourceToDetector", "(0018,1110)"))

_PITCH_TAGS = (
    ("ImagePlanePixelSpacing", "(3002,0011)"),
    ("ImagerPixelSpacing", "(0018,1164)"),
    ("NominalScannedPixelSpacing", "(0018,2010)"),
)

_RANGES = {"source_to_detector_mm": DISTANCE_RANGE_MM, "pixel_spacing_mm": SPACING_RANGE_MM}

_NOMINAL_DISTANCE_MM = 1000.0


@dataclass(frozen=True)
class Detector:
    """A flat detector and its source.

    Attributes:
        source_to_detector_mm: distance along the perpendicular.
        pixel_spacing_mm: (between rows, between columns) at the detector.
        principal_point_px: (column, row) in the file's own pixels.
        intrinsics: K (3, 3) in the file's own pixels.

    """

    source_to_detector_mm: float
    pixel_spacing_mm: tuple[float, float]
    principal_point_px: tuple[float, float]
    intrinsics: np.ndarray


def detector_of(tags: XrayTags | None, fields: XrayFields, shape: tuple[int, int], notes: Notes) -> Detector:
    """Find the detector's geometry; what the study file gives wins over DICOM.

    Args:
        tags: the frame's attributes, None for files that are not DICOM.
        fields: the study file's entry.
        shape: (H, W) of the image.
        notes: receives every number's origin.

    Raises:
        InputError: distance or pixel spacing unknown, or such as no detector has: names the fields to add.

    """
    if fields.intrinsics is not None:
        return _of_intrinsics(fields, notes)
    distance, spacing = _distance(tags, fields, notes), _spacing(tags, fields, notes)
    if distance is None or spacing is None:
        raise InputError(_missing(distance, spacing, tags, notes))
    principal = _principal_point(tags, fields, shape, spacing, notes)
    return Detector(distance, spacing, principal, intrinsics_matrix(distance, spacing, *shape, principal))


def _missing(
    distance: float | None, spacing: tuple[float, float] | None, tags: XrayTags | None, notes: Notes
) -> str:
    """Sentence that names the two fields to add, and which of them is known already."""
    said = "DICOM does not say" if tags else "the file cannot say"
    where, entry = notes.where, notes.entry
    if distance is None and spacing is None:
        return (
            f"{where}: {said} how far the source is from the detector and how large a pixel is there; add "
            f'"source_to_detector_mm" and "pixel_spacing_mm" to its entry in {entry}.'
        )
    if distance is None:
        return (
            f'{where}: {said} how far the source is from the detector; add "source_to_detector_mm" to its entry in '
            f'{entry} ("pixel_spacing_mm" is known: {shown(spacing)}).'
        )
    return (
        f'{where}: {_why_no_spacing(tags, said)}; add "pixel_spacing_mm", measured at the detector, to its entry in '
        f'{entry} ("source_to_detector_mm" is known: {shown(distance)}).'
    )


def _why_no_spacing(tags: XrayTags | None, said: str) -> str:
    """Why there is no pitch: none at all, or one that may be the patient's."""
    at_patient = _positive_pair(tags, "PixelSpacing")
    if at_patient is None:
        return f"{said} how large a pixel is at the detector"
    kind = tags.text("PixelSpacingCalibrationType")
    if kind:
        return (
            f"Pixel Spacing (0028,0030) {shown(at_patient)} is calibrated at the patient ({kind}) and no magnification "
            "leads back to the detector"
        )
    return f"Pixel Spacing (0028,0030) {shown(at_patient)} may hold at the detector or in the patient"


def _of_intrinsics(fields: XrayFields, notes: Notes) -> Detector:
    """Detector of a K that the user gives; distance and pitch are known only up to one common factor."""
    fx, fy = float(fields.intrinsics[0, 0]), float(fields.intrinsics[1, 1])
    notes.say(f"intrinsics from {notes.entry}: focal lengths {fx:.6g}, {fy:.6g} px")
    if fields.source_to_detector_mm is None and fields.pixel_spacing_mm is not None:
        distance = fx * fields.pixel_spacing_mm[1]
        _require_usual("source_to_detector_mm", distance, "by its focal length and pixel spacing", notes)
    else:
        distance = fields.source_to_detector_mm or _NOMINAL_DISTANCE_MM
    principal = (float(fields.intrinsics[0, 2]), float(fields.intrinsics[1, 2]))
    return Detector(distance, (distance / fy, distance / fx), principal, fields.intrinsics)


def _positive(tags: XrayTags | None, keyword: str) -> float | None:
    """A number above 0, None when absent, zero or less."""
    value = tags.number(keyword) if tags else None
    return value if value is not None and value > 0 else None


def _positive_pair(tags: XrayTags | None, keyword: str) -> tuple[float, float] | None:
    """Two numbers above 0, or None."""
    pair = tags.numbers(keyword, 2) if tags else None
    return pair if pair is not None and min(pair) > 0 else None


def _choose(name: str, given, found, origin: str, notes: Notes):
    """The user's value or else DICOM's, with a line that says which; None when neither."""
    if given is not None:
        also = f" (DICOM {origin} says {shown(found)})" if found is not None else ""
        notes.say(f"{name} {shown(given)} from {notes.entry}{also}")
        return given
    if found is not None:
        _require_usual(name, found, f"by DICOM {origin}", notes)
        notes.say(f"{name} {shown(found)} from DICOM {origin}")
    return found


def _require_usual(name: str, value: float | tuple[float, float], origin: str, notes: Notes) -> None:
    """Refuse a distance or a pitch in mm that no detector has; raises InputError that names the field to add."""
    least, largest = _RANGES[name]
    if not least <= np.min(value) <= np.max(value) <= largest:
        raise InputError(
            f"{notes.where}: its {name} is {shown(value)} {origin}, not from {least:g} to {largest:g} mm; add the "
            f'right "{name}" to its entry in {notes.entry}.'
        )


def _distance(tags: XrayTags | None, fields: XrayFields, notes: Notes) -> float | None:
    """Distance from the source to the detector in mm."""
    found, origin = next(
        ((value, tag) for key, tag in _DISTANCE_TAGS if (value := _positive(tags, key))), (None, "")
    )
    return _choose("source_to_detector_mm", fields.source_to_detector_mm, found, origin, notes)


def _spacing(tags: XrayTags | None, fields: XrayFields, notes: Notes) -> tuple[float, float] | None:
    """Pitch at the detector in mm, (between rows, between columns)."""
    found, origin = next(
        ((pair, tag) for key, tag in _PITCH_TAGS if (pair := _positive_pair(tags, key))), (None, "")
    )
    if found is None and tags is not None and fields.pixel_spacing_mm is None:
        found, origin = _demagnified(tags, notes)
    if found is None and tags is not None and fields.pixel_spacing_mm is None:
        found, origin = _of_field_of_view(tags, notes)
    spacing = _choose("pixel_spacing_mm", fields.pixel_spacing_mm, found, origin, notes)
    if spacing is not None and tags is not None:
        _doubt_spacing(tags, spacing, fields.pixel_spacing_mm is None, notes)
    return spacing


def _demagnified(tags: XrayTags, notes: Notes) -> tuple[tuple[float, float] | None, str]:
    """Pitch at the detector from Pixel Spacing that was calibrated at the patient, where its magnification
    is known.

    The magnification is the Estimated Radiographic Magnification Factor (0018,1114), or, for the
    calibration type GEOMETRY, distance to the detector over distance to the patient. The depth of a
    FIDUCIAL is unknown, so only the factor will do for it.
    """
    pair = _positive_pair(tags, "PixelSpacing")
    kind = tags.text("PixelSpacingCalibrationType")
    if pair is None or kind not in ("GEOMETRY", "FIDUCIAL"):
        return None, ""
    factor, source = _positive(tags, "EstimatedRadiographicMagnificationFactor"), "(0018,1114)"
    far, near = _positive(tags, "DistanceSourceToDetector"), _positive(tags, "DistanceSourceToPatient")
    if factor is None and kind == "GEOMETRY" and far and near:
        factor, source = far / near, "(0018,1110) over (0018,1111)"
    if factor is None or factor < 1:
        return None, ""
    notes.warn(
        f"the detector's pixel spacing was computed from Pixel Spacing {shown(pair)}, calibrated at the patient "
        f'({kind}), and the magnification {factor:.4g} of {source}; add "pixel_spacing_mm" if you know it.'
    )
    return (pair[0] * factor, pair[1] * factor), f"(0028,0030) times the magnification of {source}"


def _of_field_of_view(tags: XrayTags, notes: Notes) -> tuple[tuple[float, float] | None, str]:
    """Pitch from the Field of View's dimensions in mm over the rows and columns (PS3.3 C.8.11.4.1.1)."""
    sizes = tags.numbers("FieldOfViewDimensions")
    if not sizes or min(sizes) <= 0 or _positive_pair(tags, "PixelSpacing"):
        return None, ""
    rows, columns = tags.dataset.Rows, tags.dataset.Columns
    high, wide = (sizes[0], sizes[1]) if len(sizes) > 1 else (sizes[0], sizes[0])
    pair = (high / rows, wide / columns)
    if not 0.98 < pair[0] / pair[1] < 1.02:
        return None, ""
    notes.warn(
        f"the pixel spacing {shown(pair)} is the field of view {shown(sizes)} mm over the pixels; add "
        '"pixel_spacing_mm" if you know it.'
    )
    return pair, "(0018,1149) over rows and columns"


def _doubt_spacing(tags: XrayTags, spacing: tuple[float, float], from_dicom: bool, notes: Notes) -> None:
    """Say what other attributes think of the pitch."""
    at_patient = _positive_pair(tags, "PixelSpacing")
    if from_dicom and at_patient and not np.allclose(at_patient, spacing, rtol=1e-3):
        kind = tags.text("PixelSpacingCalibrationType") or "uncalibrated, says the file"
        notes.say(f"Pixel Spacing (0028,0030) {shown(at_patient)} ({kind}) is the patient's and was not used")
    sizes = tags.numbers("FieldOfViewDimensions", 2)
    if sizes is None or min(sizes) <= 0 or tags.text("FieldOfViewShape") not in ("", "RECTANGLE"):
        return
    extent = (spacing[0] * tags.dataset.Rows, spacing[1] * tags.dataset.Columns)
    if not any(np.allclose(extent, order, rtol=0.03, atol=1.5) for order in (sizes, sizes[::-1])):
        notes.warn(
            f"the image spans {shown(extent)} mm by its pixel spacing but {shown(sizes)} mm by its field of view "
            '(0018,1149): it may have been cropped or resampled; check "pixel_spacing_mm".'
        )


def _principal_point(
    tags: XrayTags | None,
    fields: XrayFields,
    shape: tuple[int, int],
    spacing: tuple[float, float],
    notes: Notes,
) -> tuple[float, float]:
    """Where the perpendicular from the source meets the detector, (column, row) px."""
    centre = ((shape[1] - 1) / 2, (shape[0] - 1) / 2)
    found, origin = principal_point_of_tags(tags, shape, spacing, notes) if tags else (None, "")
    given = fields.principal_point_px
    if given is not None:
        also = f" (DICOM {origin} says {found[0]:.2f}, {found[1]:.2f})" if found else ""
        notes.say(f"principal_point_px {given[0]:.2f}, {given[1]:.2f} from {notes.entry}{also}")
        reach = max(shape) * 5
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
