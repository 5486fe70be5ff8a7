"""Cameras in the scene: a transform from the camera's axes to the world, with its intrinsics as an attribute."""

from __future__ import annotations

import json

import numpy as np
import slicer
import vtk
from slicer.i18n import tr as _

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera

from .frames import flip_affine, from_vtk, to_vtk

CAMERA_ATTRIBUTE = "PolyPose.Camera"
"""Attribute of a camera's transform node: its intrinsics, size and similarity as JSON."""


def plane_to_ras(camera: Camera, depth_mm: float) -> np.ndarray:
    """From (column, row, slice, 1) to RAS mm, (4, 4), for an image on the camera's plane at a depth."""
    return flip_affine(camera.plane_at(depth_mm))


def set_camera(
    node: slicer.vtkMRMLLinearTransformNode, camera: Camera, similarity: float | None = None
) -> None:
    """Make a transform node stand for a camera: from its axes (x columns, y rows, z to the detector) to RAS.

    similarity: of its X-ray and rendering, None while it is unknown.
    """
    node.SetMatrixTransformToParent(to_vtk(flip_affine(np.linalg.inv(camera.extrinsic))))
    fields = {
        "intrinsics": camera.intrinsics.tolist(),
        "height": camera.height,
        "width": camera.width,
        "similarity": None if similarity is None or not np.isfinite(similarity) else float(similarity),
    }
    node.SetAttribute(CAMERA_ATTRIBUTE, json.dumps(fields))


def camera_of(node: slicer.vtkMRMLLinearTransformNode | None) -> Camera | None:
    """The camera that a transform node stands for as it is placed in the scene now.

    None for any other node, and for a camera that was moved by something other than a rigid motion.
    """
    fields = _stored(node)
    if node is None or not fields:
        return None
    try:
        return Camera(fields["intrinsics"], extrinsic_of(node), int(fields["height"]), int(fields["width"]))
    except InputError:
        return None


def similarity_of(node: slicer.vtkMRMLLinearTransformNode | None) -> float | None:
    """The similarity that was stored with a camera; None when none was."""
    return _stored(node).get("similarity")


def _stored(node: slicer.vtkMRMLLinearTransformNode | None) -> dict:
    text = node.GetAttribute(CAMERA_ATTRIBUTE) if node is not None else None
    return json.loads(text) if text else {}


def extrinsic_of(node: slicer.vtkMRMLTransformNode) -> np.ndarray:
    """World (LPS mm) to camera, (4, 4), from a transform node of the camera as it stands in the scene.

    Raises InputError when the transform is not linear.
    """
    if not node.IsTransformToWorldLinear():
        raise InputError(
            _("The camera '{name}' is not a linear transform: choose one that is.").format(
                name=node.GetName()
            )
        )
    matrix = vtk.vtkMatrix4x4()
    node.GetMatrixTransformToWorld(matrix)
    return np.linalg.inv(flip_affine(from_vtk(matrix)))
