"""The form below the table of X-rays: what can be entered about the selected one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from slicer.i18n import tr as _

from PolyPoseLib.geometry.carm import PATIENT_POSITIONS

from ..study.camera_source import CameraSource
from ..study.xray_reading import XrayReport
from ..study.xray_source import XraySource
from .node_choice import NodeChoice, identifiers

_NUMBERS = {
    "xrayDistance": "source_to_detector_mm",
    "xrayIsocenterDistance": "source_to_isocenter_mm",
    "xrayPrimary": "primary_angle_deg",
    "xraySecondary": "secondary_angle_deg",
}
_PAIRS = {
    ("xraySpacingRows", "xraySpacingColumns"): "pixel_spacing_mm",
    ("xrayPointColumn", "xrayPointRow"): "principal_point_px",
}
_DIRECTION = ("primary_angle_deg", "secondary_angle_deg", "source_to_isocenter_mm", "patient_position")
_CAMERAS = ("initial", "known", "absent")
_YES_OR_NO = {"xrayMirrored": "mirrored", "xrayDistortion": "distortion_corrected"}
_ANSWERS = (None, True, False)
"""Values of these in the order of their lists; None leaves it to the file."""


class XrayDetails:
    """Shows one X-ray's fields and hands a changed X-ray to `changed`.

    An empty line leaves the number to the file; what the file says is shown in grey.
    """

    def __init__(self, ui: Any, choice: NodeChoice, changed: Callable[[XraySource], None]) -> None:
        """Connect the widgets of the loaded form."""
        self._ui, self._choice = ui, choice
        self._listed = identifiers()
        self._changed = changed
        self._source: XraySource | None = None
        self._report: XrayReport | None = None
        self._showing = False
        ui.xrayPosition.addItem(_("as in the file"))
        for position in PATIENT_POSITIONS:
            ui.xrayPosition.addItem(position)
        for name in (*_NUMBERS, *(each for pair in _PAIRS for each in pair), "xrayName"):
            getattr(ui, name).connect("editingFinished()", self._edited)
        for name in ("xrayCamera", "xrayPosition", *_YES_OR_NO):
            getattr(ui, name).connect("currentIndexChanged(int)", self._edited)
        ui.xrayFrame.connect("valueChanged(int)", self._edited)
        ui.xrayTransform.connect("nodeActivated(vtkMRMLNode*)", self._transform_chosen)

    def show(self, source: XraySource | None, report: XrayReport | None) -> None:
        """Show an X-ray, or nothing."""
        self._source, self._report = source, report
        self._showing = True
        fields = dict(source.fields) if source is not None else {}
        ui, xray = self._ui, report.xray if report is not None else None
        ui.xrayName.text = str(fields.get("name") or "")
        ui.xrayName.placeholderText = source.name if source is not None else ""
        ui.xrayFrame.enabled = source is not None and (source.frame is not None or _may_have_frames(source))
        ui.xrayFrame.value = 1 + ((source.frame or 0) if source is not None else 0)
        camera = fields.get("camera")
        ui.xrayCamera.currentIndex = _CAMERAS.index(camera) if camera in _CAMERAS else 0
        for name, field in _NUMBERS.items():
            getattr(ui, name).text = _text(fields.get(field))
        for pair, field in _PAIRS.items():
            values = fields.get(field) or (None, None)
            for name, value in zip(pair, values, strict=True):
                getattr(ui, name).text = _text(value)
        position = fields.get("patient_position")
        ui.xrayPosition.currentIndex = max(0, ui.xrayPosition.findText(position)) if position else 0
        for name, field in _YES_OR_NO.items():
            getattr(ui, name).currentIndex = _ANSWERS.index(fields.get(field))
        transform = source.camera_transform if source is not None else None
        ui.xrayTransform.setCurrentNode(transform)
        self._listed = identifiers(transform)
        self._show_found(xray)
        self._showing = False

    def _show_found(self, xray: Any) -> None:
        """In grey: the numbers in use where nothing was entered."""
        ui = self._ui
        found = dict.fromkeys((*_NUMBERS, *(each for pair in _PAIRS for each in pair)), "")
        if xray is not None:
            found["xrayDistance"] = _text(xray.source_to_detector_mm)
            found["xraySpacingRows"], found["xraySpacingColumns"] = map(_text, xray.pixel_spacing_mm)
            column = xray.intrinsics[0, 2]
            column = xray.image.shape[1] - 1 - column if xray.mirrored else column
            found["xrayPointColumn"], found["xrayPointRow"] = _text(column), _text(xray.intrinsics[1, 2])
            if xray.extrinsic is not None:
                from PolyPoseLib.geometry.carm import carm_angles

                angles = carm_angles(xray.extrinsic)
                found["xrayPrimary"], found["xraySecondary"] = (
                    f"{angles.primary_deg:.1f}",
                    f"{angles.secondary_deg:.1f}",
                )
                if xray.isocenter is not None:
                    depth = xray.extrinsic[2, :3] @ xray.isocenter + xray.extrinsic[2, 3]
                    found["xrayIsocenterDistance"] = _text(depth)
        for name, text in found.items():
            getattr(ui, name).placeholderText = text

    def _transform_chosen(self, *_ignored: Any) -> None:
        if self._source is not None and self._choice.by_person(self._listed):
            self._edited()

    def _edited(self, *_ignored: Any) -> None:
        """Read the whole form; a text that is not a number is reported and not stored."""
        if self._showing or self._source is None:
            return
        ui = self._ui
        fields = dict(self._source.fields)
        try:
            for name, field in _NUMBERS.items():
                fields[field] = _number(getattr(ui, name), fields.get(field))
            for pair, field in _PAIRS.items():
                fields[field] = self._pair(pair, field, fields.get(field))
        except ValueError as error:
            ui.xrayState.text = str(error)
            return
        fields["name"] = ui.xrayName.text.strip() or None
        camera = _CAMERAS[ui.xrayCamera.currentIndex]
        fields["camera"] = None if camera == "initial" and "camera" not in self._source.fields else camera
        position = ui.xrayPosition.currentIndex
        fields["patient_position"] = PATIENT_POSITIONS[position - 1] if position > 0 else None
        for name, field in _YES_OR_NO.items():
            fields[field] = _ANSWERS[getattr(ui, name).currentIndex]
        camera_transform = ui.xrayTransform.currentNode()
        if any(fields.get(key) != self._source.fields.get(key) for key in _DIRECTION):
            # A direction that was entered takes the place of a camera that was given.
            fields["extrinsic"], camera_transform = None, None
        fields = {key: value for key, value in fields.items() if value is not None}
        frame = ui.xrayFrame.value - 1 if ui.xrayFrame.enabled else self._source.frame
        frame = None if frame == 0 and self._source.frame is None else frame
        changed = replace(self._source, fields=fields, frame=frame, camera_transform=camera_transform)
        if camera_transform is not self._source.camera_transform:
            changed = replace(changed, camera_source=CameraSource.AUTO, found=None)
        self._changed(changed)

    def _pair(self, names: tuple[str, str], field: str, shown: Sequence[float] | None) -> list[float] | None:
        """Two numbers; where only one was entered, the other is the same (spacing) or as found (point)."""
        edits = [getattr(self._ui, name) for name in names]
        values = [_number(edit, was) for edit, was in zip(edits, shown or (None, None), strict=True)]
        given = next((value for value in values if value is not None), None)
        if given is None:
            return None
        others = [
            given if field == "pixel_spacing_mm" or not edit.placeholderText else float(edit.placeholderText)
            for edit in edits
        ]
        return [other if value is None else value for value, other in zip(values, others, strict=True)]


def _may_have_frames(source: XraySource) -> bool:
    """Whether an X-ray can hold several images."""
    if source.image is None:
        return True
    if source.image.IsA("vtkMRMLSequenceNode"):
        return True
    data = source.image.GetImageData()
    return data is not None and data.GetDimensions()[2] > 1


def _text(value: float | None) -> str:
    return "" if value is None else f"{float(value):.6g}"


def _number(edit: Any, shown: float | None) -> float | None:
    """The number in a line, None when it is empty; raises ValueError with a sentence.

    shown: the number that the line was filled with, which has more digits than the line; an untouched line means it.
    """
    text = edit.text.strip().replace(",", ".")
    if not text:
        return None
    if shown is not None and text == _text(shown):
        return shown
    try:
        return float(text)
    except ValueError:
        raise ValueError(
            _("'{text}' is not a number: use digits and a decimal point, or leave the field empty.").format(
                text=text
            )
        ) from None
