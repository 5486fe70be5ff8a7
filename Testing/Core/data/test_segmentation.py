"""What a segmentation knows of its labels."""

import numpy as np

from PolyPoseLib.data.segmentation import Segment, Segmentation
from PolyPoseLib.data.volume import Volume


def test_labels_are_named_by_segments_of_the_first_layer_and_numbers_by_a_table():
    volumes = (Volume(np.ones((2, 3, 4), np.int16), np.eye(4)),) * 2
    segments = (Segment("Segment_1", "femur", 0, 1), Segment("Segment_2", "plate", 1, 1))
    table = {25: "sacrum"}
    assert Segmentation(volumes, segments).label_names(table) == {1: "femur", 25: "sacrum"}
    assert Segmentation(volumes, segments).label_names({1: "spleen"}) == {1: "spleen"}
    assert Segmentation(volumes, segments, numbered=False).label_names({1: "spleen"}) == {1: "femur"}
    assert Segmentation.from_labels(volumes[0]).label_names(table) == table
