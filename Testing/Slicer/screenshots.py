"""Writes the README's screenshots: the panel, and genuine slice and 3D views of a study and its result.

python Testing/Slicer/screenshots.py STUDY.json RESULT_FOLDER OUTPUT_FOLDER
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np
from slicer_case import REPOSITORY

# isort: split
import qt
import slicer
from harness import errors, layout, modules

_SIZE = (460, 400)
_GAP = 4


def main(study: str, result: str, output: str) -> None:
    """Open the study and its result, and take the pictures."""
    folder = Path(output)
    folder.mkdir(parents=True, exist_ok=True)
    manager = layout.install(_SIZE)
    modules.load(REPOSITORY / "PolyPose" / "PolyPose.py")
    module = slicer.modules.polypose
    module.enter()
    panel = module.panel().panel
    ui = panel.ui
    from PolyPoseSlicer.study_reader import open_study

    open_study(study, panel.parameters, "totalsegmentator_v2")
    panel.parameters.segmentation.CreateClosedSurfaceRepresentation()
    ui.includedOnly.checked = True
    ui.bonesOnly.checked = True
    ui.xraysTable.selectRow(0)
    _panel(ui, folder / "panel-inputs.png", ("inputsSection", "xraysSection"))
    ui.carmSection.collapsed = False
    ui.carmLive.checked = True
    _wait(lambda: panel.carm.seconds)
    ui.carmPrimary.value = ui.carmPrimary.value + 6
    _wait(lambda: not panel.renderer.busy)
    _panel(ui, folder / "panel-carm.png", ("carmSection",))
    _grid(manager, [["PolyPoseXray1", "1"]], folder / "carm.png")
    ui.carmLive.checked = False
    panel.review.load_result(result)
    panel.parameters.outputSegmentation.CreateClosedSurfaceRepresentation()
    slicer.app.processEvents()
    _aim(manager)
    ui.compareMode.currentIndex = 3
    _panel(ui, folder / "panel-review.png", ("registerSection", "reviewSection"))
    slices = ["Red", "Green"]
    _grid(manager, [["PolyPoseXray1", "PolyPoseXray2"], ["1", "Green"]], folder / "overview.png")
    _compare(ui, manager, folder / "compare.png")
    ui.showGrid.checked = True
    _grid(manager, [slices], folder / "grid.png")
    ui.showGrid.checked = False
    ui.showJacobian.checked = True
    change = _picture(manager.slices["Green"])
    ui.weightStructure.currentIndex = ui.weightStructure.findText("femur_left")
    _save(_tile([[change, _picture(manager.slices["Green"])]]), folder / "maps.png")
    ui.weightStructure.currentIndex = 0
    ui.showBefore.checked = True
    _wait(lambda: not panel.renderer.busy)
    before = [_picture(manager.slices[name]) for name in slices]
    ui.showAfter.checked = True
    after = [_picture(manager.slices[name]) for name in slices]
    _save(_tile([before, after]), folder / "before-after.png")
    panel.review.save_report(str(folder / "report.html"))
    print(f"live rendering: {1000 * panel.carm.seconds[-1]:.0f} ms; swallowed errors: {errors.take()}")
    module.exit()
    module.close()


def _compare(ui, manager, path: Path) -> None:
    """One view compared in four ways."""
    pictures = []
    for mode in (0, 1, 3, 5):
        ui.compareMode.currentIndex = mode
        pictures.append(_picture(manager.slices["PolyPoseXray1"]))
    _save(_tile([pictures[:2], pictures[2:]]), path)
    ui.compareMode.currentIndex = 0


def _aim(manager) -> None:
    """Look at the middle of the femora, and at everything in 3D."""
    for name in ("Red", "Yellow", "Green"):
        manager.slices[name].fit()
    manager.three_d["1"].look_from((0.55, 0.75, 0.25))


def _picture(view) -> np.ndarray:
    """What a view shows, (H, W, 3), first row on top."""
    from vtk.util.numpy_support import vtk_to_numpy

    image = view.image()
    width, height, _depth = image.GetDimensions()
    return vtk_to_numpy(image.GetPointData().GetScalars()).reshape(height, width, -1)[::-1, :, :3].copy()


def _grid(manager, names: list[list[str]], path: Path) -> None:
    views = {**manager.slices, **manager.three_d}
    manager.three_d["1"].look_from((0.55, 0.75, 0.25))
    _save(_tile([[_picture(views[name]) for name in row] for row in names]), path)


def _tile(rows: list[list[np.ndarray]]) -> np.ndarray:
    """Pictures of one size beside and below each other."""
    height, width = rows[0][0].shape[:2]
    canvas = np.full(
        (len(rows) * (height + _GAP) - _GAP, len(rows[0]) * (width + _GAP) - _GAP, 3), 255, np.uint8
    )
    for row, pictures in enumerate(rows):
        for column, picture in enumerate(pictures):
            top, left = row * (height + _GAP), column * (width + _GAP)
            canvas[top : top + height, left : left + width] = picture
    return canvas


def _save(picture: np.ndarray, path: Path) -> None:
    from PolyPoseSlicer.report_page import png_of

    path.write_bytes(png_of(picture))


def _panel(ui, path: Path, sections: tuple[str, ...]) -> None:
    """Grab some sections of the panel."""
    form = ui.inputsSection.window()
    form.resize(560, 2600)
    form.show()
    slicer.app.processEvents()
    pictures = [getattr(ui, name).grab() for name in sections]
    whole = qt.QPixmap(max(each.width() for each in pictures), sum(each.height() for each in pictures))
    whole.fill(qt.QColor("#efefef"))
    painter = qt.QPainter(whole)
    top = 0
    for each in pictures:
        painter.drawPixmap(0, top, each)
        top += each.height()
    painter.end()
    whole.save(str(path))


def _wait(condition, seconds: float = 60.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition() and time.monotonic() < deadline:
        slicer.app.processEvents()
        time.sleep(0.01)


if __name__ == "__main__":
    main(*sys.argv[1:4])
