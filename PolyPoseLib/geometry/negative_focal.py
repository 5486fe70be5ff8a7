"""Cameras written with negative focal lengths, brought to the one form that is used here.

xreg and the data sets made with it (DeepFluoro) keep the view of a C-arm, from the detector's side: z points from the
detector to the source, so that the patient has negative depth and both focal lengths are negative.  Programs that take
a projection matrix apart, OpenCV's among them, may leave the signs in K, too.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import require_intrinsics
from PolyPoseLib.geometry.rigid import real_array


def has_negative_focal(intrinsics: ArrayLike) -> bool:
    """Whether a value is a K (3, 3) with a focal length below 0; anything that is none is False."""
    try:
        matrix = real_array(intrinsics)
    except (TypeError, ValueError):
        return False
    return matrix.shape == (3, 3) and bool(matrix[0, 0] < 0 or matrix[1, 1] < 0)


def require_signed_intrinsics(matrix: ArrayLike, where: str = "intrinsics") -> np.ndarray:
    """Check intrinsics whose focal lengths may be negative, (3, 3) float64; otherwise as `require_intrinsics`."""
    if not has_negative_focal(matrix):
        return require_intrinsics(matrix, where)
    signed = real_array(matrix)
    require_intrinsics(_with_positive_focal(signed), where)
    return signed


def positive_camera(
    intrinsics: np.ndarray, extrinsic: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray | None, bool | None]:
    """The same camera with positive focal lengths.

    Parameters
    ----------
    intrinsics
        K (3, 3) in pixels, at least one of its focal lengths negative.
    extrinsic
        (4, 4) world mm to camera, whose z may point either way; or None.

    Returns
    -------
    intrinsics
        K (3, 3) of the image as it is stored.
    extrinsic
        (4, 4) world to camera of the view from the source, z from the source to the detector; None without one.
    mirrored
        Whether the stored image is the mirror image of that view; None without an extrinsic, which it depends on.

    Raises
    ------
    InputError
        The world's origin lies at the source's own depth, so that nobody can say which way the z axis points.

    """
    positive = _with_positive_focal(intrinsics)
    if extrinsic is None:
        return positive, None, None
    if extrinsic[2, 3] == 0:
        raise InputError(
            "its focal lengths are negative and the extrinsic's z translation is 0, so which side the patient is on is "
            "not certain; give positive focal lengths, with z from the source to the detector."
        )
    # The patient is near the world's origin; a patient who turns out to be behind the source is refused later.
    toward = 1.0 if extrinsic[2, 3] > 0 else -1.0
    signs = toward * np.array([*np.sign(np.diag(intrinsics)[:2]), 1.0])
    mirrored = bool(signs.prod() < 0)
    if mirrored:
        signs[0] *= -1
    turned = extrinsic.copy()
    turned[:3] *= signs[:, None]
    return positive, turned, mirrored


def _with_positive_focal(intrinsics: np.ndarray) -> np.ndarray:
    """A K (3, 3) whose signs went into the camera's axes; the skew goes with the second one."""
    positive = intrinsics.copy()
    positive[0, 0], positive[1, 1] = abs(intrinsics[0, 0]), abs(intrinsics[1, 1])
    positive[0, 1] *= np.sign(intrinsics[1, 1]) or 1.0
    return positive
