"""Cone-beam reconstruction of a study's X-rays, by ITK-RTK.

From a handful of views it shows bones as crossing streaks; that it is a poor volume is the point of comparing with it.

References
----------
L. A. Feldkamp, L. C. Davis, J. W. Kress, "Practical cone-beam algorithm", JOSA A 1984.

"""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from PolyPoseLib.baselines.aligned_views import AlignedViews, align_views
from PolyPoseLib.baselines.packages import require_package
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.data.xray import Xray
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.grid import require_grid
from PolyPoseLib.geometry.rtk_projection import rtk_projection

_DETECTOR_MM = 1000.0
"""Where the aligned detectors are put; line integrals are the same at every distance."""

SPARED_PIXELS = 0.5
"""The ramp filter continues a row smoothly to zero on both sides, by all of its pixels but these.

Patients are wider than a C-arm's detector, and a row that ends abruptly becomes a bright rim. RTK mirrors the row in
whole pixels; by its whole width it would read a pixel beside the images.
"""


def reconstruct(xrays: Sequence[Xray], grid: Volume, threads: int = 1) -> Volume:
    """Attenuation on a grid from X-rays with cameras, by ITK-RTK's FDKConeBeamReconstructionFilter.

    Views are weighted by the angle that each stands for on the half circle of different directions, so that two
    views 30 degrees apart and sixty over a full turn have the same mean.

    Parameters
    ----------
    xrays
        Line integrals, larger behind bone, and cameras; known and initial ones are taken as they are.
    grid
        Where to reconstruct; its voxels are not looked at.
    threads
        Of the processor.

    Returns
    -------
    Volume
        1/mm, float32, on the grid.

    Raises
    ------
    InputError
        itk-rtk is not installed, an X-ray without camera, or cameras that no axis of rotation fits.

    """
    require_package("itk.RTKPython", "itk-rtk", "A cone-beam reconstruction")
    require_grid(grid.affine, "the grid to reconstruct on")
    centre = grid.bounds_center
    views = align_views(xrays, centre, float(grid.spacing.min()) / 2)
    rotation = _rtk_axes(views.axis)
    itk: Any = importlib.import_module("itk")
    kind = itk.Image[itk.F, 3]

    geometry = _geometry(itk, views.cameras, rotation, centre)
    shares = _angular_shares(views)
    # RTK weights by the gaps on the full circle, half of which every ray is measured twice.
    gaps = np.array(geometry.GetAngularGaps(geometry.GetSourceAngles())) / 2
    weights = np.where(gaps > 1e-6, shares / np.maximum(gaps, 1e-6), 0.0)
    weighted = views.images[:, ::-1] * weights[:, None, None]
    stack = itk.image_from_array(np.ascontiguousarray(weighted, dtype=np.float32))
    pitch = rtk_projection(views.cameras[0], _DETECTOR_MM).pitch
    stack.SetSpacing([float(pitch[0]), float(pitch[1]), 1.0])

    empty = itk.image_from_array(np.zeros(grid.shape, np.float32))
    empty.SetSpacing(grid.spacing.tolist())
    empty.SetDirection(itk.matrix_from_array(rotation @ (grid.affine[:3, :3] / grid.spacing)))
    empty.SetOrigin((rotation @ (grid.affine[:3, 3] - centre)).tolist())

    fdk = itk.RTK.FDKConeBeamReconstructionFilter[kind].New()
    fdk.SetNumberOfWorkUnits(threads)
    fdk.SetGeometry(geometry)
    fdk.SetInput(0, empty)
    fdk.SetInput(1, stack)
    fdk.GetRampFilter().SetTruncationCorrection(1 - SPARED_PIXELS / weighted.shape[2])
    fdk.Update()
    return grid.with_voxels(itk.array_from_image(fdk.GetOutput()))


def _geometry(itk: Any, cameras: Sequence[Camera], rotation: np.ndarray, centre: np.ndarray) -> Any:
    """RTK's geometry of aligned cameras, in axes about whose second the source turns, around a centre."""
    geometry = itk.RTK.ThreeDCircularProjectionGeometry.New()
    for camera in cameras:
        view = rtk_projection(camera, _DETECTOR_MM)
        added = geometry.AddProjection(
            itk.Point[itk.D, 3]((rotation @ (view.source - centre)).tolist()),
            itk.Point[itk.D, 3]((rotation @ (view.corner - centre)).tolist()),
            itk.Vector[itk.D, 3]((rotation @ view.along_row).tolist()),
            itk.Vector[itk.D, 3]((rotation @ view.along_column).tolist()),
        )
        if added is False:
            raise InputError("ITK-RTK refused a camera: its axes are not perpendicular.")
    return geometry


def _rtk_axes(axis: np.ndarray) -> np.ndarray:
    """(3, 3) from the world to axes whose second is the axis of rotation, as RTK has it."""
    first = np.zeros(3)
    first[np.argmin(np.abs(axis))] = 1.0
    first -= (first @ axis) * axis
    first /= np.linalg.norm(first)
    return np.stack([first, axis, np.cross(first, axis)])


def _angular_shares(views: AlignedViews) -> np.ndarray:
    """(N,) radians that each view stands for; they sum to pi, since opposite views show the same."""
    frame = _rtk_axes(views.axis)
    forward = np.stack([camera.axis for camera in views.cameras]) @ frame.T
    angles = np.arctan2(forward[:, 0], forward[:, 2]) % np.pi
    order = np.argsort(angles, kind="stable")
    gaps: np.ndarray = np.diff(np.append(angles[order], angles[order[0]] + np.pi))
    shares = np.empty(len(angles))
    shares[order] = (gaps + np.roll(gaps, 1)) / 2
    return shares
