"""How an X-ray's initial camera was found and how reliable it is, in words for the panel."""

from __future__ import annotations

from html import escape

from slicer.i18n import tr as _

from PolyPoseLib.data.found_camera import FoundCamera

from ..study.camera_source import CameraSource
from ..study.xray_reading import XrayReport
from ..study.xray_source import XraySource
from .xrays import WARNING_COLOR


def found_lines(found: FoundCamera) -> list[str]:
    """How a camera was found (with its similarity and the runner-up's), how accurate it is, and what is uncertain."""
    lines = [
        _("Found: {how}.").format(how=found.how),
        _("Expected accuracy: {degrees:.0f} deg and {mm:.0f} mm.").format(
            degrees=found.within[0], mm=found.within[1]
        ),
    ]
    if found.similarity is not None and found.runner_up is None:
        lines.append(_("No other view scores nearly as high."))
    lines += list(found.warnings)
    if not found.sure:
        lines.append(
            _("It is uncertain, and in use because you accepted it.")
            if found.taken
            else _("It is uncertain and not in use: show it, then accept or discard it.")
        )
    return lines


def source_lines(source: XraySource, report: XrayReport, model: str) -> list[str]:
    """What the chosen camera source gives before anything was searched; model: path of the camera model, or empty."""
    xray = report.xray
    if xray is None:
        return [_("This X-ray is not ready: complete its geometry above.")]
    if source.camera_source is CameraSource.CALIBRATION:
        if not source.fields.get("calibration"):
            return [_("Choose the calibration file.")]
        return [_("The pose in the calibration is used; it must be given in the CT's coordinates (LPS, mm).")]
    if source.camera_source is CameraSource.DICOM and xray.extrinsic is None:
        return [_("Its file gives no angles: choose another camera source.")]
    if source.camera_source is CameraSource.LEARNED and not model:
        return [_("Choose the model file; python -m PolyPoseLib train makes one for this CT.")]
    if source.camera_source in (CameraSource.SEARCH, CameraSource.LEARNED):
        return [_("Not searched for yet: press Find camera, or the registration will search when it starts.")]
    return []


def html_of(lines: list[str], uncertain: bool) -> str:
    """Lines as rich text; what needs attention is marked by a sign and a colour."""
    text = "<br>".join(escape(line, quote=False) for line in lines)
    return f'<span style="color:{WARNING_COLOR}">&#9888; {text}</span>' if text and uncertain else text
