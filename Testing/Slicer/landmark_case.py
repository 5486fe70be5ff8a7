"""An X-ray with a true camera, and landmarks of the CT with the pixels that show them, as nodes of the scene."""

from __future__ import annotations

import numpy as np
import scenes
import slicer
from PolyPoseSlicer.scene import landmark_lists, pixel_frames
from PolyPoseSlicer.scene.landmark_lists import fill

from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.carm import carm_extrinsic

CENTER = np.array([10.0, -20.0, 30.0])
"""Middle of the CT of scenes.add_ct, LPS mm."""


def random_camera(rng: np.random.Generator, height: int = 40, width: int = 30) -> Camera:
    """A C-arm round the CT, with a pixel's principal point of its own."""
    focal = rng.uniform(450, 550)
    intrinsics = np.array(
        [[focal, 0, rng.uniform(10, 20)], [0, focal, rng.uniform(15, 25)], [0, 0, 1]], dtype=float
    )
    isocenter = CENTER + rng.uniform(-5, 5, 3)
    extrinsic = carm_extrinsic(
        rng.uniform(-180, 180), rng.uniform(-40, 40), rng.uniform(600, 900), isocenter,
        "HFS", detector_rotation_deg=rng.uniform(-20, 20),
    )  # fmt: skip
    return Camera(intrinsics, extrinsic, height, width)


def points_in_ct(rng: np.random.Generator, count: int) -> np.ndarray:
    """Places (N, 3) in the CT, LPS mm, far from each other and from a plane."""
    corners = np.array([[1, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]], dtype=float)
    signs = np.vstack([corners, rng.uniform(-1, 1, (max(count - 4, 0), 3))])[:count]
    return CENTER + signs * [35, 20, 25] + rng.uniform(-4, 4, (count, 3))


def add_ct_list(points: np.ndarray, names: list[str] | None = None) -> slicer.vtkMRMLMarkupsFiducialNode:
    """Points (N, 3) LPS mm as a list."""
    node = landmark_lists.new_list("in the CT", in_xray=False)
    fill(node, np.asarray(points) * [-1, -1, 1], names)
    return node


def add_xray_list(
    pixels: np.ndarray, number: int = 0, names: list[str] | None = None
) -> slicer.vtkMRMLMarkupsFiducialNode:
    """Pixels (N, 2) of the file as a list in a frame."""
    node = landmark_lists.new_list("in the X-ray", in_xray=True)
    node.SetAndObserveTransformNodeID(pixel_frames.new_frame("pixels", number).GetID())
    fill(node, np.column_stack([pixels, np.zeros(len(pixels))]), names)
    return node


def add_xray_of(camera: Camera, name: str = "AP") -> slicer.vtkMRMLScalarVolumeNode:
    """An X-ray node of the camera's size, 2 mm pixels."""
    return scenes.add_xray(name, (camera.height, camera.width))


def fields_of(camera: Camera) -> dict:
    """What is typed of such an X-ray: all but where its camera is."""
    return {"source_to_detector_mm": 2.0 * camera.intrinsics[0, 0], "intrinsics": camera.intrinsics.tolist()}
