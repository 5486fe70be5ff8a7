"""Writes the README's screenshots: the panel, and genuine slice and 3D views of a registration run by the panel.

python Testing/Slicer/screenshots.py STUDY.json OUTPUT_FOLDER
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

import numpy as np
from slicer_case import REPOSITORY

# isort: split
import qt
import slicer
from harness import errors, layout, modules

_SIZE = (340, 320)
_GAP = 4
_PANEL_WIDTH, _FOOT_HEIGHT = 450, 130


def main(study: str, output: str) -> None:
    """Open the study, register it by the panel's own button, and take the pictures meanwhile."""
    folder = Path(output)
    folder.mkdir(parents=True, exist_ok=True)
    manager = layout.install(_SIZE)
    modules.load(REPOSITORY / "PolyPose" / "PolyPose.py")
    module = slicer.modules.polypose
    module.enter()
    panel = module.panel().panel
    ui = panel.ui
    from PolyPoseSlicer.study.reader import open_study

    open_study(study, panel.parameters, "totalsegmentator_v2")
    panel.parameters.segmentation.CreateClosedSurfaceRepresentation()
    ui.includedOnly.checked = True
    ui.bonesOnly.checked = True
    ui.xraysTable.selectRow(0)
    _panel(ui, folder / "panel-inputs.png", ("inputsSection", "xraysSection"))
    _landmarks(panel, manager, folder, Path(study))
    _carm(panel, manager, folder)
    _register(panel, folder)
    _review(panel, manager, folder)
    print(f"live rendering: {1000 * panel.carm.seconds[-1]:.0f} ms; swallowed errors: {errors.take()}")
    module.exit()
    module.close()


def _landmarks(panel, manager, folder: Path, study: Path) -> None:
    """Pick landmarks of the anchor in the first view as a person would, one of them wrong, and find the second."""
    from PolyPoseSlicer.scene import landmark_lists
    from PolyPoseSlicer.study.camera_source import CameraSource

    ui, rng = panel.ui, np.random.default_rng(0)
    truth = json.loads((study.parent / "truth" / "truth.json").read_text())["cameras"][0]
    points = _places_on_the_anchor(study)
    pixels = _project(truth, points) + rng.normal(0, 1.5, (len(points), 2))
    pixels[4] += [-60, -45]
    sources = list(CameraSource)
    ui.cameraSection.collapsed = False
    ui.cameraSource.currentIndex = sources.index(CameraSource.LANDMARKS)
    panel.landmarks.pick_in_ct(True)
    panel.landmarks.pick_in_xray(True)
    panel.landmarks.pick_in_xray(False)
    source = panel.xrays.source
    landmark_lists.fill(source.ct_landmarks, points * [-1, -1, 1])
    landmark_lists.fill(source.xray_landmarks, np.column_stack([pixels, np.zeros(len(pixels))]))
    _wait(lambda: panel.xrays.source.landmark_camera is not None)
    _wait(lambda: not panel.renderer.busy)
    _panel(ui, folder / "panel-camera.png", ("cameraSection",))
    for name in ("Red", "Yellow", "Green"):
        manager.slices[name].fit()
        manager.slices[name].node.JumpSliceByOffsetting(*(points[0] * [-1, -1, 1]))
    pictures = [manager.slices["PolyPoseXray1"], manager.slices["Red"]]
    _save(_tile([[_picture(each) for each in pictures] + [_three_d(manager)]]), folder / "landmarks.png")
    ui.xraysTable.selectRow(1)
    ui.cameraSource.currentIndex = sources.index(CameraSource.SEARCH)
    ui.findCamera.click()
    _wait(lambda: not panel.cameras.running, 300)
    print(ui.cameraStage.text, ui.foundCameraText.text)
    _panel(ui, folder / "panel-found.png", ("cameraSection",))
    ui.xraysTable.selectRow(0)
    for row in (0, 1):
        ui.xraysTable.selectRow(row)
        ui.cameraSource.currentIndex = 0
    ui.xraysTable.selectRow(0)
    for node in (source.ct_landmarks, source.xray_landmarks):
        node.GetDisplayNode().SetVisibility(False)
        slicer.mrmlScene.RemoveNode(node)
    ui.cameraSection.collapsed = True


def _places_on_the_anchor(study: Path) -> np.ndarray:
    """The anchor's outermost voxels in six directions, (6, 3) LPS mm."""
    import SimpleITK as sitk

    fields = json.loads(study.read_text())
    image = sitk.ReadImage(str(study.parent / fields["segmentation"]))
    wanted = fields["structures"][fields["anchor"]]
    indices = np.argwhere(np.isin(sitk.GetArrayFromImage(image), wanted))[:, ::-1]
    axes = np.array(image.GetDirection()).reshape(3, 3) * image.GetSpacing()
    places = indices @ axes.T + image.GetOrigin()
    return np.array([places[np.argmax(sign * places[:, axis])] for axis in range(3) for sign in (1, -1)])


def _project(camera: dict, points: np.ndarray) -> np.ndarray:
    """Pixels (N, 2) of points (N, 3) LPS mm."""
    extrinsic = np.array(camera["extrinsic"])
    seen = (points @ extrinsic[:3, :3].T + extrinsic[:3, 3]) @ np.array(camera["intrinsics"]).T
    return seen[:, :2] / seen[:, 2:]


def _carm(panel, manager, folder: Path) -> None:
    ui = panel.ui
    ui.carmSection.collapsed = False
    ui.carmLive.checked = True
    _wait(lambda: panel.carm.seconds)
    count = len(panel.carm.seconds)
    ui.carmSecondary.value = ui.carmSecondary.value + 7
    _wait(lambda: len(panel.carm.seconds) > count)
    _panel(ui, folder / "panel-carm.png", ("carmSection",))
    _save(_tile([[_picture(manager.slices["PolyPoseXray1"]), _three_d(manager)]]), folder / "carm.png")
    ui.carmReset.click()
    ui.carmLive.checked = False
    ui.carmSection.collapsed = True


def _register(panel, folder: Path) -> None:
    ui = panel.ui
    ui.presetSelector.currentIndex = 1
    ui.registerButton.click()
    _wait(lambda: ui.progressBar.maximum > 1 and "similarity" in ui.stageLabel.text, 120)
    _panel(ui, folder / "panel-register.png", ("registerSection",))
    _wait(lambda: not panel.register.running, 500)
    print(ui.messageLabel.text)


def _review(panel, manager, folder: Path) -> None:
    ui, parameters = panel.ui, panel.parameters
    parameters.outputSegmentation.CreateClosedSurfaceRepresentation()
    _aim(manager, parameters)
    _panel(ui, folder / "panel-review.png", ("reviewSection",))
    ui.compareMode.currentIndex = 3
    slices = [_picture(manager.slices[name]) for name in ("Red", "Yellow", "Green")]
    xrays = [_picture(manager.slices[f"PolyPoseXray{number}"]) for number in (1, 2)]
    _save(_tile([[*xrays, _three_d(manager)], slices]), folder / "overview.png")
    ui.compareView.currentIndex = 1
    pictures = []
    for mode in (0, 1, 3, 5):
        ui.compareMode.currentIndex = mode
        pictures.append(_picture(manager.slices["PolyPoseXray1"]))
    _save(_tile([pictures]), folder / "compare.png")
    green = manager.slices["Green"]
    ui.showGrid.checked = True
    maps = [_picture(green)]
    ui.showGrid.checked = False
    ui.showJacobian.checked = True
    _wait(lambda: not panel.review.maps.busy)
    maps.append(_picture(green))
    ui.weightStructure.currentIndex = ui.weightStructure.findText("femur_left")
    _wait(lambda: not panel.review.maps.busy)
    maps.append(_picture(green))
    _save(_tile([maps]), folder / "maps.png")
    ui.weightStructure.currentIndex = 0
    ui.showBefore.checked = True
    _wait(lambda: not panel.renderer.busy)
    before = _picture(green)
    ui.showAfter.checked = True
    _save(_tile([[before, _picture(green)]]), folder / "before-after.png")


def _aim(manager, parameters) -> None:
    """Put the slices through the left femur's head."""
    for name in ("Red", "Yellow", "Green"):
        manager.slices[name].fit()
    content = parameters.segmentation.GetSegmentation()
    femur = next(
        each for each in content.GetSegmentIDs() if content.GetSegment(each).GetName() == "femur_left"
    )
    center = parameters.segmentation.GetSegmentCenterRAS(femur)
    for name in ("Red", "Yellow", "Green"):
        node = manager.slices[name].node
        node.JumpSliceByOffsetting(*center)


def _picture(view) -> np.ndarray:
    """What a view shows, (H, W, 3), first row on top."""
    from vtk.util.numpy_support import vtk_to_numpy

    image = view.image()
    width, height, _depth = image.GetDimensions()
    return vtk_to_numpy(image.GetPointData().GetScalars()).reshape(height, width, -1)[::-1, :, :3].copy()


def _three_d(manager) -> np.ndarray:
    view = manager.three_d["1"]
    view.node.SetBoxVisible(False)
    view.node.SetAxisLabelsVisible(False)
    view.look_from((0.5, 0.85, 0.3))
    view.renderer.GetActiveCamera().Zoom(1.5)
    return _picture(view)


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
    """Write a PNG of a palette of its own, which is small."""
    from PIL import Image

    Image.fromarray(picture).quantize(200, method=Image.Quantize.MEDIANCUT).save(path, optimize=True)


def _panel(ui, path: Path, sections: tuple[str, ...]) -> None:
    """Grab the panel with each of some sections open, side by side."""
    form, pictures = ui.stepsArea.parentWidget(), []
    form.show()
    for name in sections:
        getattr(ui, name).collapsed = False
        for _round in range(3):  # until the layouts have settled
            slicer.app.processEvents()
            form.resize(_PANEL_WIDTH, ui.steps.sizeHint.height() + _FOOT_HEIGHT)
        slicer.app.processEvents()
        pictures.append(form.grab())
    whole = qt.QPixmap(sum(each.width() for each in pictures), max(each.height() for each in pictures))
    whole.fill(qt.QColor("#efefef"))
    painter = qt.QPainter(whole)
    left = 0
    for each in pictures:
        painter.drawPixmap(left, 0, each)
        left += each.width()
    painter.end()
    whole.save(str(path))


def _wait(condition, seconds: float = 60.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition() and time.monotonic() < deadline:
        slicer.app.processEvents()
        time.sleep(0.01)


if __name__ == "__main__":
    main(*sys.argv[1:3])
