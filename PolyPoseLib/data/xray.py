"""One X-ray read from a file: line integrals, a mask, K, a camera, and the origin of every number."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from PolyPoseLib.data.landmarks import Landmarks
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import require_intrinsics
from PolyPoseLib.geometry.carm import with_isocenter
from PolyPoseLib.geometry.rigid import require_rigid

CAMERA_STATES = ("known", "initial", "absent")
"""What is known of a camera: fixed, to be refined, or to be found."""

DISTANCE_RANGE_MM = (50.0, 20000.0)
"""From an X-ray's source to its detector or isocentre."""


@dataclass(frozen=True, eq=False)
class Xray:
    """One X-ray; an Xray that exists is valid.

    Attributes
    ----------
    image
        (H, W) float32 line integrals, unitless: larger behind bone. As seen from the source.
    mask
        (H, W) bool, True where the image may be used.
    intrinsics
        K (3, 3) in pixels of `image`, centres at whole numbers.
    extrinsic
        (4, 4) world LPS mm to camera, None when absent.
    camera
        "known", "initial" (to be refined) or "absent".
    pixel_spacing_mm
        At the detector, (between rows, between columns).
    source_to_detector_mm
        Distance from the source to the detector.
    name
        Shown to people, in results, too; empty where the user gave none, and then a study calls it by its number.
    provenance
        Origin of every number, one line each.
    warnings
        What is uncertain, one line each.
    initial_radius
        (degrees, mm) within which the truth is expected around an initial camera, None when unknown.
    mirrored
        Whether `image` is the file's image with its columns in reverse order.
    isocenter
        (3,) LPS mm, the point that an initial camera from DICOM puts at the isocentre; None for other extrinsics.
    table_mm
        (3,) LPS mm, how far the table had carried the patient, from the file's own zero; or None.
    standard_view
        One of geometry.standard_views.STANDARD_VIEWS, or None.
    landmarks
        Points with pixels of `image`, or None.
    rig
        The camera's place in a rig whose cameras keep their relative pose, or None.
    maybe_distorted
        Whether an image intensifier's distortion may be left in it.

    Raises
    ------
    InputError
        From the constructor, when a shape or a rule is broken.

    """

    image: np.ndarray
    mask: np.ndarray
    intrinsics: np.ndarray
    extrinsic: np.ndarray | None
    camera: str
    pixel_spacing_mm: tuple[float, float]
    source_to_detector_mm: float
    name: str = ""
    provenance: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    initial_radius: tuple[float, float] | None = None
    mirrored: bool = False
    isocenter: tuple[float, float, float] | None = None
    table_mm: tuple[float, float, float] | None = None
    standard_view: str | None = None
    landmarks: Landmarks | None = None
    rig: RigPose | None = None
    maybe_distorted: bool = False

    def __post_init__(self) -> None:
        """Validate, and fix the types."""
        label = f'The X-ray "{self.name}"' if self.name else "The X-ray"
        image = np.ascontiguousarray(self.image, dtype=np.float32)
        mask = np.ascontiguousarray(self.mask, dtype=bool)
        if image.ndim != 2 or mask.shape != image.shape:
            raise InputError(f"{label} needs an image (H, W) and a mask of the same shape.")
        if not np.isfinite(image).all() or not mask.any():
            raise InputError(f"{label} needs finite pixels and a mask that leaves some of them.")
        if self.camera not in CAMERA_STATES or (self.camera == "absent") != (self.extrinsic is None):
            raise InputError(f'{label} has the camera "{self.camera}", which does not fit its extrinsic.')
        extrinsic = None if self.extrinsic is None else require_rigid(self.extrinsic, f"{label}: extrinsic")
        fixed = {
            "image": image,
            "mask": mask,
            "intrinsics": require_intrinsics(self.intrinsics),
            "extrinsic": extrinsic,
            "pixel_spacing_mm": tuple(float(part) for part in self.pixel_spacing_mm),
            "source_to_detector_mm": float(self.source_to_detector_mm),
            "provenance": tuple(self.provenance),
            "warnings": tuple(self.warnings),
        }
        for key, value in fixed.items():
            object.__setattr__(self, key, value)

    def placed_at(self, isocenter: ArrayLike) -> Xray:
        """The X-ray with its initial camera from angles moved so that this point (3,) LPS mm is at the isocentre.

        Other X-rays, and those whose isocentre was given, are returned as they are.
        """
        if self.isocenter is None or self.extrinsic is None or np.any(self.isocenter):
            return self
        point = tuple(float(part) for part in np.asarray(isocenter, dtype=np.float64))
        return replace(self, extrinsic=with_isocenter(self.extrinsic, self.isocenter, point), isocenter=point)


def place_isocenter(xrays: Sequence[Xray], isocenter: ArrayLike) -> tuple[Xray, ...]:
    """Place initial cameras of several X-rays at one point of the patient, following the table between them.

    Parameters
    ----------
    xrays
        Of one patient and session.
    isocenter
        (3,) LPS mm, the point at the isocentre in the first view whose initial camera comes from DICOM.

    Returns
    -------
    tuple[Xray, ...]
        The X-rays in their order; those whose camera is given or absent, or whose isocentre was given, are unchanged.

    """
    point = np.asarray(isocenter, dtype=np.float64)
    zero = next((np.array(xray.table_mm) for xray in xrays if xray.isocenter and xray.table_mm), None)
    placed = []
    for xray in xrays:
        moved = np.zeros(3) if zero is None or xray.table_mm is None else np.array(xray.table_mm) - zero
        placed.append(xray.placed_at(point - moved))
    return tuple(placed)


@dataclass(frozen=True, eq=False)
class RigPose:
    """Where one camera of a rig stands. Cameras with different frames are not related.

    Attributes
    ----------
    name
        Of the rig.
    extrinsic
        (4, 4) from the rig's own world (mm), whatever that is, to this camera.
    frame
        Which world that is: "own" (the calibration's) or "ct".

    Raises
    ------
    InputError
        From the constructor, when the extrinsic is not rigid and finite.

    """

    name: str
    extrinsic: np.ndarray
    frame: str = "own"

    def __post_init__(self) -> None:
        """Validate."""
        where = f'The place in the rig "{self.name}"'
        object.__setattr__(self, "extrinsic", require_rigid(self.extrinsic, where))
