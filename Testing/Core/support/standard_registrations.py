"""Registrations evaluated as PS3.3 C.20.2 and C.20.3 write them, without a line of the program's."""

import numpy as np
from pydicom.dataset import Dataset


def source_to_registered(whole: Dataset, frame: str, points: np.ndarray) -> np.ndarray:
    """C.20.2.1.1: every matrix of the item of a frame of reference takes points (N, 3) on, the last listed first."""
    (item,) = [each for each in whole.RegistrationSequence if each.FrameOfReferenceUID == frame]
    (registration,) = item.MatrixRegistrationSequence
    for each in reversed(registration.MatrixSequence):
        points = _moved(each, points)
    return points


def registered_to_source(whole: Dataset, frame: str, points: np.ndarray) -> np.ndarray:
    """C.20.3.1.1: M_post (M_pre p + d(p)), d by linear interpolation between the centres of the grid's voxels."""
    (item,) = [
        each for each in whole.DeformableRegistrationSequence if each.SourceFrameOfReferenceUID == frame
    ]
    (grid,) = item.DeformableRegistrationGridSequence
    row, column = np.array(grid.ImageOrientationPatient, float).reshape(2, 3)
    axes = np.column_stack([row, column, np.cross(row, column)]) * np.array(grid.GridResolution, float)
    x, y, z = grid.GridDimensions
    vectors = np.frombuffer(grid.VectorGridData, "<f4").reshape(z, y, x, 3)
    index = np.linalg.solve(axes, (points - np.array(grid.ImagePositionPatient, float)).T).T
    assert (index >= 0).all() and (index <= np.array([x, y, z]) - 1).all(), "the point is beyond the grid"
    moved = _moved(item.PreDeformationMatrixRegistrationSequence[0], points) + _linear(vectors, index)
    return _moved(item.PostDeformationMatrixRegistrationSequence[0], moved)


def _moved(item: Dataset, points: np.ndarray) -> np.ndarray:
    matrix = np.array(item.FrameOfReferenceTransformationMatrix, float).reshape(4, 4)
    assert np.array_equal(matrix[3], [0, 0, 0, 1])
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def _linear(vectors: np.ndarray, index: np.ndarray) -> np.ndarray:
    """Values at (i, j, k) one point after another: slow and plain."""
    found = np.zeros(index.shape)
    for n, at in enumerate(index):
        low = np.minimum(np.floor(at).astype(int), np.array(vectors.shape[2::-1]) - 2)
        for corner in np.ndindex(2, 2, 2):
            i, j, k = low + corner
            weight = np.prod(np.where(corner, at - low, 1 - (at - low)))
            found[n] += weight * vectors[k, j, i]
    return found
