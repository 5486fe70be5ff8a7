"""A small body for the tests of the simulation: a socket, a bone with a round head in it, a spine."""

import numpy as np

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.volume import Volume

NAMES = ("pelvis", "femur_left", "vertebrae_L5", "vertebrae_L4")
HEAD_CENTRE = np.array([40.0, 0.0, -20.0])
HEAD_RADIUS = 20.0


def phantom(spacing=(4.0, 4.0, 5.0), handedness=1):
    """A CT (HU) with structures, in LPS mm around the origin."""
    spacing = np.array(spacing)
    size = np.ceil(np.array([200.0, 140.0, 240.0]) / spacing).astype(int)
    affine = np.diag([handedness * spacing[0], spacing[1], spacing[2], 1.0])
    affine[:3, 3] = -affine[:3, :3] @ ((size - 1) / 2)
    kji = np.stack(np.meshgrid(*map(np.arange, size[::-1]), indexing="ij"), -1)
    x = kji[..., ::-1] @ affine[:3, :3].T + affine[:3, 3]
    from_head = np.linalg.norm(x - HEAD_CENTRE, axis=-1)
    head = from_head < HEAD_RADIUS
    shaft = (
        (np.linalg.norm((x - HEAD_CENTRE)[..., :2], axis=-1) < 12) & (x[..., 2] < -25) & (x[..., 2] > -110)
    )
    socket = (from_head > HEAD_RADIUS + 3) & (from_head < HEAD_RADIUS + 14) & (x[..., 2] > HEAD_CENTRE[2])
    sacrum = (np.abs(x[..., 0]) < 18) & (np.abs(x[..., 1]) < 18) & (np.abs(x[..., 2] + 10) < 25)
    disc = [(np.hypot(x[..., 0], x[..., 1]) < 18) & (np.abs(x[..., 2] - z) < 12) for z in (35, 65)]
    labels = np.zeros(x.shape[:3], np.int16)
    for number, mask in enumerate((sacrum | socket, head | shaft, *disc), start=1):
        labels[mask & (labels == 0)] = number
    body = (np.abs(x[..., 0]) < 85) & (np.abs(x[..., 1]) < 55)
    hu = np.where(body, 30.0, -1000.0)
    hu[labels > 0] = 700
    organ = np.linalg.norm(x - [-40, 0, 40], axis=-1) < 22
    source = labels.astype(np.int16) * 10
    source[organ & (labels == 0)] = 5
    ct = Volume(hu.astype(np.float32), affine)
    return ct, Structures(NAMES, labels), Volume(source, affine)
