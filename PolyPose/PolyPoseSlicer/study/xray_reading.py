"""Reads an X-ray exactly as the registration will, and describes where its geometry comes from."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import slicer
from slicer.i18n import tr as _

from PolyPoseLib.errors import InputError, PolyPoseError

from .camera_source import CameraSource
from .field_words import in_words
from .writer import UNKNOWN_SPACING
from .xray_source import XraySource

if TYPE_CHECKING:
    from PolyPoseLib.data.xray import Xray

TYPED_FIELDS = (
    "source_to_detector_mm",
    "source_to_isocenter_mm",
    "pixel_spacing_mm",
    "principal_point_px",
    "primary_angle_deg",
    "secondary_angle_deg",
    "patient_position",
    "mirrored",
    "distortion_corrected",
)
"""What a person enters about one X-ray."""

GEOMETRY_FIELDS = (
    *TYPED_FIELDS, "intrinsics", "extrinsic", "camera", "isocenter_mm", "standard_view", "landmarks", "calibration",
    "calibration_frame", "rig",
)  # fmt: skip
"""What a geometry file may give for one X-ray."""

_KEPT = 32


@dataclass(frozen=True)
class XrayReport:
    """An X-ray as it would be registered, or the sentence that says why it cannot be.

    geometry, camera, state: texts for the table; details: everything known, one line each.
    uncertain: whether a person has to review the camera that was found.
    """

    xray: Xray | None
    geometry: str
    camera: str
    state: str
    details: tuple[str, ...] = ()
    uncertain: bool = False


class XrayReader:
    """Reads X-rays and remembers the last ones, so that asking again costs nothing."""

    def __init__(self) -> None:
        """Nothing is read yet."""
        self._kept: dict[str, XrayReport] = {}

    def report(self, source: XraySource) -> XrayReport:
        """Read one X-ray; whatever is wrong with it becomes the report's state."""
        try:
            key = _key(source)
        except (PolyPoseError, OSError) as error:
            return _failed(source, str(error))
        if key not in self._kept:
            if len(self._kept) >= _KEPT:
                self._kept.pop(next(iter(self._kept)))
            try:
                self._kept[key] = describe(source, read_source(source))
            except PolyPoseError as error:
                self._kept[key] = _failed(source, str(error))
            except (OSError, RuntimeError) as error:
                self._kept[key] = _failed(source, _("It cannot be read: {reason}.").format(reason=error))
        return self._kept[key]


def read_source(source: XraySource) -> Xray:
    """One X-ray as the registration will read it; raises PolyPoseError with one sentence."""
    from PolyPoseLib.io.xray.read import read_xray

    place = _("the table of X-rays")
    path, frame = source.file()
    if path:
        return read_xray(path, fields=source.shown_entry(path, frame), frame=frame, entry_name=place)
    pixels, spacing = source.pixels()
    with tempfile.TemporaryDirectory(prefix="PolyPose-", dir=slicer.app.temporaryPath) as folder:
        file = Path(folder) / "xray.nrrd"
        import SimpleITK as sitk

        image = sitk.GetImageFromArray(pixels, isVector=pixels.ndim == 3)
        image.SetSpacing((spacing[1], spacing[0]))
        sitk.WriteImage(image, str(file), False)
        fields = source.shown_entry(file.name, None)
        if spacing != UNKNOWN_SPACING and not {"pixel_spacing_mm", "intrinsics"} & fields.keys():
            fields["pixel_spacing_mm"] = list(spacing)
        return read_xray(file, fields=fields, entry_name=place)


def describe(source: XraySource, xray: Xray) -> XrayReport:
    """The texts about an X-ray that could be read."""
    camera = camera_text(source, xray)
    warnings = len(xray.warnings)
    state = _("ready") if not warnings else _("ready; {count} warnings").format(count=warnings)
    details = (
        *(_("Warning: {text}").format(text=in_words(each)) for each in xray.warnings),
        *map(in_words, xray.provenance),
    )
    uncertain = source.found is not None and not source.found.sure
    return XrayReport(xray, geometry_origin(source), camera, state, details, uncertain)


def camera_text(source: XraySource, xray: Xray) -> str:
    """How the registration will use an X-ray's camera, in words."""
    found = source.found
    if found is not None:
        if not found.taken:
            return _("none yet: an uncertain one was found, review it")
        if not found.sure:
            return _("uncertain, accepted by you")
        return _("found, within {degrees:.0f} deg and {mm:.0f} mm").format(
            degrees=found.within[0], mm=found.within[1]
        )
    if source.camera_source is CameraSource.LANDMARKS:
        return _("initial, from landmarks") if xray.camera != "absent" else _("none yet: pick landmarks")
    if xray.camera == "known":
        return _("known exactly")
    if xray.camera == "absent":
        return _("none yet: it will be searched for, unless you place the C-arm")
    if xray.initial_radius is not None:
        return _("initial, within {degrees:.0f} deg and {mm:.0f} mm").format(
            degrees=xray.initial_radius[0], mm=xray.initial_radius[1]
        )
    return _("initial")


def geometry_origin(source: XraySource) -> str:
    """Where the geometry comes from, in words."""
    origins = []
    if not source.camera_source.by_transform and source.camera_source is not CameraSource.DICOM:
        origins.append(source.camera_source.label())
    elif source.starts_from_transform:
        origins.append(_("transform"))
    elif source.fields.get("extrinsic") is not None:
        known = source.fields.get("camera") == "known"
        origins.append(_("known, from a file") if known else _("geometry file"))
    elif any(source.fields.get(key) is not None for key in TYPED_FIELDS):
        origins.append(_("entered"))
    path = _file_of(source)
    if path and _is_dicom(path):
        origins.append(_("DICOM"))
    elif not origins:
        origins.append(_("image only"))
    return " + ".join(origins)


def geometry_from_file(path: str | Path, source: XraySource, number: int) -> dict[str, Any]:
    """The fields that a JSON file gives for an X-ray: a study's entry of the same image or name, or number.

    A file with one entry only is taken as it is. Raises InputError when the file holds no geometry.
    """
    path = Path(path)
    try:
        stored = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(
            _("{file} cannot be read as JSON ({reason}): choose a study file.").format(
                file=path.name, reason=error
            )
        ) from error
    entry = _entry_for(stored, source, number) if isinstance(stored, dict) else None
    fields = (
        {} if entry is None else {key: entry[key] for key in GEOMETRY_FIELDS if entry.get(key) is not None}
    )
    if not fields:
        raise InputError(
            _(
                "{file} does not describe the geometry of '{xray}': choose a study file with an entry for it."
            ).format(file=path.name, xray=source.name)
        )
    if fields.get("calibration"):
        fields["calibration"] = str((path.parent / fields["calibration"]).resolve())
    return fields


def _entry_for(stored: Mapping[str, Any], source: XraySource, number: int) -> Mapping[str, Any] | None:
    entries = stored.get("xrays")
    if not isinstance(entries, list):
        return stored
    entries = [each for each in entries if isinstance(each, dict)]
    names = {source.name, Path(_file_of(source)).name, Path(_file_of(source)).name.split(".")[0]} - {""}
    for each in entries:
        image = Path(str(each.get("image", ""))).name
        if each.get("name") in names or image in names or image.split(".")[0] in names:
            return each
    return entries[number] if number < len(entries) else None


def _failed(source: XraySource, sentence: str) -> XrayReport:
    return XrayReport(None, geometry_origin(source), _("unknown"), _("not ready"), (in_words(sentence),))


def _file_of(source: XraySource) -> str:
    """The X-ray's file, empty when there is none."""
    try:
        return source.file()[0]
    except PolyPoseError:
        return ""


def _is_dicom(path: str) -> bool:
    try:
        with open(path, "rb") as file:
            return file.read(132)[128:] == b"DICM"
    except OSError:
        return False


def _key(source: XraySource) -> str:
    """Changes whenever reading the X-ray would give something else."""
    path, frame = source.file()
    entry = source.shown_entry(path, frame)
    stamp = f"{os.stat(path).st_mtime_ns}" if path else _image_stamp(source.image)
    stamp += "".join(_stamp(entry[key]) for key in ("mask", "calibration") if entry.get(key))
    found = None if source.found is None else source.found.to_dict()
    return json.dumps(
        [stamp, frame, source.frame, entry, source.camera_source.value, found], sort_keys=True, default=str
    )


def _image_stamp(image: slicer.vtkMRMLNode | None) -> str:
    """Changes with an image node's content."""
    if image is None:
        return ""
    stamp = f"{image.GetID()} {image.GetMTime()}"
    if image.IsA("vtkMRMLScalarVolumeNode") and image.GetImageData() is not None:
        stamp += f" {image.GetImageData().GetMTime()}"
    return stamp


def _stamp(path: Path) -> str:
    """Changes with a file's content; empty while there is none."""
    try:
        return f" {path.stat().st_mtime_ns}"
    except OSError:
        return ""
