"""Cameras in the scene: a transform from the camera's axes to the world, with its intrinsics as an attribute."""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np
import slicer
import vtk

from PolyPoseLib.errors import InputError

from .frames import FLIP, flip_affine, from_vtk, to_vtk

CAMERA_ATTRIBUTE = "PolyPose.Camera"
"""Attribute of a camera's transform node: its intrinsics, size and similarity as JSON."""


@dataclass(frozen=True)
class SceneCamera:
    """A camera: intrinsics (3, 3) px, extrinsic (4, 4) world LPS mm to camera, size in pixels."""

    intrinsics: np.ndarray
    extrinsic: np.ndarray
    height: int
    width: int
    similarity: float | None = None

    def depth_of(self, points: np.ndarray) -> np.ndarray:
        """Distance (N,) of world points (N, 3), LPS mm, from the source along the camera's axis in mm."""
        return np.asarray(points) @ self.extrinsic[2, :3] + self.extrinsic[2, 3]

    def plane_to_ras(self, depth_mm: float) -> np.ndarray:
        """From (column, row, slice, 1) to RAS mm, (4, 4), for an image on the plane at a depth.

        The slice axis points away from the source and is as long as a pixel is wide.
        """
        to_camera = np.eye(4)
        to_camera[:3, :2] = np.linalg.inv(self.intrinsics)[:, :2] * depth_mm
        to_camera[:3, 2] = (0.0, 0.0, np.linalg.norm(to_camera[:3, 0]))
        to_camera[:3, 3] = np.linalg.inv(self.intrinsics)[:, 2] * depth_mm
        return FLIP @ np.linalg.inv(self.extrinsic) @ to_camera


def set_camera(node: slicer.vtkMRMLLinearTransformNode, camera: SceneCamera) -> None:
    """Make a transform node stand for a camera: from its axes (x columns, y rows, z to the detector) to RAS."""
    node.SetMatrixTransformToParent(to_vtk(flip_affine(np.linalg.inv(camera.extrinsic))))
    similarity = camera.similarity
    known = similarity is not None and np.isfinite(similarity)
    fields = {
        "intrinsics": np.asarray(camera.intrinsics).tolist(),
        "height": int(camera.height),
        "width": int(camera.width),
        "similarity": float(similarity) if known else None,
    }
    node.SetAttribute(CAMERA_ATTRIBUTE, json.dumps(fields))


def camera_of(node: slicer.vtkMRMLLinearTransformNode | None) -> SceneCamera | None:
    """The camera that a transform node stands for as it is placed in the scene now; None for any other."""
    text = node.GetAttribute(CAMERA_ATTRIBUTE) if node is not None else None
    if not text:
        return None
    fields = json.loads(text)
    return SceneCamera(
        np.array(fields["intrinsics"], dtype=np.float64),
        extrinsic_of(node),
        int(fields["height"]),
        int(fields["width"]),
        fields["similarity"],
    )


def extrinsic_of(node: slicer.vtkMRMLTransformNode) -> np.ndarray:
    """World (LPS mm) to camera, (4, 4), from a transform node of the camera as it stands in the scene.

    Raises InputError when the transform is not linear.
    """
    if not node.IsTransformToWorldLinear():
        raise InputError(f"The camera '{node.GetName()}' is not a linear transform.")
    matrix = vtk.vtkMatrix4x4()
    node.GetMatrixTransformToWorld(matrix)
    return np.linalg.inv(flip_affine(from_vtk(matrix)))
