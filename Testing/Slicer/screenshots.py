"""Takes the documentation's screenshots in the application, while the panel itself registers a study.

polypose simulate --sample pelvis --format nifti --output study
Slicer --no-splash --additional-module-paths PolyPose \
    --python-script Testing/Slicer/screenshots.py study/study.json OUTPUT_FOLDER
"""

from __future__ import annotations

import json
import sys
import time
import traceback
from pathlib import Path

import numpy as np
import qt
import slicer

_WINDOW = (1760, 1080)
_GAP = 4
_TURN_DEG = 7


def main(study: str, output: str) -> None:
    """Open the study, register it by the panel's own button, and take the pictures meanwhile."""
    folder = Path(output)
    folder.mkdir(parents=True, exist_ok=True)
    window = slicer.util.mainWindow()
    window.showNormal()
    window.resize(*_WINDOW)
    for section in window.findChildren("ctkCollapsibleButton"):
        if section.text == "Data Probe":
            section.collapsed = True
    slicer.util.selectModule("PolyPose")
    panel = slicer.modules.PolyPoseWidget.panel
    from PolyPoseSlicer.study.reader import open_study

    open_study(study, panel.parameters, "totalsegmentator_v2")
    view = slicer.app.layoutManager().threeDWidget(0).mrmlViewNode()
    view.SetBoxVisible(False)
    view.SetAxisLabelsVisible(False)
    panel.ui.bonesOnly.checked = True
    panel.ui.includedOnly.checked = True
    panel.ui.xraysTable.selectRow(0)
    _panel(panel.ui, folder / "panel-inputs.png", "inputsSection", "xraysSection")
    _landmarks(panel, folder, Path(study))
    _carm(panel, folder)
    _register(panel, folder)
    _review(panel, folder)
    _adjust(panel, folder)


def _landmarks(panel, folder: Path, study: Path) -> None:
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
    _panel(ui, folder / "panel-camera.png", "cameraSection")
    slicer.modules.markups.logic().JumpSlicesToLocation(*(points[0] * [-1, -1, 1]), False)
    _tile(folder / "landmarks.png", [_slice("PolyPoseXray1"), _slice("Red"), _three_d()])
    ui.xraysTable.selectRow(1)
    ui.cameraSource.currentIndex = sources.index(CameraSource.SEARCH)
    ui.findCamera.click()
    _wait(lambda: not panel.cameras.running, 300)
    _panel(ui, folder / "panel-found.png", "cameraSection")
    for row in (1, 0):
        ui.xraysTable.selectRow(row)
        ui.cameraSource.currentIndex = 0
    for node in (source.ct_landmarks, source.xray_landmarks):
        slicer.mrmlScene.RemoveNode(node)


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


def _carm(panel, folder: Path) -> None:
    ui = panel.ui
    ui.carmSection.collapsed = False
    ui.carmLive.checked = True
    _wait(lambda: panel.carm.seconds)
    count = len(panel.carm.seconds)
    ui.carmSecondary.value = ui.carmSecondary.value + _TURN_DEG
    _wait(lambda: len(panel.carm.seconds) > count)
    _panel(ui, folder / "panel-carm.png", "carmSection")
    _tile(folder / "carm.png", [_slice("PolyPoseXray1"), _three_d()])
    ui.carmReset.click()
    ui.carmLive.checked = False


def _register(panel, folder: Path) -> None:
    ui = panel.ui
    ui.presetSelector.currentIndex = 1
    ui.registerButton.click()
    _wait(lambda: ui.progressBar.maximum > 1 and "similarity" in ui.stageLabel.text, 120)
    _panel(ui, folder / "panel-register.png", "registerSection")
    _wait(lambda: not panel.register.running, 500)
    _wait(lambda: not panel.review.bones.busy)


def _review(panel, folder: Path) -> None:
    ui, parameters = panel.ui, panel.parameters
    femur = _segment(parameters.segmentation, "femur_left")
    slicer.modules.markups.logic().JumpSlicesToLocation(
        *parameters.segmentation.GetSegmentCenterRAS(femur), False
    )
    _panel(ui, folder / "panel-review.png", "reviewSection")
    ui.compareMode.currentIndex = 3
    _three_d()
    _save(slicer.util.mainWindow().grab(), folder / "overview.png")
    ui.compareView.currentIndex = 1
    pictures = []
    for mode in (0, 1, 3, 5):
        ui.compareMode.currentIndex = mode
        pictures.append(_slice("PolyPoseXray1"))
    _tile(folder / "compare.png", pictures)
    ui.showGrid.checked = True
    maps = [_slice("Green")]
    ui.showGrid.checked = False
    ui.showJacobian.checked = True
    _wait(lambda: not panel.review.maps.busy)
    maps.append(_slice("Green"))
    ui.weightStructure.currentIndex = ui.weightStructure.findText("femur_left")
    _wait(lambda: not panel.review.maps.busy)
    maps.append(_slice("Green"))
    _tile(folder / "maps.png", maps)
    ui.weightStructure.currentIndex = 0
    ui.showBefore.checked = True
    _wait(lambda: not panel.renderer.busy)
    before = [_slice("Green"), _three_d()]
    ui.showAfter.checked = True
    _tile(folder / "before-after.png", [*before, _slice("Green"), _three_d()])


def _adjust(panel, folder: Path) -> None:
    """Turn the left femur by hand."""
    import vtk

    ui = panel.ui
    ui.compareMode.currentIndex = 0
    ui.reviewTabs.setCurrentIndex(ui.reviewTabs.indexOf(ui.adjustTab))
    ui.adjustBone.setCurrentIndex(ui.adjustBone.findText("femur_left"))
    ui.adjustToggle.checked = True
    node = slicer.util.getFirstNodeByName("Adjustment of femur_left")
    centre = node.GetCenterOfTransformation()
    turn = vtk.vtkTransform()
    turn.Translate(*centre)
    turn.RotateY(_TURN_DEG)
    turn.Translate(*(-each for each in centre))
    node.SetMatrixTransformToParent(turn.GetMatrix())
    _save(slicer.util.mainWindow().grab(), folder / "adjust.png")
    ui.adjustToggle.checked = False


def _segment(segmentation, name: str) -> str:
    return segmentation.GetSegmentation().GetSegmentIdBySegmentName(name)


def _slice(name: str) -> qt.QPixmap:
    """What a slice view shows."""
    _settle()
    return slicer.app.layoutManager().sliceWidget(name).sliceView().grab()


def _three_d() -> qt.QPixmap:
    """What the 3D view shows, from the patient's left front, near enough to see the bones."""
    widget = slicer.app.layoutManager().threeDWidget(0)
    view = widget.threeDView()
    view.rotateToViewAxis(3)
    view.resetFocalPoint()
    camera = view.cameraNode()
    renderer = view.renderWindow().GetRenderers().GetFirstRenderer()
    renderer.ResetCamera()
    camera.GetCamera().Azimuth(-30)
    camera.GetCamera().Elevation(15)
    camera.GetCamera().OrthogonalizeViewUp()
    camera.GetCamera().Zoom(1.8)
    renderer.ResetCameraClippingRange()
    _settle()
    return view.grab()


def _tile(path: Path, pictures: list[qt.QPixmap]) -> None:
    """Pictures beside each other."""
    height = min(each.height() for each in pictures)
    pictures = [each.scaledToHeight(height, qt.Qt.SmoothTransformation) for each in pictures]
    width = sum(each.width() for each in pictures) + _GAP * (len(pictures) - 1)
    whole = qt.QPixmap(width, height)
    whole.fill(qt.QColor("white"))
    painter, left = qt.QPainter(whole), 0
    for each in pictures:
        painter.drawPixmap(left, 0, each)
        left += each.width() + _GAP
    painter.end()
    _save(whole, path)


def _panel(ui, path: Path, *sections: str) -> None:
    """The panel with each of some sections open, side by side."""
    pictures = []
    for name in sections:
        getattr(ui, name).collapsed = False
        _settle()
        pictures.append(ui.stepsArea.parentWidget().grab())
    _tile(path, pictures)


def _save(picture: qt.QPixmap, path: Path) -> None:
    """Write a PNG of few colours, which is small, where Pillow is at hand."""
    picture.save(str(path))
    try:
        from PIL import Image
    except ImportError:
        return
    Image.open(path).convert("RGB").quantize(200, method=Image.Quantize.MEDIANCUT).save(path, optimize=True)


def _settle() -> None:
    """Let layouts and views settle."""
    for _round in range(10):
        slicer.app.processEvents()
        time.sleep(0.03)


def _wait(condition, seconds: float = 60.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition() and time.monotonic() < deadline:
        slicer.app.processEvents()
        time.sleep(0.01)


def _run() -> None:
    status = 0
    try:
        main(*sys.argv[1:3])
    except BaseException:
        traceback.print_exc()
        status = 1
    slicer.util.exit(status)


if __name__ == "__main__":
    qt.QTimer.singleShot(3000, _run)
