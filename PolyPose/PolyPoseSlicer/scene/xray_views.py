"""The pictures of the X-rays in the scene: a colour image on each detector, and C-arms in 3D.

They are drawn from other nodes, so they are not saved with the scene.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import slicer
import vtk
from slicer.i18n import tr as _
from vtkmodules.util.numpy_support import numpy_to_vtk

from PolyPoseLib.geometry.camera import Camera

from .cameras import plane_to_ras
from .frames import flip_vectors, from_vtk, to_vtk
from .own_nodes import unsaved_node
from .pixel_frames import place

PART_ATTRIBUTE = "PolyPose.View"
"""Attribute of the nodes that are drawn here: the view's number and what the node is."""

_FIRST_GROUP = 6120
"""View groups below it belong to others; a layout that shows the same slices twice counts from 0."""

_BEAM_COLOR = (0.95, 0.75, 0.2)
_SOURCE_RADIUS_MM = 12.0


@dataclass
class XrayPicture:
    """One view: its camera (for the image as it is given), the detector's distance and the X-ray (H, W).

    mirrored: whether C-arms display it the other way round.
    """

    name: str
    camera: Camera
    detector_mm: float
    xray: np.ndarray
    rendering: np.ndarray | None = None
    before: np.ndarray | None = None
    mirrored: bool = False
    plane: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        """Where the picture lies: (column, row, slice, 1) to RAS mm."""
        self.plane = plane_to_ras(self.camera, self.detector_mm)


def view_name(number: int) -> str:
    """The layout name of a view's slice view."""
    return f"PolyPoseXray{number + 1}"


def slice_logic(number: int) -> slicer.vtkMRMLSliceLogic | None:
    """The logic of a view's slice view; None when the layout has no such view."""
    return slicer.app.applicationLogic().GetSliceLogicByLayoutName(view_name(number))


def view_group(number: int) -> int:
    """The view group of a view's slice view: one of its own.

    Slice views of one group follow each other's jumps and links, which would leave the one slice of the picture.
    """
    return _FIRST_GROUP + number


def part(number: int, kind: str) -> slicer.vtkMRMLNode | None:
    """The node of a view: "image", "beam" or "detector"; None when there is none."""
    wanted = f"{number} {kind}"
    for node in slicer.util.getNodesByClass("vtkMRMLDisplayableNode"):
        if node.GetAttribute(PART_ATTRIBUTE) == wanted:
            return node
    return None


def carm_nodes() -> list[slicer.vtkMRMLModelNode]:
    """The models of all C-arms in 3D."""
    models = slicer.util.getNodesByClass("vtkMRMLModelNode")
    return [node for node in models if node.GetAttribute(PART_ATTRIBUTE)]


def show_image(number: int, picture: XrayPicture, rgb: np.ndarray) -> slicer.vtkMRMLVectorVolumeNode:
    """Draw a picture (H, W, 3) uint8 as the view's image, where its detector stands.

    The detector in 3D is left to `show_on_detector`: whatever changes a model draws every slice view anew.
    """
    node = part(number, "image") or _new("vtkMRMLVectorVolumeNode", number, "image", picture.name)
    image = vtk.vtkImageData()
    image.SetDimensions(rgb.shape[1], rgb.shape[0], 1)
    scalars = numpy_to_vtk(np.ascontiguousarray(rgb).reshape(-1, 3), deep=True)
    scalars.SetName("ImageScalars")
    image.GetPointData().SetScalars(scalars)
    was = node.StartModify()
    node.SetIJKToRASMatrix(to_vtk(_shrunk_plane(picture, rgb.shape)))
    node.SetAndObserveImageData(image)
    if node.GetDisplayNode() is None:
        node.CreateDefaultDisplayNodes()
        node.GetDisplayNode().SetSaveWithScene(False)
    node.EndModify(was)
    place(number, picture.plane, picture.xray.shape[1], picture.mirrored)
    return node


def show_on_detector(number: int) -> None:
    """Let the detector in 3D show the view's image as it is now."""
    detector, node = part(number, "detector"), part(number, "image")
    if detector is not None and node is not None and node.GetImageData() is not None:
        _set_texture(detector, node.GetImageData())


def move(number: int, picture: XrayPicture) -> None:
    """Put the view's image, C-arm and points where the picture is now; a zoomed slice view stays zoomed."""
    node = part(number, "image")
    if node is None or node.GetImageData() is None:
        return
    matrix = vtk.vtkMatrix4x4()
    node.GetIJKToRASMatrix(matrix)
    columns, rows, _slices = node.GetImageData().GetDimensions()
    plane = _shrunk_plane(picture, (rows, columns))
    motion = plane @ np.linalg.inv(from_vtk(matrix))
    node.SetIJKToRASMatrix(to_vtk(plane))
    place(number, picture.plane, picture.xray.shape[1], picture.mirrored)
    if part(number, "beam") is not None:
        show_carm(number, picture)
    logic = slice_logic(number)
    rigid = np.allclose(motion[:3, :3].T @ motion[:3, :3], np.eye(3), atol=1e-6)
    if logic is not None and rigid:
        slice_node = logic.GetSliceNode()
        slice_node.GetSliceToRAS().DeepCopy(to_vtk(motion @ from_vtk(slice_node.GetSliceToRAS())))
        slice_node.UpdateMatrices()


def plane_of(number: int, width: int) -> np.ndarray | None:
    """Where a view shows its X-ray of `width` columns now: (column, row, slice, 1) to RAS mm; None: nowhere."""
    node = part(number, "image")
    if node is None or node.GetImageData() is None:
        return None
    matrix = vtk.vtkMatrix4x4()
    node.GetIJKToRASMatrix(matrix)
    return from_vtk(matrix) @ np.linalg.inv(_blocks(width, node.GetImageData().GetDimensions()[0]))


def _shrunk_plane(picture: XrayPicture, shape: tuple[int, ...]) -> np.ndarray:
    """Index to RAS of an image that shows the X-ray in blocks of whole pixels."""
    return picture.plane @ _blocks(picture.xray.shape[1], shape[1])


def _blocks(width: int, shown: int) -> np.ndarray:
    """(4, 4) from pixels of a picture with `shown` columns to those of the X-ray, of which each holds a block."""
    factor = max(1, width // shown)
    blocks = np.diag([factor, factor, 1.0, 1.0])
    blocks[:2, 3] = (factor - 1) / 2
    return blocks


def show_carm(number: int, picture: XrayPicture) -> None:
    """Draw the source, the beam's edges and the detector with its X-ray in 3D."""
    beam = part(number, "beam") or _new("vtkMRMLModelNode", number, "beam", picture.name)
    beam.SetAndObservePolyData(_beam(picture))
    if beam.GetDisplayNode() is None:
        beam.CreateDefaultDisplayNodes()
        beam.GetDisplayNode().SetSaveWithScene(False)
        beam.GetDisplayNode().SetColor(*_BEAM_COLOR)
        beam.GetDisplayNode().SetLineWidth(2)
        beam.GetDisplayNode().SetVisibility2D(False)
    detector = part(number, "detector") or _new("vtkMRMLModelNode", number, "detector", picture.name)
    detector.SetAndObservePolyData(_detector(picture))
    if detector.GetDisplayNode() is None:
        detector.CreateDefaultDisplayNodes()
        display = detector.GetDisplayNode()
        display.SetSaveWithScene(False)
        display.SetColor(1.0, 1.0, 1.0)
        display.SetAmbient(1.0)
        display.SetDiffuse(0.0)
        display.SetBackfaceCulling(False)
        display.SetVisibility2D(False)
    show_on_detector(number)


def aim_view(number: int, picture: XrayPicture, from_detector: bool) -> bool:
    """Let the view's slice view show its image whole; False when the layout has no such view.

    from_detector: as C-arms display; otherwise as seen from the source.
    """
    logic = slice_logic(number)
    image = part(number, "image")
    if logic is None or image is None:
        return False
    logic.GetSliceNode().SetViewGroup(view_group(number))
    aim(logic, image, picture.plane, picture.xray.shape, from_detector)
    return True


def aim(
    logic: slicer.vtkMRMLSliceLogic,
    image: slicer.vtkMRMLVolumeNode | None,
    plane: np.ndarray,
    shape: tuple[int, int],
    from_detector: bool,
) -> None:
    """Let a slice view show an image of shape (H, W) whole, and no other volume.

    plane: (4, 4) from (column, row, slice, 1) as seen from the source to RAS mm.
    """
    composite = logic.GetSliceCompositeNode()
    composite.SetLinkedControl(False)
    composite.SetDoPropagateVolumeSelection(False)  # a volume that is loaded later does not take its place
    composite.SetBackgroundVolumeID(image.GetID() if image is not None else None)
    composite.SetForegroundVolumeID(None)
    composite.SetLabelVolumeID(None)
    node = logic.GetSliceNode()
    matrix = np.eye(4)
    columns, rows = (plane[:3, axis] / np.linalg.norm(plane[:3, axis]) for axis in (0, 1))
    matrix[:3, 0] = -columns if from_detector else columns
    matrix[:3, 1] = -rows
    matrix[:3, 2] = np.cross(matrix[:3, 0], matrix[:3, 1])
    height, width = shape
    matrix[:, 3] = plane @ [(width - 1) / 2, (height - 1) / 2, 0, 1]
    node.GetSliceToRAS().DeepCopy(to_vtk(matrix))
    node.UpdateMatrices()
    across, down, _depth = node.GetDimensions()
    extent = np.linalg.norm(plane[:3, 0]) * width, np.linalg.norm(plane[:3, 1]) * height
    scale = max(extent[0] / max(across, 1), extent[1] / max(down, 1)) * 1.02
    node.SetFieldOfView(scale * across, scale * down, node.GetFieldOfView()[2])


def view_size(number: int) -> tuple[int, int] | None:
    """Pixels across and down of the view's slice view; None when the layout has none."""
    logic = slice_logic(number)
    return None if logic is None else tuple(logic.GetSliceNode().GetDimensions()[:2])


def remove_all() -> None:
    """Take every picture and C-arm out of the scene."""
    for node in slicer.util.getNodesByClass("vtkMRMLDisplayableNode"):
        if node.GetAttribute(PART_ATTRIBUTE):
            slicer.mrmlScene.RemoveNode(node)


def remove_from(first: int) -> None:
    """Take the views from a number on out of the scene."""
    for node in slicer.util.getNodesByClass("vtkMRMLDisplayableNode"):
        number = node.GetAttribute(PART_ATTRIBUTE)
        if number and int(number.split()[0]) >= first:
            slicer.mrmlScene.RemoveNode(node)


def _new(kind: str, number: int, what: str, name: str) -> slicer.vtkMRMLNode:
    names = {"image": _("View of {name}"), "beam": _("C-arm of {name}"), "detector": _("Detector of {name}")}
    node = unsaved_node(kind, names[what].format(name=name))
    node.SetAttribute(PART_ATTRIBUTE, f"{number} {what}")
    return slicer.mrmlScene.AddNode(node)


def _corners(picture: XrayPicture) -> np.ndarray:
    """RAS (4, 3) of the image's corners: first row and column, then round."""
    height, width = picture.xray.shape
    ends = [(-0.5, -0.5), (width - 0.5, -0.5), (width - 0.5, height - 0.5), (-0.5, height - 0.5)]
    return np.array([(picture.plane @ [column, row, 0, 1])[:3] for column, row in ends])


def _beam(picture: XrayPicture) -> vtk.vtkPolyData:
    """The source as a ball, the edges of the beam, and the detector's frame."""
    source = flip_vectors(picture.camera.source)
    ball = vtk.vtkSphereSource()
    ball.SetCenter(*source)
    ball.SetRadius(_SOURCE_RADIUS_MM)
    whole = vtk.vtkAppendPolyData()
    whole.AddInputConnection(ball.GetOutputPort())
    corners = _corners(picture)
    for number, corner in enumerate(corners):
        for end in (source, corners[(number + 1) % 4]):
            line = vtk.vtkLineSource()
            line.SetPoint1(*corner)
            line.SetPoint2(*end)
            whole.AddInputConnection(line.GetOutputPort())
    whole.Update()
    return whole.GetOutput()


def _detector(picture: XrayPicture) -> vtk.vtkPolyData:
    """The detector's plane with texture coordinates that follow the image's columns and rows."""
    corners = _corners(picture)
    plane = vtk.vtkPlaneSource()
    plane.SetOrigin(*corners[0])
    plane.SetPoint1(*corners[1])
    plane.SetPoint2(*corners[3])
    plane.Update()
    return plane.GetOutput()


def _set_texture(detector: slicer.vtkMRMLModelNode, image: vtk.vtkImageData) -> None:
    producer = vtk.vtkTrivialProducer()
    producer.SetOutput(image)
    detector.GetDisplayNode().SetTextureImageDataConnection(producer.GetOutputPort())
