"""A skull, and a shaft that leaves the CT at its lower end, drawn in two postures on grids of one world."""

import numpy as np
from two_postures import SKULL, labels_at, moved, rigid

from PolyPoseLib.data.benchmark.system import Motion
from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.volume import Volume

SHAFT = 75
TOP = -22.0
"""mm: the upper end of the shaft."""

LOWEST = -90.0
"""mm: the first slice of the CT, whose lower side lies half a voxel below."""

SPACING = 2.0
GROUPS = {"skull": (SKULL,), "femur_left": (SHAFT,)}
REST = np.eye(4)
UP, DOWN, ASIDE = (rigid((0, 0, 1), 0.0, each) for each in ((0, 0, 8.0), (0, 0, -8.0), (20.0, 0, 0)))
TURNED = rigid((1, 0.4, 0), 9.0, (5.0, 0, -6.0), (0, 0, TOP))


def labels_in(motion=REST, lowest=LOWEST, top=TOP):
    """Labels of the shaft after a motion from the first scan's posture, on a grid that begins at a height."""
    affine = np.diag([SPACING] * 3 + [1.0])
    affine[:3, 3] = (-50, -58, lowest)
    k, j, i = np.indices((int((86 - lowest) / SPACING), 58, 51))
    points = np.stack([i, j, k], axis=-1) @ affine[:3, :3].T + affine[:3, 3]
    labels = np.where(labels_at(points, False) == SKULL, SKULL, 0).astype(np.uint8)
    at_rest = moved(np.linalg.inv(motion), points)
    labels[(np.hypot(at_rest[..., 0], at_rest[..., 1]) < 12) & (at_rest[..., 2] < top)] = SHAFT
    return Volume(labels, affine)


def answer(motion):
    """The exact field, fixed to moving, of a shaft that moves below a skull that does not."""
    affine = np.diag([2.0, 2.0, 2.0, 1.0])
    affine[:3, 3] = (-60, -66, -160)
    k, j, i = np.indices((126, 66, 61))
    points = np.stack([i, j, k], axis=-1) @ affine[:3, :3].T + affine[:3, 3]
    vectors = np.where(points[..., 2:] < -8, moved(np.linalg.inv(motion), points) - points, 0)
    return Motion(DisplacementField(vectors.astype(np.float32), affine))
