"""Named standard views: from which side the X-rays pass through the patient, heads up."""

from __future__ import annotations

import numpy as np

from PolyPoseLib.errors import InputError, unknown_name
from PolyPoseLib.geometry.carm import carm_extrinsic

STANDARD_VIEWS: dict[str, float] = {
    "AP": 180.0,
    "PA": 0.0,
    "LL": 90.0,
    "RL": -90.0,
    "LAO": 45.0,
    "RAO": -45.0,
    "LPO": 135.0,
    "RPO": -135.0,
}
"""Primary angle in degrees (positive toward LAO) that puts the receptor where the name says.

AP: source in front, receptor behind the patient; PA: the reverse; LL and RL: left or right side at the
receptor; LAO, RAO, LPO, RPO: left or right front or back at the receptor (DICOM View Position (0018,5101)).
"""


def standard_view_rotation(name: str) -> np.ndarray:
    """Rotation of a named view from the source, heads up.

    Parameters
    ----------
    name : str
        One of STANDARD_VIEWS.

    Returns
    -------
    (3, 3) array
        World LPS to camera.

    Raises
    ------
    InputError
        Another name.

    """
    if name not in STANDARD_VIEWS:
        raise InputError('"standard_view": ' + unknown_name("view", str(name), STANDARD_VIEWS))
    return carm_extrinsic(STANDARD_VIEWS[name], 0.0, 1000.0)[:3, :3]
