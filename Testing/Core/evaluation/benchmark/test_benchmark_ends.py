"""Planes beyond which nothing is scored, against points told one by one."""

import dataclasses

import numpy as np
import pytest
import scored_case

from PolyPoseLib.data.benchmark.system import Motion
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.evaluation.benchmark.ends import before_ends, labels_before_ends
from PolyPoseLib.evaluation.benchmark.scores import score_case

PLANES = np.array([[0.6, 0.0, 0.8, 5.0], [0.0, -1.0, 0.0, 7.0]])


@pytest.mark.parametrize("left_handed", [False, True])
def test_voxels_beyond_a_plane_are_left_out(left_handed):
    affine, shape = scored_case.oblique(left_handed=left_handed)
    mask = Volume(np.random.default_rng(0).random(shape) < 0.5, affine)
    points = scored_case.world_points(affine, shape)
    inside = np.logical_and.reduce([points @ plane[:3] <= plane[3] for plane in PLANES])
    assert np.array_equal(before_ends(mask, PLANES).voxels, mask.voxels & inside)
    assert before_ends(mask, None) is mask


def test_labels_end_where_their_own_structure_does():
    affine, shape = scored_case.oblique()
    points = scored_case.world_points(affine, shape)
    labels = Volume(scored_case.labels_at(points), affine)
    kept = labels_before_ends(labels, {"femur": (3,), "pelvis": (7,)}, {"femur": PLANES[:1]})
    beyond = points @ PLANES[0, :3] > PLANES[0, 3]
    expected = np.where((labels.voxels == 3) & beyond, 0, labels.voxels)
    assert np.array_equal(kept.voxels, expected) and (expected != labels.voxels).any()


def test_truth_and_answer_end_alike_in_3d_and_in_2d():
    """A motion that is wrong beyond the plane alone is right."""
    case = scored_case.drawn_case(np.eye(4))
    planes = np.array([[0.0, 0.0, 1.0, 12.0]])  # the femur's upper half is not scored
    labels = labels_before_ends(case.truth.labels, case.labels, {"femur": planes})
    held_out = tuple(
        dataclasses.replace(
            view,
            masks={
                name: scored_case.exact_mask(labels.voxels, labels.affine, numbers[0], view.camera)
                for name, numbers in case.labels.items()
            },
        )
        for view in case.truth.held_out
    )
    ended = dataclasses.replace(
        case,
        truth=dataclasses.replace(case.truth, labels=labels, held_out=held_out, ends={"femur": planes}),
    )
    field = scored_case.field_of(np.eye(4))
    wrong = np.where(scored_case.world_points(field.affine, field.shape)[..., 2:] > 14.5, 40.0, 0)
    answer = Motion(dataclasses.replace(field, vectors=field.vectors + wrong * [1.0, 0, 0]))
    scores = score_case(ended, answer, minimum_mm2=20)
    of_whole = score_case(case, answer, minimum_mm2=20)
    femur = scores["structures"]["femur"]
    assert femur["dice"] > 0.9 > of_whole["structures"]["femur"]["dice"] + 0.1
    assert femur["trimmed"] and not of_whole["structures"]["femur"]["trimmed"]
    flat, whole = (each["held_out"]["structures"]["femur"] for each in (scores, of_whole))
    assert flat["dice"] > 0.9 > whole["dice"] + 0.1
