"""Line integrals by another program than the product's renderer: ITK-RTK's Joseph projector, or a plain ray sum.

Truth rendered by the renderer under test would hide its faults, so nothing of PolyPoseLib.rendering is used
here.
"""

from __future__ import annotations

import importlib
import importlib.util
from importlib import metadata
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.ndimage import map_coordinates

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.rtk_projection import rtk_projection

if TYPE_CHECKING:
    from PolyPoseLib.data.volume import Volume
    from PolyPoseLib.geometry.camera import Camera

_RAYS_AT_ONCE = 20_000
_BEHIND_MM = 10.0


def rtk_available() -> bool:
    """Whether ITK-RTK (the package itk-rtk) is installed."""
    return (
        importlib.util.find_spec("itk") is not None and importlib.util.find_spec("itk.RTKPython") is not None
    )


def projector_name() -> str:
    """The projector that "auto" stands for here, with its version: "rtk 2.7.0", or "sum"."""
    if not rtk_available():
        return "sum"
    try:
        return f"rtk {metadata.version('itk-rtk')}"
    except metadata.PackageNotFoundError:  # built by hand
        return "rtk"


def project(attenuation: Volume, camera: Camera, projector: str = "auto") -> np.ndarray:
    """Line integrals of a volume along the ray of every pixel.

    Parameters
    ----------
    attenuation : Volume
        1/mm; zero outside its grid.
    camera : Camera
        Without skew; the source must lie outside the volume and see all of it from the front.
    projector : {"auto", "rtk", "sum"}
        "rtk" is ITK-RTK's Joseph projector with exact geometry; "sum" a trilinear ray sum at half the smallest
        spacing, about twenty times slower; "auto" the first of them that is installed.

    Returns
    -------
    (H, W) array of float32
        No unit.

    Raises
    ------
    InputError
        Unknown projector, a camera with skew, or a source within the volume's depth.

    References
    ----------
    P. Joseph, "An improved algorithm for reprojecting rays through pixel images", IEEE TMI 1982.

    """
    if projector == "auto":
        projector = "rtk" if rtk_available() else "sum"
    if projector not in ("rtk", "sum"):
        raise InputError(f'The projector must be "auto", "rtk" or "sum", not {projector!r}.')
    if camera.intrinsics[0, 1] != 0:
        raise InputError("The simulation's cameras must have no skew: set intrinsics[0][1] to 0.")
    if camera.depth(attenuation.corners()).min() <= 0:
        raise InputError(
            "The X-ray source lies inside or behind the CT: increase the source-to-isocenter distance."
        )
    return _rtk(attenuation, camera) if projector == "rtk" else _ray_sum(attenuation, camera)


def _rtk(attenuation: Volume, camera: Camera) -> np.ndarray:
    """Joseph forward projection in a frame whose axes are the volume's."""
    itk: Any = importlib.import_module("itk")
    rtk = itk.RTK
    spacing = attenuation.spacing
    directions = attenuation.affine[:3, :3] / spacing
    if np.abs(directions.T @ directions - np.eye(3)).max() > 1e-4:
        raise InputError(
            "The CT's axes are not perpendicular (gantry tilt): resample it onto a straight grid first."
        )
    voxels, origin = attenuation.voxels, attenuation.affine[:3, 3]
    if np.linalg.det(directions) < 0:
        voxels = voxels[:, :, ::-1]
        origin = attenuation.to_world(np.array([attenuation.shape[2] - 1, 0, 0]))
        directions = directions * [-1, 1, 1]

    image = itk.image_from_array(np.ascontiguousarray(voxels, dtype=np.float32))
    image.SetSpacing(spacing.tolist())
    image.SetOrigin([0.0, 0.0, 0.0])

    depth = float(camera.depth(attenuation.corners()).max()) + _BEHIND_MM
    view = rtk_projection(camera, depth)
    geometry = rtk.ThreeDCircularProjectionGeometry.New()
    added = geometry.AddProjection(
        itk.Point[itk.D, 3]((directions.T @ (view.source - origin)).tolist()),
        itk.Point[itk.D, 3]((directions.T @ (view.corner - origin)).tolist()),
        itk.Vector[itk.D, 3]((directions.T @ view.along_row).tolist()),
        itk.Vector[itk.D, 3]((directions.T @ view.along_column).tolist()),
    )
    if added is False:
        raise InputError("ITK-RTK refused the camera: its axes are not perpendicular.")
    kind = itk.Image[itk.F, 3]
    stack = itk.image_from_array(np.zeros((1, camera.height, camera.width), np.float32))
    stack.SetSpacing([view.pitch[0], view.pitch[1], 1.0])
    joseph = rtk.JosephForwardProjectionImageFilter[kind, kind].New()
    joseph.SetGeometry(geometry)
    joseph.SetInput(0, stack)
    joseph.SetInput(1, image)
    joseph.Update()
    return itk.array_from_image(joseph.GetOutput())[0, ::-1].copy()


def _ray_sum(attenuation: Volume, camera: Camera) -> np.ndarray:
    """Trilinear samples at half the smallest spacing along every ray, through the depths of the volume."""
    depths = camera.depth(attenuation.corners())
    step = float(attenuation.spacing.min()) / 2
    marks = np.arange(depths.min() + step / 2, depths.max(), step)
    to_index = np.linalg.inv(attenuation.affine)
    directions = camera.pixel_directions().reshape(-1, 3)
    start = to_index[:3, :3] @ camera.source + to_index[:3, 3]
    slopes = directions @ to_index[:3, :3].T
    total = np.zeros(len(directions))
    for low in range(0, len(directions), _RAYS_AT_ONCE):
        rays = slopes[low : low + _RAYS_AT_ONCE]
        for mark in marks:
            index = start + mark * rays
            total[low : low + len(rays)] += map_coordinates(
                attenuation.voxels, index.T[::-1], order=1, mode="constant", output=np.float32
            )
    lengths = step * np.linalg.norm(directions, axis=1)
    return (total * lengths).reshape(camera.height, camera.width).astype(np.float32)
