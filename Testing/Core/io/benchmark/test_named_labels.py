"""Label maps whose numbers may be of TotalSegmentator's release 1, read as release 2's."""

import numpy as np
import pytest
from two_postures import write_image

from PolyPoseLib.data.label_names import label_table
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.io.benchmark.named_labels import read_named_labels

NECK = (
    "vertebrae_C",
    "vertebrae_T1",
    "vertebrae_T2",
    "rib_left_1",
    "rib_right_1",
    "clavicula",
    "scapula",
    "brain",
)
REGIONS = {
    "neck": (*NECK, "face", "skull", "trachea"),
    "head": ("vertebrae_C", "brain", "face", "skull", "trachea", "esophagus"),
    "chest": ("vertebrae_T", "rib_", "clavicula", "scapula", "humerus", "lung", "heart", "aorta", "sternum"),
    "trunk": (
        "vertebrae_T",
        "vertebrae_L",
        "rib_",
        "sacrum",
        "hip",
        "femur",
        "gluteus",
        "scapula",
        "clavicula",
    ),
    "pelvis": ("vertebrae_L", "sacrum", "hip", "femur", "gluteus", "colon"),
}


def _warnings(tmp_path, table, beginnings):
    """Those of a plain map with the table's numbers of these structures."""
    numbers = [number for number, name in label_table(table).items() if name.startswith(beginnings)]
    voxels = np.zeros((12, 12, 12), np.uint8)
    voxels.reshape(-1)[: len(numbers)] = numbers
    write_image(voxels, np.eye(4), tmp_path / "labels_1.nii.gz")
    ct = Volume(np.zeros(voxels.shape, np.float32), np.eye(4))
    return read_named_labels(tmp_path / "labels_1.nii.gz", ct).warnings


@pytest.mark.parametrize("region", [name for name in REGIONS if name != "pelvis"])
def test_numbers_of_release_1_are_warned_of(region, tmp_path):
    """Its 27, a thoracic vertebra, became the fifth lumbar one without a word."""
    (told,) = _warnings(tmp_path, "totalsegmentator_v1", REGIONS[region])
    assert "labels_1.nii.gz" in told and "release 1" in told and "named mask" in told


@pytest.mark.parametrize("region", REGIONS)
def test_numbers_of_release_2_are_not(region, tmp_path):
    assert _warnings(tmp_path, "totalsegmentator_v2", REGIONS[region]) == ()
