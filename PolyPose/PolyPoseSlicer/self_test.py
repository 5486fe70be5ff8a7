"""The module's self test: a phantom with a known motion, registered as a user's script would do it."""

from __future__ import annotations

import importlib.util
import unittest
from dataclasses import dataclass
from typing import Any

import numpy as np
import slicer

from PolyPoseLib.geometry.camera import Camera

from .scene.cameras import set_camera
from .scene.frames import flip_affine, flip_map, flip_vectors, to_vtk
from .scene.motions import motion_rows, motions_of
from .study.xray_source import XraySource

VOXELS = 56
SPACING_MM = 4.0
PIXELS = 96
PIXEL_MM = 4.0
SOURCE_TO_DETECTOR_MM = 1200.0
SOURCE_TO_CENTRE_MM = 900.0
MOTION_DEG = 6.0
MOTION_MM = np.array([3.0, -2.0, 4.0])
ALLOWED_DEG = 3.0
ALLOWED_MM = 3.0
_ATTENUATION_OF_WATER = 0.02
_STEP_MM = 2.0


@dataclass(frozen=True)
class Phantom:
    """Nodes of a CT of two bones, its segmentation, two X-rays of known cameras, and the mobile bone's motion.

    motion: (4, 4) from the CT to the X-rays' posture, LPS mm.
    """

    ct: slicer.vtkMRMLScalarVolumeNode
    segmentation: slicer.vtkMRMLSegmentationNode
    xrays: list[XraySource]
    motion: np.ndarray


def make_phantom() -> Phantom:
    """Put the phantom into the scene."""
    affine = np.diag([SPACING_MM, SPACING_MM, SPACING_MM, 1.0])
    affine[:3, 3] = -SPACING_MM * (VOXELS - 1) / 2
    k, j, i = np.indices((VOXELS,) * 3, dtype=np.float64)
    points = np.stack([i, j, k], axis=-1) @ affine[:3, :3].T + affine[:3, 3]
    hu, labels = _phantom_at(points, np.eye(4))
    ct = slicer.util.addVolumeFromArray(hu.astype(np.int16), name="PolyPose phantom")
    ct.SetIJKToRASMatrix(to_vtk(flip_affine(affine)))
    segmentation = _add_segmentation(ct, labels)
    motion = _mobile_motion()
    xrays = [_add_xray(number, camera, motion) for number, camera in enumerate(_cameras())]
    return Phantom(ct, segmentation, xrays, motion)


def _mobile_motion() -> np.ndarray:
    """A rotation about the mobile bone's centre and a shift, (4, 4)."""
    angle = np.radians(MOTION_DEG)
    motion = np.eye(4)
    motion[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    centre = np.array([45.0, 0.0, -10.0])
    motion[:3, 3] = centre + MOTION_MM - motion[:3, :3] @ centre
    return motion


def _inside(points: np.ndarray, centre: tuple, radii: tuple) -> np.ndarray:
    return (((points - np.array(centre)) / np.array(radii)) ** 2).sum(axis=-1) < 1


def _phantom_at(points: np.ndarray, motion: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """HU and labels (1 fixed, 2 mobile) of the phantom at points (..., 3), LPS mm, after the bone's motion."""
    back = np.linalg.inv(motion)
    moved = points @ back[:3, :3].T + back[:3, 3]
    fixed_bone = _inside(points, (-45, 5, 10), (22, 16, 62)) | _inside(points, (-25, 5, 55), (40, 18, 16))
    mobile = _inside(moved, (45, 0, -10), (18, 14, 60)) | _inside(moved, (60, 5, 35), (26, 12, 14))
    labels = np.where(fixed_bone, 1, np.where(mobile, 2, 0)).astype(np.uint8)
    body = _inside(points, (0, 0, 0), (105, 70, 100))
    return np.where(labels > 0, 900.0, np.where(body, 30.0, -1000.0)), labels


def _cameras() -> list[Camera]:
    """Two views at right angles, nearly."""
    focal, middle = SOURCE_TO_DETECTOR_MM / PIXEL_MM, (PIXELS - 1) / 2
    intrinsics = np.array([[focal, 0, middle], [0, focal, middle], [0, 0, 1.0]])
    cameras = []
    for degrees in (0.0, 80.0):
        angle = np.radians(degrees)
        away = np.array([np.sin(angle), np.cos(angle), 0.0])  # from the source through the patient
        rows = np.array([0.0, 0.0, -1.0])
        extrinsic = np.eye(4)
        extrinsic[:3, :3] = [np.cross(rows, away), rows, away]
        extrinsic[2, 3] = SOURCE_TO_CENTRE_MM
        cameras.append(Camera(intrinsics, extrinsic, PIXELS, PIXELS))
    return cameras


def _add_xray(number: int, camera: Camera, motion: np.ndarray) -> XraySource:
    """The phantom's line integrals as a volume node, and its camera as a transform node."""
    rays = camera.pixel_directions()
    image = np.zeros((PIXELS, PIXELS), np.float32)
    length = np.linalg.norm(rays, axis=-1)
    for depth in np.arange(SOURCE_TO_CENTRE_MM - 130, SOURCE_TO_CENTRE_MM + 130, _STEP_MM):
        hu, _labels = _phantom_at(camera.source + depth * rays, motion)
        image += (1 + hu / 1000) * _ATTENUATION_OF_WATER * _STEP_MM * length
    node = slicer.util.addVolumeFromArray(image[None], name=f"PolyPose phantom X-ray {number + 1}")
    node.SetSpacing(PIXEL_MM, PIXEL_MM, 1.0)
    place = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLLinearTransformNode", f"{node.GetName()} camera")
    set_camera(place, camera)
    fields = {
        "source_to_detector_mm": SOURCE_TO_DETECTOR_MM,
        "camera": "known",
        "intensity": "line_integral",
        "mirrored": False,
    }
    return XraySource(node, fields=fields, camera_transform=place)


def _add_segmentation(
    ct: slicer.vtkMRMLScalarVolumeNode, labels: np.ndarray
) -> slicer.vtkMRMLSegmentationNode:
    node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLSegmentationNode", "PolyPose phantom bones")
    node.SetReferenceImageGeometryParameterFromVolumeNode(ct)
    for label, name in enumerate(("fixed", "mobile"), start=1):
        node.GetSegmentation().AddEmptySegment(name, name)
        mask = (labels == label).astype(np.uint8)
        slicer.util.updateSegmentBinaryLabelmapFromArray(mask, node, name, ct)
    return node


def test_frames(test: unittest.TestCase) -> None:
    """RAS and LPS coordinates are converted."""
    point = np.array([1.0, 2.0, 3.0])
    test.assertEqual(flip_vectors(point).tolist(), [-1.0, -2.0, 3.0])
    test.assertTrue(np.allclose(flip_map(flip_map(_mobile_motion())), _mobile_motion()))


def test_study(test: unittest.TestCase) -> None:
    """Nodes become a study without being changed."""
    from .study.writer import merged_labels, read_study

    phantom = make_phantom()
    structures = {"fixed": ["fixed"], "mobile": ["mobile"]}
    study = read_study(phantom.ct, phantom.segmentation, structures, phantom.xrays, "fixed")
    labels = merged_labels(study)
    test.assertEqual(sorted(np.unique(labels).tolist()), [0, 1, 2])
    test.assertEqual(len(study.xrays), 2)


def test_registration(test: unittest.TestCase, logic: Any) -> None:
    """A known motion is found, from nodes to nodes."""
    if importlib.util.find_spec("torch") is None:
        test.skipTest("PyTorch is not installed")
    phantom = make_phantom()
    nodes = logic.register(
        phantom.ct,
        phantom.segmentation,
        ["fixed", "mobile"],
        phantom.xrays,
        "fixed",
        options={"preset": "fast"},
    )
    found = motions_of(nodes.motions)
    test.assertLess(motion_rows(found)[0].rotation_deg, 0.1, "the anchor moved")
    error = found["mobile"].matrix @ np.linalg.inv(phantom.motion)
    angle = np.degrees(np.arccos(np.clip((np.trace(error[:3, :3]) - 1) / 2, -1, 1)))
    centroid = found["mobile"].centroid
    true = phantom.motion[:3, :3] @ centroid + phantom.motion[:3, 3]
    miss = np.linalg.norm(found["mobile"].matrix[:3, :3] @ centroid + found["mobile"].matrix[:3, 3] - true)
    test.assertLess(angle, ALLOWED_DEG)
    test.assertLess(miss, ALLOWED_MM)
