"""Small cases in the scene with a known answer, and result folders that the core itself writes."""

from __future__ import annotations

import atexit
import pickle
import shutil
import tempfile
from pathlib import Path

import numpy as np
import slicer
import slicer_case  # noqa: F401 - makes the module importable
import vtk
from PolyPoseSlicer.scene.frames import flip_affine, to_vtk

SHAPE = (20, 24, 28)
SPACING = (3.0, 2.5, 4.0)
TERMINOLOGY = (
    "Segmentation category and type~SCT^123037004^Anatomical Structure~SCT^71341001^Femur"
    "~SCT^7771000^Left~Anatomic codes~^^~^^"
)

_saved: dict[bytes, Path] = {}
"""Result folders by what was changed: drawing the report takes a second."""


def rotation(axis: tuple[float, float, float], degrees: float) -> np.ndarray:
    """A rotation matrix (4, 4)."""
    transform = vtk.vtkTransform()
    transform.RotateWXYZ(degrees, *axis)
    matrix = transform.GetMatrix()
    return np.array([[matrix.GetElement(r, c) for c in range(4)] for r in range(4)])


def affine(left_handed: bool = False, tilt_deg: float = 0.0) -> np.ndarray:
    """From (i, j, k, 1) to LPS mm (4, 4), centred near (10, -20, 30)."""
    axes = rotation((1, 2, 3), tilt_deg)[:3, :3] @ np.diag(SPACING)
    if left_handed:
        axes[:, 2] *= -1
    out = np.eye(4)
    out[:3, :3] = axes
    out[:3, 3] = np.array([10.0, -20.0, 30.0]) - axes @ (np.array(SHAPE[::-1]) - 1) / 2
    return out


def voxels() -> np.ndarray:
    """A CT (k, j, i) in HU: air, a soft ellipsoid, two bones; no symmetry."""
    k, j, i = np.indices(SHAPE).astype(np.float64)
    body = ((k - 9.5) / 9) ** 2 + ((j - 11.5) / 10) ** 2 + ((i - 13.5) / 12) ** 2 < 1
    return np.where(labels() > 0, 600 + 10 * i, np.where(body, 20 + j, -1000)).astype(np.int16)


def labels() -> np.ndarray:
    """1: a block on one side, 2: a smaller one on the other, 3: one voxel thick plate."""
    out = np.zeros(SHAPE, np.uint8)
    out[5:15, 8:14, 5:10] = 1
    out[7:12, 9:16, 17:22] = 2
    out[4, 8:16, 11:15] = 3
    return out


def add_ct(matrix: np.ndarray | None = None, name: str = "CT") -> slicer.vtkMRMLScalarVolumeNode:
    """The CT as a volume node; matrix: from (i, j, k, 1) to LPS mm."""
    matrix = affine() if matrix is None else matrix
    node = slicer.util.addVolumeFromArray(voxels(), name=name)
    node.SetIJKToRASMatrix(to_vtk(flip_affine(matrix)))
    node.CreateDefaultDisplayNodes()
    node.GetDisplayNode().SetAutoWindowLevel(False)
    node.GetDisplayNode().SetWindowLevel(1500, 300)
    return node


def add_segmentation(ct: slicer.vtkMRMLScalarVolumeNode) -> slicer.vtkMRMLSegmentationNode:
    """Three segments on the CT's grid: pelvis (red, with terminology), femur (green), plate (blue)."""
    node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLSegmentationNode", "Bones")
    node.SetReferenceImageGeometryParameterFromVolumeNode(ct)
    label_map = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLLabelMapVolumeNode", "temporary")
    label_map.CopyOrientation(ct)
    slicer.util.updateVolumeFromArray(label_map, labels())
    slicer.modules.segmentations.logic().ImportLabelmapToSegmentationNode(label_map, node)
    slicer.mrmlScene.RemoveNode(label_map)
    content = node.GetSegmentation()
    for number, (name, color) in enumerate(
        (("pelvis", (1.0, 0.0, 0.0)), ("femur", (0.0, 1.0, 0.0)), ("plate", (0.0, 0.0, 1.0)))
    ):
        segment = content.GetNthSegment(number)
        segment.SetName(name)
        segment.SetColor(*color)
    content.GetNthSegment(0).SetTerminology(TERMINOLOGY)
    node.CreateDefaultDisplayNodes()
    node.SetAndObserveTransformNodeID(ct.GetTransformNodeID())
    return node


def add_xray(name: str = "AP", size: tuple[int, int] = (40, 30)) -> slicer.vtkMRMLScalarVolumeNode:
    """An X-ray of (rows, columns) as a volume node of one slice, 2 mm pixels; each name has its own picture."""
    image = np.arange(size[0] * size[1], dtype=np.float32).reshape(1, *size) / 400
    if name != "AP":
        image = image + np.random.default_rng(len(name)).random(image.shape, np.float32)
    node = slicer.util.addVolumeFromArray(image, name=name)
    node.SetSpacing(2.0, 2.0, 1.0)
    return node


def add_transform(matrix: np.ndarray, name: str = "placed") -> slicer.vtkMRMLLinearTransformNode:
    """A linear transform node to RAS."""
    node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLLinearTransformNode", name)
    node.SetMatrixTransformToParent(to_vtk(matrix))
    return node


def field(matrix: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """A smooth displacement field (k, j, i, 3) of up to 12 mm on a coarse grid over the CT, and its affine."""
    fine = affine() if matrix is None else matrix
    stride = np.eye(4)
    stride[:3, :3] *= 2
    coarse = fine @ stride
    shape = tuple((n + 1) // 2 + 1 for n in SHAPE)
    k, j, i = np.indices(shape)
    vectors = np.stack([8 * np.sin(i / 3), 5 * np.cos(j / 4) + k / 4, 12 * np.sin(k / 3 + i / 5)], axis=-1)
    return vectors.astype(np.float32), coarse


def camera_matrix() -> tuple[np.ndarray, np.ndarray]:
    """Intrinsics (3, 3) of the X-ray of add_xray, and a frontal extrinsic (4, 4) 800 mm before the CT."""
    intrinsics = np.array([[500.0, 0.0, 14.5], [0.0, 500.0, 19.5], [0.0, 0.0, 1.0]])
    extrinsic = np.eye(4)
    extrinsic[:3, :3] = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]
    extrinsic[:3, 3] = -extrinsic[:3, :3] @ np.array([10.0, -820.0, 30.0])
    return intrinsics, extrinsic


WARNINGS = (
    "All X-rays were taken from about one direction: depth along it is hardly known.",
    "something was odd",
)
"""What the panel says of a result, whose two cameras are the same one."""


def result(
    ct_affine: np.ndarray | None = None,
    distrust: tuple[str, ...] = (),
    warped: np.ndarray | None = None,
    warnings: tuple[str, ...] = ("something was odd",),
    doubts: tuple[str, ...] = (),
):
    """A PolyPoseLib Result of two structures and two views."""
    from PolyPoseLib.data.displacement_field import DisplacementField
    from PolyPoseLib.data.result import CameraResult, Result, StructureResult
    from PolyPoseLib.data.volume import Volume
    from PolyPoseLib.geometry.camera import Camera

    matrix = affine() if ct_affine is None else ct_affine
    pose = rotation((0, 0, 1), 10.0)
    pose[:3, 3] = (1.0, 2.0, 3.0)
    camera = Camera(*camera_matrix(), 40, 30)
    drawn = [np.full((40, 30), 0.5 + n, np.float32) for n in range(2)]
    interval = {"level": 0.95, "along_mm": 0.4, "across_mm": [0.1, 0.2], "covariance": np.eye(6).tolist()}
    return Result(
        structures={
            "pelvis": StructureResult.from_pose(np.eye(4), np.array([10.0, -20.0, 30.0])),
            "femur": StructureResult.from_pose(pose, np.array([30.0, -20.0, 20.0]), interval, doubts),
        },
        cameras=[CameraResult(camera, 0.9 - n / 10, f"view{n}") for n in range(2)],
        history=[{"stage": "joint", "iteration": n, "similarity": 0.1 * n} for n in range(9)],
        seconds={"joint": 1.5, "total": 1.9},
        device="cpu",
        versions={"polypose": "test"},
        warnings=list(warnings),
        warped_ct=Volume(voxels(), matrix),
        warped_labels=Volume(labels() if warped is None else warped, matrix),
        transform=DisplacementField(*field(matrix)),
        renderings_before=drawn,
        renderings_after=drawn,
        xray_images=drawn,
        xray_masks=[np.ones((40, 30), bool)] * 2,
        distrust=distrust,
    )


def save_result(folder: Path, **changes) -> Path:
    """A result folder as the core writes it; the same changes are written once and copied then."""
    key = pickle.dumps(sorted(changes.items()))
    if key not in _saved:
        home = tempfile.mkdtemp(prefix="polypose-results-")
        atexit.register(shutil.rmtree, home, ignore_errors=True)
        _saved[key] = result(**changes).save(Path(home) / "result")
    shutil.copytree(_saved[key], folder)
    return folder
