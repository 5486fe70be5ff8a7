"""Doubtful bones say why, in words; the others say nothing."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from PolyPoseLib.registration.bones.agreement import Agreement, PartAgreement
from PolyPoseLib.registration.bones.rows import Break
from PolyPoseLib.registration.bones.visibility import Visibility
from PolyPoseLib.registration.uncertainty.covariance import PoseUncertainty
from PolyPoseLib.registration.uncertainty.doubts import (
    VAGUE_MM,
    WIDE_MM,
    WIDE_POINTS_MM,
    Evidence,
    disputed_warnings,
    doubts_about,
    reasons_against_most,
    united_warnings,
    unseen_warnings,
)
from PolyPoseLib.registration.uncertainty.widths import Widths

SCENE = SimpleNamespace(names=("pelvis", "femur", "spine"), anchor=0, moving=[1, 2])
NARROW, WIDE = (PoseUncertainty.independent(1.0, mm) for mm in (0.5 * WIDE_MM / 1.96, 1.5 * WIDE_MM / 1.96))
FEMUR, SPINE = 1, 2


def evidence(**changes) -> Evidence:
    """Of three bones that two X-rays show where they are."""
    arrays = {
        name: np.full((3, 2), value)
        for name, value in (
            ("residuals", 0.05),
            ("support", 0.8),
            ("contrast", 0.2),
            ("shown_share", 0.7),
            ("outside", 0.0),
            ("hidden", 0.0),
            ("clipped", 0.0),
        )
    }
    for name, places in changes.pop("at", {}).items():
        for (k, n), value in places.items():
            arrays[name][k, n] = value
    uncertainties = changes.pop("uncertainties", {FEMUR: NARROW, SPINE: NARROW})
    return Evidence(
        ["X-ray 1", "LAT"],
        Agreement(*(arrays[name] for name in ("residuals", "support", "contrast", "shown_share"))),
        Visibility(arrays["outside"], arrays["hidden"], arrays["clipped"]),
        uncertainties,
        {
            k: Widths(changes.get("points_mm", 1.0), changes.get("across_mm", {}).get(k, 1.0))
            for k in uncertainties
        },
        changes.pop("distorted", [False, False]),
        **{name: value for name, value in changes.items() if name not in ("across_mm", "points_mm")},
    )


def test_nothing_is_said_of_bones_that_are_well_seen():
    quiet = evidence(at={"outside": {(FEMUR, 0): 0.9}, "hidden": {(SPINE, 1): 0.9}})
    assert doubts_about(SCENE, quiet) == {} and disputed_warnings(SCENE, quiet) == []


@pytest.mark.parametrize(
    ("at", "words"),
    [
        ({"hidden": {(FEMUR, 1): 0.4}}, 'metal or an instrument hides 40% of it in X-ray "LAT"'),
        ({"clipped": {(FEMUR, 0): 0.5}}, "50% of it is all black or all white in X-ray 1"),
        ({"outside": {(FEMUR, 0): 0.6}}, "60% of it lies beside the picture of X-ray 1"),
        (
            {
                "contrast": {(FEMUR, 0): np.nan},
                "residuals": {(FEMUR, 0): np.nan},
                "support": {(FEMUR, 0): np.nan},
            },
            'only X-ray "LAT" shows it',
        ),
        ({"contrast": {(FEMUR, 0): 0.01, (FEMUR, 1): 0.01}}, "it stands out little from the soft tissue"),
        ({}, "the X-rays determine its pose weakly"),
        ({"support": {(FEMUR, 0): 0.4, (FEMUR, 1): 0.3}}, "no X-ray shows it clearly"),
    ],
)
def test_a_wide_interval_has_its_cause(at, words):
    assert doubts_about(SCENE, evidence(at=at, uncertainties={FEMUR: WIDE, SPINE: NARROW})) == {
        FEMUR: (words,)
    }


def test_a_bone_that_may_be_turned_anyhow_is_doubted():
    assert doubts_about(SCENE, evidence(points_mm=0.9 * WIDE_POINTS_MM)) == {}
    found = doubts_about(SCENE, evidence(points_mm=1.1 * WIDE_POINTS_MM))
    assert found == dict.fromkeys((FEMUR, SPINE), ("the X-rays determine its pose weakly",))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"at": {"support": {(FEMUR, 0): 0.4, (FEMUR, 1): 0.3}}}, "no X-ray shows it clearly"),
        (
            {"at": {"hidden": {(FEMUR, 0): 0.6, (FEMUR, 1): 0.6}}},
            'metal or an instrument hides 60% of it in X-ray 1',
        ),
        (
            {"breaks": [Break((FEMUR,), FEMUR, SPINE, 12.0)]},
            'it has moved 12 mm against "spine" beside it',
        ),
    ],
)  # fmt: skip
def test_what_is_known_without_intervals_is_said_without_them(changes, words):
    assert doubts_about(SCENE, evidence(uncertainties={})) == {}
    found = doubts_about(SCENE, evidence(uncertainties={}, **changes))
    assert list(found) == [FEMUR] and words in found[FEMUR]


@pytest.mark.parametrize("magnification", [1.0, 4.0, 8.0])
def test_another_place_is_told_in_the_patients_millimetres(magnification):
    rival = PoseUncertainty(WIDE.covariance, rival_mm=12.0)  # 1.5 mm at the largest
    (doubts,) = doubts_about(
        SCENE, evidence(uncertainties={FEMUR: rival}, magnification=magnification)
    ).values()
    assert doubts == (f"another place, {12 / magnification:g} mm away, fits the X-rays as well",)


def test_an_inconsistent_bone_names_the_x_ray_and_the_cause():
    at = {
        "residuals": {(FEMUR, 1): 0.5},
        "support": {(FEMUR, 0): 0.2, (FEMUR, 1): 0.2},
        "hidden": {(FEMUR, 1): 0.3},
    }
    doubts = doubts_about(SCENE, evidence(at=at))[FEMUR]
    assert doubts[0] == 'its rendering does not match X-ray "LAT"' and "hides 30%" in doubts[1]
    assert doubts[2] == "no X-ray shows it clearly"


def unseen(*which, share: float = np.nan) -> dict:
    """Bones that no X-ray shows, and the share of them that would stand out, not a number beside the pictures."""
    nothing = {(k, n): np.nan for k in which for n in (0, 1)}
    shares = {(k, 0): share for k in which} | {(k, 1): np.nan for k in which}
    return {"residuals": nothing, "support": nothing, "contrast": nothing, "shown_share": shares}


@pytest.mark.parametrize(
    ("share", "says", "warning"),
    [
        (np.nan, "it shows in no X-ray", "shows in no X-ray"),
        (0.7, "it shows in no X-ray", "shows in no X-ray"),
        (0.1, "it hardly stands out in the X-rays, as marrow without its cortex", "covers the whole bone"),
    ],
)
def test_a_bone_that_no_x_ray_shows_says_whether_its_label_is_one_of_marrow(share, says, warning):
    found = evidence(at=unseen(SPINE, share=share))
    assert doubts_about(SCENE, found) == {SPINE: (says,)}
    (line,) = unseen_warnings(SCENE, found)
    assert '"spine"' in line and warning in line
    assert unseen_warnings(SCENE, evidence()) == []


def test_a_bone_of_which_little_stands_out_is_doubted_though_it_can_be_compared():
    little = {(SPINE, n): 0.3 for n in (0, 1)}
    found = evidence(at={"shown_share": little})
    assert doubts_about(SCENE, found) == {
        SPINE: ("it hardly stands out in the X-rays, as marrow without its cortex",)
    }
    assert len(unseen_warnings(SCENE, found)) == 1


def test_most_bones_that_do_not_stand_out_are_a_reason_for_distrust():
    assert reasons_against_most(SCENE, evidence()) == []
    assert reasons_against_most(SCENE, evidence(at=unseen(SPINE, share=0.1))) == []
    (reason,) = reasons_against_most(SCENE, evidence(at=unseen(FEMUR, SPINE, share=0.1)))
    assert "hardly show 2 of 2 structures that lie in them" in reason and "whole bone" in reason


def against(*which) -> dict:
    """Bones that the first X-ray contradicts."""
    return {
        "residuals": {(k, 0): 0.5 for k in which},
        "support": {(k, n): 0.2 for k in which for n in (0, 1)},
    }


def test_bones_beside_every_picture_do_not_count_for_distrust():
    assert reasons_against_most(SCENE, evidence(at=unseen(SPINE))) == []
    assert reasons_against_most(SCENE, evidence(at=against(FEMUR))) == []
    beside, wrong = unseen(SPINE), against(FEMUR)
    at = {name: {**beside[name], **wrong.get(name, {})} for name in beside}
    (reason,) = reasons_against_most(SCENE, evidence(at=at))
    assert "contradict the pose of the only structure that may move and that they show" in reason


@pytest.mark.parametrize("support", [0.46, 0.2])
def test_bones_that_are_only_unclear_are_no_reason_for_distrust(support):
    """Noise alone brings the support of right bones there."""
    low = {(k, n): support for k in (FEMUR, SPINE) for n in (0, 1)}
    assert reasons_against_most(SCENE, evidence(at={"support": low})) == []


def test_most_bones_contradicted_are_a_reason_for_distrust():
    (reason,) = reasons_against_most(SCENE, evidence(at=against(FEMUR, SPINE)))
    assert "contradict the poses of 2 of 2 structures: check the cameras" in reason
    faint, wrong = unseen(SPINE, share=0.1), against(FEMUR)
    at = {name: {**faint[name], **wrong.get(name, {})} for name in faint}
    (reason,) = reasons_against_most(SCENE, evidence(at=at))
    assert "contradict the poses of 1 of 2 structures and hardly show 1 of 2" in reason


@pytest.mark.parametrize("magnification", [1.0, 4.0])
def test_most_bones_that_are_hardly_placed_are_a_reason_for_distrust(magnification):
    """Along the beam alone they may be as uncertain as one X-ray leaves them."""
    along = PoseUncertainty.shift_along(np.array([0.0, 1.0, 0.0]), 20.0)
    assert reasons_against_most(SCENE, evidence(uncertainties={FEMUR: along, SPINE: along})) == []
    one = {FEMUR: 2.0 * VAGUE_MM, SPINE: 0.9 * VAGUE_MM}
    assert reasons_against_most(SCENE, evidence(across_mm=one)) == []
    both = dict.fromkeys(one, 1.1 * VAGUE_MM)
    (reason,) = reasons_against_most(SCENE, evidence(across_mm=both, magnification=magnification))
    within = "11 mm across the beam" if magnification == 1 else "2.8 mm across the beam"
    assert f"leave 2 of 2 structures uncertain by more than {within}" in reason
    assert "sharp, well exposed" in reason and "whole bone" in reason


def test_bones_hardly_placed_and_contradicted_count_together_but_once():
    (reason,) = reasons_against_most(SCENE, evidence(at=against(FEMUR), across_mm={SPINE: 2.0 * VAGUE_MM}))
    assert "contradict the poses of 1 of 2 structures and leave 1 of 2 structures uncertain" in reason
    twice = evidence(at=against(FEMUR), across_mm={FEMUR: 2.0 * VAGUE_MM})
    assert reasons_against_most(SCENE, twice) == []
    beside = evidence(at=unseen(SPINE), across_mm={SPINE: 9.0 * VAGUE_MM})
    assert reasons_against_most(SCENE, beside) == []


def parts(*off: tuple[int | None, float]) -> list[PartAgreement]:
    """A bone that is where it should be, and others, by label, that an X-ray shows so far from there, mm."""
    clear, unclear, better = np.array([0.8, 0.8]), np.array([0.2, 0.3]), np.array([0.4, 0.4])
    right = PartAgreement(None if off[0][0] is None else 1, clear, clear, np.zeros(2))
    return [
        right,
        *(PartAgreement(n, unclear, clear if mm else better, np.array([1.0, mm or 5.0])) for n, mm in off),
    ]


@pytest.mark.parametrize("magnification", [1.0, 4.0])
@pytest.mark.parametrize(
    ("off", "words"),
    [
        ([(7, 8.0)], 'the X-rays show "tibia" {} mm or more from where the structure\'s pose puts it'),
        ([(9, 0.0)], "no X-ray shows label 9 where the structure's pose puts it"),
        (
            [(7, 8.0), (9, 0.0)],
            'the X-rays show "tibia" {} mm or more from where the structure\'s pose puts it, and '
            "no X-ray shows label 9 where the structure's pose puts it",
        ),
        (
            [(9, 12.0), (7, 8.0), (8, 20.0)],
            'the X-rays show "tibia", label 8 and label 9 {} mm or more from where the structure\'s pose puts them',
        ),
        (
            [(None, 8.0)],
            "the X-rays show one of its 2 separate parts {} mm or more from where the structure's pose puts it",
        ),
    ],
)
@pytest.mark.parametrize("k", [0, FEMUR])
def test_bones_united_in_a_structure_that_moved_apart_are_named(k, off, words, magnification):
    found = evidence(magnification=magnification, label_names={7: "tibia"})
    found = replace(found, agreement=replace(found.agreement, parts={k: parts(*off)}))
    words = words.format(f"{8 / magnification:.0f}")
    if k == 0:
        words = words.replace("the structure's pose puts", "the CT has")
    assert doubts_about(SCENE, found) == {k: (words,)}
    (warning,) = united_warnings(SCENE, found)
    assert warning.startswith(f'"{SCENE.names[k]}" seems to unite') and words in warning


def test_a_structure_whose_bones_are_where_they_should_be_is_not_named():
    found = evidence()
    clear = np.array([0.8, 0.8])
    together = [PartAgreement(n, clear, clear, np.full(2, 0.5)) for n in (1, 2)]
    found = replace(found, agreement=replace(found.agreement, parts={FEMUR: together}))
    assert doubts_about(SCENE, found) == {} and united_warnings(SCENE, found) == []


def test_the_only_large_part_of_a_structure_has_no_number():
    off = PartAgreement(None, np.array([0.2, 0.3]), np.array([0.8, 0.8]), np.array([1.0, 8.0]))
    found = evidence()
    found = replace(found, agreement=replace(found.agreement, parts={FEMUR: [off]}))
    (warning,) = united_warnings(SCENE, found)
    assert "the X-rays show its largest part 8 mm or more from where the structure's pose puts it" in warning


def test_a_disputed_bone_is_no_flag_but_a_warning():
    at = {"residuals": {(SPINE, 0): 0.5}, "support": {(SPINE, 0): 0.2}}
    disputed = evidence(at=at)
    (warning,) = disputed_warnings(SCENE, disputed)
    assert 'covers or changes "spine" in X-ray 1' in warning and 'rests mostly on X-ray "LAT"' in warning
    assert doubts_about(SCENE, disputed) == {}


def test_distortion_is_a_cause_of_wide_intervals_only():
    distorted = evidence(uncertainties={FEMUR: WIDE, SPINE: NARROW}, distorted=[True, False])
    assert doubts_about(SCENE, distorted) == {FEMUR: ("distortion may be left in X-ray 1",)}


def test_a_bone_out_of_its_row_says_from_which_one_it_came_apart():
    apart = [Break((FEMUR,), FEMUR, SPINE, 12.0)]
    found = doubts_about(SCENE, evidence(uncertainties={FEMUR: WIDE, SPINE: NARROW}, breaks=apart))
    assert found == {FEMUR: ('it has moved 12 mm against "spine" beside it',)}
    together = [Break((0, FEMUR), FEMUR, SPINE, 12.0)]
    found = doubts_about(
        SCENE, evidence(uncertainties={FEMUR: WIDE, SPINE: NARROW}, breaks=together, magnification=2.0)
    )
    assert found == {FEMUR: ('it and "pelvis" have moved 6 mm against "spine" beside it',)}
