"""A result against a second segmentation: only what both scans show and both label maps have is compared."""

import dataclasses
import math

import numpy as np
import pytest
from result_case import make_result

from PolyPoseLib.data.segmentation import Segmentation
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.evaluation.overlap import score_segmentation

AFFINE = np.array([[2.0, 0, 0, -40], [0, 2, 0, -30], [0, 0, 2, -50], [0, 0, 0, 1]])
BONE, ORGAN = 7, 3


def labels():
    """A long bone from end to end but for a margin, and an organ in its upper part."""
    voxels = np.zeros((50, 30, 40), np.int16)
    voxels[5:45, 10:16, 10:18] = BONE
    voxels[35:42, 10:20, 24:34] = ORGAN
    return Volume(voxels, AFFINE)


def result_of(warped, known=(ORGAN, BONE)):
    made = make_result()
    made.transform.vectors[:] = 0
    return dataclasses.replace(made, warped_labels=warped, segmentation_labels=known)


def part(volume, low):
    """The slices from one on."""
    affine = volume.affine.copy()
    affine[:3, 3] += low * affine[:3, 2]
    return Volume(volume.voxels[low:], affine)


def score(result, truth):
    return score_segmentation(result, Segmentation.from_labels(truth))


def test_a_scan_of_the_upper_half_takes_nothing_from_a_perfect_result():
    scores = score(result_of(labels()), part(labels(), 25))
    assert scores["labels"] == {
        str(ORGAN): {"dice": 1.0, "hd95_mm": 0.0, "centroid_mm": 0.0, "cut_off": False},
        str(BONE): {"dice": 1.0, "hd95_mm": 0.0, "centroid_mm": 0.0, "cut_off": True},
    }
    assert scores["summary"]["mean_dice"] == 1.0


def test_a_scan_that_goes_on_beyond_the_ct_takes_nothing_either():
    """The bone goes on below the CT, which ends within it."""
    longer = labels()
    longer.voxels[:5, 10:16, 10:18] = BONE
    scores = score(result_of(part(labels(), 20)), longer)
    assert scores["labels"][str(BONE)] == {
        "dice": 1.0, "hd95_mm": 0.0, "centroid_mm": 0.0, "cut_off": True,
    }  # fmt: skip
    assert not scores["labels"][str(ORGAN)]["cut_off"]


def test_what_is_wrong_within_the_field_of_view_counts():
    moved = Volume(np.roll(labels().voxels, 2, axis=2), AFFINE)
    scores = score(result_of(moved), part(labels(), 25))
    assert scores["labels"][str(BONE)]["dice"] == pytest.approx(6 / 8)
    assert scores["labels"][str(BONE)]["centroid_mm"] == pytest.approx(4.0)
    assert scores["labels"][str(BONE)]["hd95_mm"] == pytest.approx(4.0)


def test_another_grid_of_the_second_scan_will_do():
    affine = np.diag([-1.5, 1.5, 3.0, 1.0])
    affine[:3, 3] = 38.3, -29.2, -20.4  # no voxel lies halfway between two
    index = np.stack(np.meshgrid(*map(np.arange, (20, 36, 50)), indexing="ij"), axis=-1)
    points = index[..., ::-1] @ affine[:3, :3].T + affine[:3, 3]
    source = np.rint((points - AFFINE[:3, 3]) / 2).astype(int)
    inside = ((source >= 0) & (source < labels().shape[::-1])).all(axis=-1)
    i, j, k = np.where(inside[..., None], source, 0).transpose(3, 0, 1, 2)
    truth = Volume(np.where(inside, labels().voxels[k, j, i], 0), affine)
    scores = score(result_of(labels()), truth)
    assert all(each["dice"] > 0.99 for each in scores["labels"].values())
    assert [each["cut_off"] for each in scores["labels"].values()] == [False, True]


def test_labels_that_the_ct_never_had_are_named_and_not_scored():
    truth = labels()
    truth.voxels[10:20, 2:6, 2:6] = 9
    names = {9: "a new one", BONE: "bone"}
    for known in ((ORGAN, BONE), None):
        scores = score_segmentation(result_of(labels(), known), Segmentation.from_labels(truth), names)
        assert scores["not_in_ct"] == ["a new one"] and set(scores["labels"]) == {"bone", str(ORGAN)}
        assert scores["summary"]["mean_dice"] == 1.0


def test_labels_that_the_result_lost_count():
    """The CT has the organ, and the result carried it out of the scan."""
    warped = labels()
    warped.voxels[warped.voxels == ORGAN] = 0
    scores = score(result_of(warped), labels())
    assert scores["labels"][str(ORGAN)]["dice"] == 0 and math.isnan(scores["labels"][str(ORGAN)]["hd95_mm"])
    assert scores["summary"]["mean_dice"] == 0.5 and not scores["not_in_ct"]


def test_scans_that_show_nothing_in_common_are_refused():
    affine = AFFINE.copy()
    affine[:3, 3] += 500
    elsewhere = Volume(labels().voxels, affine)
    with pytest.raises(InputError, match="no label in common"):
        score(result_of(labels()), elsewhere)
