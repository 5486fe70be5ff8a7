"""What the readers of both layouts of DeepFluoro give: a subject's CT, labels, and frames with their cameras."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.negative_focal import positive_camera

SPECIMENS = ("17-1882", "18-1109", "18-0725", "18-2799", "18-2800", "17-1905")
"""The cadavers' numbers in the file, for subject 1 to 6 of the publications."""

BONES: dict[str, tuple[int, ...]] = {
    "pelvis": (1, 2, 3, 4, 7),
    "femur_left": (5,),
    "femur_right": (6,),
}
"""Labels of each body: hemipelves, vertebrae, upper and lower sacrum move as one, as in the paper."""

ANCHOR = "pelvis"

FULL_INTENSITY = 65487.0
"""Of an unattenuated ray, as the data set's users have it; a brighter picture's own highest value where it has one."""

CROP_PX = 50
"""At every edge, where the collimator is: 100 pixels less each way."""

BIN = 8
"""Pixels averaged along each axis: 1436 become 179."""

DISTANCE_RANGE_MM = (300.0, 3000.0)
"""From a C-arm's source to its detector."""

_FEWEST_PX = 16
_DEPTHS = (0.1, 1.2)
"""Where the CT's middle may lie, as parts of the way from source to detector."""


@dataclass(frozen=True, eq=False)
class Frame:
    """One X-ray as its file has it, seen from the source, the patient's head up.

    Attributes
    ----------
    number
        In the file.
    intensities
        (H, W) of the detector, smaller behind bone.
    cameras
        {bone: the camera in the world of the CT in which this bone lies where the CT has it}, at least the anchor's.
    labels
        (H, W) of the file's own 2D labels, one a pixel, or None.

    """

    number: int
    intensities: np.ndarray
    cameras: Mapping[str, Camera]
    labels: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class FluoroSubject:
    """One cadaver.

    Attributes
    ----------
    ct, labels
        In HU; on one grid.
    frames
        Numbers of the frames that there are.
    pixel_spacing_mm
        (between rows, between columns).
    read_frame
        Reads one, whole; raises InputError.
    read_cameras
        {bone: camera} of one, without its picture; raises InputError.
    warnings
        What was odd but not wrong.

    """

    ct: Volume
    labels: Volume
    frames: Sequence[int]
    pixel_spacing_mm: tuple[float, float]
    read_frame: Callable[[int], Frame]
    read_cameras: Callable[[int], Mapping[str, Camera]]
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class CtPlace:
    """Where a CT lies, as far as cameras are read by it.

    Attributes
    ----------
    middle
        (3,) of its grid, LPS mm.
    half_voxel
        (3,) mm from a voxel's first corner to its centre.

    """

    middle: np.ndarray
    half_voxel: np.ndarray


def true_to_camera(to_camera: np.ndarray, place: CtPlace) -> np.ndarray:
    """The true (4, 4) from a bone's CT to the camera, of the published one.

    The published poses were found by a renderer that put voxel ijk at affine @ (ijk + 1/2), half a voxel from where
    the CT has it. The data set's author takes that out in the same way (rg2/xreg, sample_single_view_regi_2d_3d).
    """
    shift = np.eye(4)
    shift[:3, 3] = place.half_voxel
    return to_camera @ shift


def is_between(camera: Camera, place: CtPlace, distance_mm: float) -> bool:
    """Whether the CT's middle lies between source and detector, which are this far from each other."""
    nearest, farthest = (part * distance_mm for part in _DEPTHS)
    return bool(nearest <= float(camera.depth(place.middle)) <= farthest)


def source_view(
    intrinsics: np.ndarray, extrinsic: np.ndarray, shape: tuple[int, int], near: np.ndarray, turned: bool
) -> tuple[Camera, bool]:
    """A camera as this program has it, of one that may be written with negative focal lengths.

    Parameters
    ----------
    intrinsics, extrinsic
        (3, 3) pixels and (4, 4) world to camera, as they are stored.
    shape
        (rows, columns).
    near
        (3,) a world point in front of the detector, which says which way the camera's z axis points.
    turned
        Whether the picture must be turned by 180 degrees for the head to be up.

    Returns
    -------
    camera
        Of the picture as `as_seen` gives it.
    mirrored
        Whether the stored picture is the mirror image of the view from the source.

    Raises
    ------
    InputError
        No camera's numbers.

    """
    to_near, back = np.eye(4), np.eye(4)
    to_near[:3, 3], back[:3, 3] = near, -near
    positive, placed, mirrored = positive_camera(intrinsics, extrinsic @ to_near)
    assert placed is not None
    placed = placed @ back
    height, width = shape
    positive = positive.copy()
    if mirrored:
        positive[0, 2] = width - 1 - positive[0, 2]
    if turned:
        positive[:2, 2] = np.array([width - 1, height - 1]) - positive[:2, 2]
        placed[:2] *= -1
    return Camera(positive, placed, height, width), bool(mirrored)


def as_seen(image: np.ndarray, mirrored: bool, turned: bool) -> np.ndarray:
    """A stored picture (H, W) as its `source_view` sees it."""
    seen = image[:, ::-1] if mirrored else image
    return seen[::-1, ::-1] if turned else seen


def reduced_camera(camera: Camera) -> Camera:
    """The camera of a cropped and binned frame; raises InputError for one that is too small for that."""
    height, width = camera.height - 2 * CROP_PX, camera.width - 2 * CROP_PX
    if min(height, width) < _FEWEST_PX * BIN:
        raise InputError(
            f"frames of {camera.height} x {camera.width} pixels are too small: give the full resolution (1536 x 1536)."
        )
    return camera.cropped(CROP_PX, CROP_PX + height, CROP_PX, CROP_PX + width).binned(BIN)


def line_integrals(intensities: np.ndarray) -> np.ndarray:
    """Cropped and binned line integrals (h, w) float32 of a frame's intensities (H, W).

    Intensities are averaged before the logarithm is taken, as a detector with larger pixels would.

    Raises
    ------
    InputError
        The values are no intensities of a detector.

    """
    cropped = _blocks(intensities, CROP_PX)
    if not np.isfinite(cropped).all() or cropped.min() < 0 or cropped.max() <= 100:
        raise InputError(
            f"its values run from {np.nanmin(cropped):g} to {np.nanmax(cropped):g}, no detector's intensities "
            f"(0 to {FULL_INTENSITY:g}): give the file at full resolution, not a preprocessed one."
        )
    mean = cropped.mean(axis=(1, 3), dtype=np.float64)
    return np.log(max(FULL_INTENSITY, float(cropped.max())) / np.maximum(mean, 1.0)).astype(np.float32)


def shown_share(labels: np.ndarray, masks: Mapping[str, np.ndarray]) -> dict[str, float]:
    """Share of the file's own 2D labels (H, W) within each bone's mask (h, w); bones it does not show are absent.

    One label a pixel hides what lies behind, so the labels are a part of the mask, not all of it.
    """
    centres = _blocks(labels, CROP_PX)[:, BIN // 2, :, BIN // 2]
    shares = {}
    for name, mask in masks.items():
        drawn = np.isin(centres, BONES[name])
        if drawn.any():
            shares[name] = float(np.count_nonzero(drawn & mask) / np.count_nonzero(drawn))
    return shares


def _blocks(image: np.ndarray, crop: int) -> np.ndarray:
    """An image (H, W) without its edges as blocks (h, BIN, w, BIN)."""
    rows, columns = ((size - 2 * crop) // BIN for size in image.shape)
    part = image[crop : crop + rows * BIN, crop : crop + columns * BIN]
    return part.reshape(rows, BIN, columns, BIN)
