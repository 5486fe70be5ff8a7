"""How an X-ray's first camera was found and how sure it is, in words for the panel."""

from __future__ import annotations

from html import escape

from slicer.i18n import tr as _

from PolyPoseLib.data.found_camera import FoundCamera

from ..study.camera_source import CameraSource
from ..study.xray_reading import XrayReport
from ..study.xray_source import XraySource
from .xrays import WARNING_COLOR


def finding_lines(found: FoundCamera) -> list[str]:
    """How a camera was found (with its similarity and the runner-up's), how sure it is, and what is doubtful."""
    lines = [
        _("Found: {how}.").format(how=found.how),
        _("Expected within {degrees:.0f} deg and {mm:.0f} mm.").format(
            degrees=found.within[0], mm=found.within[1]
        ),
    ]
    if found.similarity is not None and found.runner_up is None:
        lines.append(_("No other view comes near."))
    lines += list(found.warnings)
    if not found.sure:
        lines.append(
            _("It is doubtful, and was taken all the same.")
            if found.taken
            else _("It is doubtful and was not taken: look at it, then use it all the same or forget it.")
        )
    return lines


def source_lines(source: XraySource, report: XrayReport, model: str) -> list[str]:
    """What the chosen way gives before anything was searched; model: path of the camera model, or empty."""
    xray = report.xray
    if xray is None:
        return [_("The X-ray is not ready: give what it lacks above.")]
    if source.way is CameraSource.CALIBRATION:
        if not source.fields.get("calibration"):
            return [_("Choose the calibration's file.")]
        return [_("The calibration's pose is used; its world must be the CT's (LPS, mm).")]
    if source.way is CameraSource.DICOM and xray.extrinsic is None:
        return [_("Its file tells no angles: choose another way.")]
    if source.way is CameraSource.LEARNED and not model:
        return [_("Choose the model's file; python -m PolyPoseLib train writes one for this CT.")]
    if source.way in (CameraSource.SEARCH, CameraSource.LEARNED):
        return [_("Not searched yet: find it here, or the registration searches when it starts.")]
    return []


def html_of(lines: list[str], doubtful: bool) -> str:
    """Lines as rich text; what has to be minded is marked by a sign and a colour."""
    text = "<br>".join(escape(line, quote=False) for line in lines)
    return f'<span style="color:{WARNING_COLOR}">&#9888; {text}</span>' if text and doubtful else text
