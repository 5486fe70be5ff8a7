"""The grid of the transform that is handed out."""

import numpy as np
import pytest

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.registration.outputs import transform_grid


@pytest.mark.parametrize(
    ("voxel", "asked", "given"),
    [(4.0, 1.0, 1.0), (3.0, 3.0, 3.0), (4.0, 3.0, 4.0), (1.0, 3.0, 3.0), (2.0, 2.0, 2.0)],
)
def test_it_is_as_fine_as_asked_for(voxel: float, asked: float, given: float) -> None:
    ct = Volume(np.zeros((20, 21, 22), np.float32), np.diag([voxel, voxel, voxel, 1.0]))
    affine, shape, aligned = transform_grid(ct, asked)
    np.testing.assert_allclose(np.linalg.norm(affine[:3, :3], axis=0), given, rtol=0.26)
    assert aligned == (voxel == given)
    corner = affine @ [*(np.array(shape[::-1]) - 1), 1]
    assert (affine[:3, 3] <= 0).all() and (corner[:3] >= np.array(ct.shape[::-1]) * voxel - voxel).all()
