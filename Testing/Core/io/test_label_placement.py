"""A segmentation whose file lost the CT's place: the sentence says that it fits voxel by voxel."""

import numpy as np
import pytest

from PolyPoseLib.data.segmentation import Segmentation
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.label_placement import checked_structures

SHAPE = (20, 24, 28)
AFFINE = np.array([[2.0, 0, 0, -30], [0, 2, 0, 10], [0, 0, 3, 400], [0, 0, 0, 1]])


def case() -> tuple[Volume, np.ndarray]:
    labels = np.zeros(SHAPE, np.uint8)
    labels[3:15, 6:11, 4:9], labels[5:12, 13:19, 16:20] = 1, 2
    return Volume(np.where(labels > 0, 700, 40).astype(np.float32), AFFINE), labels


@pytest.mark.parametrize(
    "affine", [np.eye(4), np.diag([2.0, 2, 3, 1]), AFFINE + 36 * np.eye(4, 4, 3), AFFINE @ np.diag([-1.0, 1, 1, 1])]
)  # fmt: skip
def test_labels_whose_place_was_lost_are_refused(affine):
    ct, labels = case()
    lost = Segmentation.from_labels(Volume(labels, affine))
    with pytest.raises(InputError, match="voxel by voxel"):
        checked_structures(lost, {"a": [1], "b": [2]}, ct, None, "a")


def test_labels_in_their_place_are_taken():
    ct, labels = case()
    found, warnings = checked_structures(
        Segmentation.from_labels(Volume(labels, AFFINE)), {"a": [1], "b": [2]}, ct, None, "a"
    )
    assert np.array_equal(found.labels, labels)
    assert not warnings


def test_labels_of_another_scan_are_refused_as_before():
    ct, labels = case()
    other = Segmentation.from_labels(Volume(np.roll(labels, 9, 2), np.eye(4)))
    with pytest.raises(InputError, match="outside the CT"):
        checked_structures(other, {"a": [1], "b": [2]}, ct, None, "a")
