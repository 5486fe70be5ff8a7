"""What a segmentation knows of its labels."""

import numpy as np

from PolyPoseLib.data.label_names import label_table
from PolyPoseLib.data.segmentation import Segment, Segmentation
from PolyPoseLib.data.volume import Volume


def test_labels_are_named_by_segments_of_the_first_layer_and_numbers_by_a_table():
    volumes = (Volume(np.ones((2, 3, 4), np.int16), np.eye(4)),) * 2
    segments = (Segment("Segment_1", "femur", 0, 1), Segment("Segment_2", "plate", 1, 1))
    table = label_table("totalsegmentator_v2")
    assert Segmentation(volumes, segments).label_names() == {1: "femur"}
    assert Segmentation(volumes, segments).label_names("totalsegmentator_v2") == table
    assert Segmentation(volumes, segments, numbered=False).label_names("totalsegmentator_v2") == {1: "femur"}
    far = (Segment("Segment_1", "screw", 0, 4000),)
    assert Segmentation(volumes, far).label_names("totalsegmentator_v2") == {4000: "screw", **table}
    assert Segmentation.from_labels(volumes[0]).label_names("totalsegmentator_v2") == table
    assert Segmentation.from_labels(volumes[0]).label_names() == {}
