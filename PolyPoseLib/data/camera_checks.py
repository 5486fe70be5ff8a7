"""Cameras that a study gives, against the patient: what the image could never have been taken with is refused."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.xray import Xray
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera

BEHIND = 1.02
"""Share of the distance to the detector beyond which nothing of the anchor may begin: distances are rounded."""

NARROW_DEG = 8.0
"""X-rays that differ by less in direction show next to no depth."""

_POINTS_PER_AXIS = 48
"""Of the grid on which structures are looked at."""


def structure_points(structures: Structures, affine: np.ndarray, name: str | None = None) -> np.ndarray:
    """Some points (N, 3), LPS mm, of one structure or of all of them.

    Parameters
    ----------
    structures
        On the CT's grid.
    affine
        (4, 4), maps (i, j, k, 1) to LPS mm.
    name
        Of one structure; all when None.

    """
    labels = structures.labels
    step = [max(1, side // _POINTS_PER_AXIS) for side in labels.shape]
    coarse = labels[:: step[0], :: step[1], :: step[2]]
    wanted = coarse > 0 if name is None else coarse == structures.index(name) + 1
    index = np.argwhere(wanted)[:, ::-1] * step[::-1]
    if not len(index):  # smaller than the steps
        centroids = structures.centroids(affine)
        return centroids if name is None else centroids[[structures.index(name)]]
    return index @ affine[:3, :3].T + affine[:3, 3]


def check_camera(xray: Xray, anchor: np.ndarray, bones: np.ndarray, distance_known: bool) -> str | None:
    """Refuse a camera that cannot have taken the X-ray.

    Parameters
    ----------
    xray
        Whose extrinsic was given; one without an extrinsic, or whose isocentre is not placed yet, passes.
    anchor, bones
        (N, 3) points of the anchor and of all structures, LPS mm.
    distance_known
        Whether the X-ray's distance to the detector is one that somebody stated.

    Returns
    -------
    str or None
        A warning about an initial camera that shows nothing.

    Raises
    ------
    InputError
        The anchor lies behind the source or behind the detector, or a known camera shows nothing.

    """
    if xray.extrinsic is None or xray.isocenter is not None:
        return None
    camera = Camera(xray.intrinsics, xray.extrinsic, *xray.image.shape)
    depth = camera.depth(anchor)
    if depth.max() <= 0:
        raise InputError(
            f'"{xray.name}": the anchor lies behind the X-ray source; give an "extrinsic" whose z axis points from the '
            "source to the detector, for points in LPS millimetres of the CT."
        )
    if distance_known and depth.min() > BEHIND * xray.source_to_detector_mm:
        raise InputError(
            f'"{xray.name}": the anchor is {depth.min():.0f} to {depth.max():.0f} mm from the source, behind the '
            f'detector at {xray.source_to_detector_mm:.0f} mm; correct "extrinsic" or "source_to_detector_mm".'
        )
    if _is_seen(camera, bones):
        return None
    if xray.camera == "known":
        raise InputError(
            f'"{xray.name}": its known camera looks past all structures, so the image cannot show them; correct '
            '"extrinsic", which maps LPS millimetres of the CT to the camera, or the principal point.'
        )
    return (
        f'The initial camera of "{xray.name}" looks past all structures: check its "extrinsic", which maps LPS '
        "millimetres of the CT to the camera."
    )


def narrow_views(xrays: Sequence[Xray]) -> tuple[str, ...]:
    """A warning where all of several cameras look from nearly one direction."""
    poses = [xray.extrinsic for xray in xrays if xray.extrinsic is not None]
    if len(poses) < max(2, len(xrays)):
        return ()
    axes = np.stack([pose[2, :3] for pose in poses])
    widest = float(np.degrees(np.arccos(np.clip(axes @ axes.T, -1, 1))).max())
    if widest >= NARROW_DEG:
        return ()
    return (
        f"All X-rays look from within {widest:.0f} degrees of one direction, as one X-ray would: how far a structure "
        "moved along its rays is poorly known.",
    )


def _is_seen(camera: Camera, points: np.ndarray) -> bool:
    """Whether any of the points (N, 3) projects into the image."""
    column, row = camera.project(points).T
    inside = (column > -0.5) & (column < camera.width - 0.5) & (row > -0.5) & (row < camera.height - 0.5)
    return bool(inside.any())
