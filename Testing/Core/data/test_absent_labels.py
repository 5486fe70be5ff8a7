"""One list of structures for many patients: what a segmentation lacks is said, and only the anchor must be there."""

import numpy as np
import pytest

from PolyPoseLib.data.segmentation import Segment, Segmentation
from PolyPoseLib.data.structures import build_structures
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError

SHAPE = (8, 9, 10)


def slabs() -> Volume:
    """Labels 1 to 4, two slices of each."""
    return Volume(
        np.repeat(np.arange(1, 5, dtype=np.uint8), 2)[:, None, None] * np.ones(SHAPE, np.uint8), np.eye(4)
    )


CT = Volume(np.zeros(SHAPE, np.float32), np.eye(4))
PLAIN = Segmentation.from_labels(slabs())


@pytest.mark.parametrize("anchor", [None, "a"])
def test_structures_are_made_of_the_labels_that_are_there(anchor):
    found, warnings = build_structures(PLAIN, {"a": [1, 7, 2], "b": [3]}, CT, anchor=anchor)
    assert found.names == ("a", "b")
    assert np.array_equal(found.mask("a"), np.isin(slabs().voxels, [1, 2]))
    assert len(warnings) == 1
    assert '"a"' in warnings[0]
    assert "7" in warnings[0]


def test_what_is_wholly_absent_is_left_out_and_the_others_keep_their_voxels():
    found, warnings = build_structures(PLAIN, {"x": [8, 9], "a": [1], "y": [7], "b": [4]}, CT, anchor="b")
    assert found.names == ("a", "b")
    assert np.array_equal(found.mask("b"), slabs().voxels == 4)
    assert ["left out" in each for each in warnings] == [True, True]


@pytest.mark.parametrize("groups", [{"a": [8], "b": [3]}, {"a": [8, 9], "b": [9]}])
def test_the_anchor_must_be_there(groups):
    with pytest.raises(InputError, match=r'label \d of structure "a" is not in the image'):
        build_structures(PLAIN, groups, CT, anchor="a")


def test_nothing_left_is_refused():
    with pytest.raises(InputError, match="not in the image"):
        build_structures(PLAIN, {"a": [8], "b": [9]}, CT)


def test_bones_outside_the_ct_are_left_out_but_not_the_anchor():
    short = Volume(CT.voxels[:4], np.eye(4))
    found, warnings = build_structures(PLAIN, {"a": [1], "b": [4], "c": [2]}, short, anchor="a")
    assert found.names == ("a", "c")
    assert np.array_equal(found.mask("c"), slabs().voxels[:4] == 2)
    assert any('"b" lies outside the CT' in each for each in warnings)
    with pytest.raises(InputError, match='"b" lies outside the CT'):
        build_structures(PLAIN, {"a": [1], "b": [4]}, short, anchor="b")


def test_absent_segments_of_bones_differ_from_misspelt_names():
    segments = (
        Segment("S1", "femur_left", 0, 1),
        Segment("S2", "hip_left", 0, 2),
        Segment("S3", "empty", 0, 9),
    )
    named = Segmentation((slabs(),), segments)
    groups = {
        "p": ["hip_left"],
        "f": ["femur_left", "femur_right"],
        "e": ["empty"],
        "spine": ["vertebrae_L5"],
    }
    found, warnings = build_structures(named, groups, CT, anchor="p")
    assert found.names == ("p", "f")
    assert len(warnings) == 3
    with pytest.raises(InputError, match='did you mean "femur_left"'):
        build_structures(named, {"p": ["hip_left"], "f": ["femr_left"]}, CT, anchor="p")


def test_names_of_a_table_may_be_absent():
    found, warnings = build_structures(
        Segmentation.from_labels(Volume(slabs().voxels + np.uint8(74), np.eye(4))),
        {"f": ["femur_left", "femur_right"], "s": ["sacrum"]}, CT, "totalsegmentator_v2", "f",
    )  # fmt: skip
    assert found.names == ("f",)
    assert len(warnings) == 1
    assert "sacrum" in warnings[0]
