"""The Review section's files: the result as a report, and as a scene of its own."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import qt
import slicer
from slicer.i18n import tr as _

from PolyPoseLib.data.result import total_seconds
from PolyPoseLib.data.view_names import view_name
from PolyPoseLib.errors import PolyPoseError

from ..scene.cameras import similarity_of
from ..scene.compare import Mode, compared
from ..study.parameters import PolyPoseParameterNode, outputs_of, structures_of
from ..study.result_scene import save_result_scene
from .motions import motion_header
from .report_page import ReportPage
from .review import ReviewPart


class SavingPart:
    """Writes what the Review section shows."""

    def __init__(self, ui: Any, review: ReviewPart) -> None:
        """Connect the buttons of the loaded form."""
        self._ui, self._review = ui, review
        self._parameters: PolyPoseParameterNode | None = None
        ui.saveReport.connect("clicked()", self._ask_report)
        ui.sendButton.connect("clicked()", self._ask_scene)

    def show(self, parameters: PolyPoseParameterNode | None) -> None:
        """Another parameter node, or the same that changed."""
        self._parameters = parameters
        for name in ("saveReport", "sendButton"):
            getattr(self._ui, name).enabled = (
                parameters is not None and parameters.outputTransform is not None
            )

    def report_page(self, parameters: PolyPoseParameterNode) -> ReportPage:
        """The result of a parameter node as a page, without names of the scene's images: they may be the patient's."""
        outputs, review = outputs_of(parameters), self._review
        review.refresh_pictures()
        facts = [
            (_("CT"), _size_of(parameters.ct)),
            (_("Structures"), ", ".join(structures_of(parameters)) or "-"),
            (_("Anchor"), parameters.anchor or "-"),
            (_("Preset"), parameters.preset.label()),
            (_("Computed on"), outputs.device or "-"),
            (_("Computing time [s]"), f"{total_seconds(outputs.seconds):.0f}"),
        ]
        for node in outputs.cameras:
            similarity = similarity_of(node)
            facts.append(
                (node.GetName(), "-" if similarity is None else _("similarity {n:.4f}").format(n=similarity))
            )
        pictures = []
        for number, picture in enumerate(review.pictures.items):
            view = outputs.cameras[number].GetName() if number < len(outputs.cameras) else view_name(number)
            for mode, title in (
                (Mode.XRAY, _("X-ray")),
                (Mode.RENDERING, _("rendering")),
                (Mode.EDGES, _("edges")),
            ):
                rgb = compared(picture.xray, picture.rendering, mode, 0.5)
                rgb = rgb[:, ::-1] if review.pictures.from_detector else rgb
                pictures.append((f"{view}: {title}", rgb))
        return ReportPage(
            facts, motion_header(review.motions.relative_to), review.motions.lines, pictures,
            outputs.warnings, outputs.distrust, review.report_png,
        )  # fmt: skip

    def save_report(self, path: str) -> None:
        """Write the report; says so when that fails."""
        if self._parameters is None:
            return
        page = self.report_page(self._parameters).html()
        try:
            Path(path).write_text(page, encoding="utf-8")
        except OSError as error:
            self._ui.reviewState.text = _(
                "{path} cannot be written ({reason}): choose another folder."
            ).format(path=path, reason=error.strerror)

    def save_scene(self, path: str) -> None:
        """Write the result as a scene; says so when that fails."""
        if self._parameters is None:
            return
        try:
            save_result_scene(self._parameters, path)
        except PolyPoseError as error:
            self._ui.reviewState.text = str(error)

    def _ask_report(self) -> None:
        window = self._ui.reviewSection.window()
        path = qt.QFileDialog.getSaveFileName(
            window, _("Save report"), "report.html", _("HTML pages (*.html)")
        )
        if path:
            self.save_report(str(path))

    def _ask_scene(self) -> None:
        window = self._ui.reviewSection.window()
        path = qt.QFileDialog.getSaveFileName(
            window, _("Save result as a scene"), "PolyPose.mrb", _("Scenes (*.mrb)")
        )
        if path:
            self.save_scene(str(path))


def _size_of(ct: slicer.vtkMRMLScalarVolumeNode | None) -> str:
    """Voxels and spacing of a CT; "-" without one."""
    if ct is None or ct.GetImageData() is None:
        return "-"
    voxels = " x ".join(map(str, ct.GetImageData().GetDimensions()))
    spacing = " x ".join(f"{each:.4g}" for each in ct.GetSpacing())
    return _("{voxels} voxels of {spacing} mm").format(voxels=voxels, spacing=spacing)
