"""Two scans of analytic solids in memory: how a bone that an end of the CT cuts off is scored."""

import numpy as np
import pytest
from cut_shaft import DOWN, GROUPS, LOWEST, REST, SHAFT, SPACING, TURNED, UP, answer, labels_in
from two_postures import plain_rendering

from PolyPoseLib.errors import InputError
from PolyPoseLib.evaluation.benchmark.scores import score_case
from PolyPoseLib.io.benchmark.two_scans import TwoScans, render_cases
from PolyPoseLib.io.benchmark.view_sets import view_sets

_ = plain_rendering


def case_of(motion, top, bones=("skull", "femur_left"), organs=()):
    """The case of a CT and a later scan that reaches 40 mm lower."""
    labels = labels_in(REST, top=top), labels_in(motion, LOWEST - 40, top)
    hu = [each.with_voxels(np.where(each.voxels > 0, 700, 30).astype(np.int16)) for each in labels]
    groups = [{name: GROUPS[name] for name in names} for names in (bones, organs)]
    (case,) = render_cases(TwoScans("drawn", "s1", *hu, *labels, *groups, bones[0]), view_sets(["1x0"], "x"))
    return case


@pytest.mark.parametrize(
    ("motion", "organ", "least"),
    [(UP, False, 0.97), (DOWN, False, 0.97), (TURNED, False, 0.93), (UP, True, 0.97)],
    ids=["into the CT", "out of the CT", "turned", "an organ, into the CT"],
)
def test_the_true_motion_of_what_the_ct_cuts_off_scores_one(motion, organ, least):
    """The CT's end moves with the bone: cut where it stands, the truth held a slab that no system could get right."""
    names = (("skull",), ("femur_left",)) if organ else (("skull", "femur_left"),)
    case = case_of(motion, -22.0, *names)
    true, rest = (score_case(case, answer(each), minimum_mm2=50) for each in (motion, REST))
    best, nothing = (each["structures"]["femur_left"] for each in (true, rest))
    assert best["dice"] > least and best["hd95_mm"] <= SPACING
    assert nothing["dice"] < best["dice"] - 0.05 and nothing["hd95_mm"] > 5
    assert best["trimmed"] and not best["cut_off"] and not true["structures"]["skull"]["trimmed"]
    best, nothing = (each["held_out"]["structures"]["femur_left"] for each in (true, rest))
    assert best["views"] == 5 and best["dice"] > least and best["hd95_mm"] < 4
    assert nothing["dice"] < best["dice"] - 0.03


def test_a_scrap_of_a_bone_is_not_scored():
    """Of 15 mm that are left in the CT's box, all are within reach of its end."""
    case = case_of(DOWN, -68.0)
    assert set(case.labels) == {"skull"} and case.groups == {"bones": ("skull",)}
    assert not (case.truth.labels.voxels == SHAFT).any() and not case.truth.ends


def test_a_ct_that_shows_scraps_alone_is_refused():
    with pytest.raises(InputError, match="no label in common but of what an end of the first cuts off"):
        case_of(REST, -80.0, ("femur_left",))
