"""A result of two bones in soft tissue, made without the library's warp: carried points have a simple truth."""

import numpy as np
from result_case import make_result, random_pose
from scipy.ndimage import gaussian_filter

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.result import Result, StructureResult
from PolyPoseLib.data.volume import Volume

COVARIANCE = np.diag([2e-4, 1e-4, 3e-4, 0.2, 0.3, 0.9])
"""Of the femur's pose."""


def carried_result(seed=0) -> Result:
    """A pelvis that stays, a femur that moves by some degrees and mm, and a smooth field of a few mm between them."""
    rng = np.random.default_rng(seed)
    affine = np.array([[2, 0, 0, -50], [0, -2, 0, 60], [0, 0, 2.5, -40], [0, 0, 0, 1.0]])
    labels = np.zeros((40, 50, 60), np.int16)
    labels[5:15, 10:30, 10:50] = 1
    labels[22:36, 15:30, 12:24] = 2
    ct = Volume(labels, affine)
    vectors = gaussian_filter(rng.normal(size=(30, 30, 34, 3)), (4, 4, 4, 0)) * 120
    grid = np.array([[4, 0, 0, -56], [0, -4, 0, 66], [0, 0, 4, -48], [0, 0, 0, 1.0]])
    centre = ct.to_world(np.argwhere(labels == 2)[:, ::-1]).mean(axis=0)
    made = make_result(seed)
    made.structures = {
        "pelvis": StructureResult.from_pose(np.eye(4), np.zeros(3)),
        "femur": StructureResult.from_pose(
            random_pose(rng, 6, 3), centre, {"covariance": COVARIANCE.tolist()}
        ),
    }
    made.transform = DisplacementField(vectors.astype(np.float32), grid)
    made.structure_labels = ct
    made.inverse_transform = made.soft_tissue_deviation_mm = None
    made.warped_ct = ct.with_voxels((1000 * (labels > 0) - 900).astype(np.float32))
    return made
