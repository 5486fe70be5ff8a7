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
    WIDE_MM,
    Evidence,
    disputed_warnings,
    doubts_about,
    reasons_against_most,
    united_warnings,
    unseen_warnings,
)

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
        Agreement(arrays["residuals"], arrays["support"], arrays["contrast"]),
        Visibility(arrays["outside"], arrays["hidden"], arrays["clipped"]),
        uncertainties,
        changes.pop("distorted", [False, False]),
        **changes,
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


@pytest.mark.parametrize("magnification", [1.0, 4.0])
def test_another_place_is_told_in_the_patients_millimetres(magnification):
    rival = PoseUncertainty(WIDE.covariance, rival_mm=12.0)
    (doubts,) = doubts_about(
        SCENE, evidence(uncertainties={FEMUR: rival}, magnification=magnification)
    ).values()
    assert doubts == (f"another place, {12 / magnification:.0f} mm away, fits the X-rays as well",)


def test_an_inconsistent_bone_names_the_x_ray_and_the_cause():
    at = {
        "residuals": {(FEMUR, 1): 0.5},
        "support": {(FEMUR, 0): 0.2, (FEMUR, 1): 0.2},
        "hidden": {(FEMUR, 1): 0.3},
    }
    doubts = doubts_about(SCENE, evidence(at=at))[FEMUR]
    assert doubts[0] == 'its rendering does not match X-ray "LAT"' and "hides 30%" in doubts[1]
    assert doubts[2] == "no X-ray shows it clearly"


def unseen(*which) -> dict:
    """Bones that no X-ray shows."""
    nothing = {(k, n): np.nan for k in which for n in (0, 1)}
    return {"residuals": nothing, "support": nothing, "contrast": nothing}


@pytest.mark.parametrize(
    ("beside", "says"),
    [
        ({"outside": {(SPINE, 0): 1.0, (SPINE, 1): 0.8}}, "shows in no X-ray"),
        ({"outside": {(SPINE, 0): 1.0}, "hidden": {(SPINE, 1): 0.9}}, "shows in no X-ray"),
        ({"outside": {(SPINE, 0): 1.0}}, "lies in the X-rays but stands out in none"),
        ({}, "lies in the X-rays but stands out in none"),
    ],
)
def test_a_bone_that_no_x_ray_shows_says_whether_one_ought_to(beside, says):
    found = evidence(at=unseen(SPINE) | beside)
    assert doubts_about(SCENE, found) == {SPINE: (f"it {says}",)}
    (warning,) = unseen_warnings(SCENE, found)
    assert f'"spine" {says}' in warning
    assert ("whole bone" in warning) == ("stands out" in says)
    assert unseen_warnings(SCENE, evidence()) == []


def test_most_bones_that_stand_out_nowhere_are_a_reason_for_distrust():
    assert reasons_against_most(SCENE, evidence()) == []
    assert reasons_against_most(SCENE, evidence(at=unseen(SPINE))) == []
    (reason,) = reasons_against_most(SCENE, evidence(at=unseen(FEMUR, SPINE)))
    assert "poses of 2 of 2 structures, which stand out in none" in reason and "whole bone" in reason


def test_bones_beside_every_picture_do_not_count_for_distrust():
    outside = {(SPINE, n): 1.0 for n in (0, 1)}
    assert reasons_against_most(SCENE, evidence(at=unseen(SPINE) | {"outside": outside})) == []
    unclear = {(FEMUR, n): 0.2 for n in (0, 1)}
    at = unseen(SPINE) | {"outside": outside}
    (reason,) = reasons_against_most(SCENE, evidence(at=at | {"support": {**at["support"], **unclear}}))
    assert "do not bear out the pose of the only structure that may move" in reason


def test_most_bones_contradicted_are_a_reason_for_distrust():
    against = {(k, 0): 0.5 for k in (FEMUR, SPINE)}
    low = {(k, n): 0.2 for k in (FEMUR, SPINE) for n in (0, 1)}
    (reason,) = reasons_against_most(SCENE, evidence(at={"residuals": against, "support": low}))
    assert "contradict the poses of 2 of 2 structures" in reason and "check the cameras" in reason


def parts(*off: tuple[int | None, float]) -> list[PartAgreement]:
    """A bone that is where it should be, and others, by label, that an X-ray shows so far from there, mm."""
    clear, unclear = np.array([0.8, 0.8]), np.array([0.2, 0.3])
    right = PartAgreement(None if off[0][0] is None else 1, clear, clear, 0.5)
    return [
        right,
        *(PartAgreement(n, unclear, clear if mm else unclear, mm) for n, mm in off),
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
    assert doubts_about(SCENE, found) == {k: (words,)}
    (warning,) = united_warnings(SCENE, found)
    assert warning.startswith(f'"{SCENE.names[k]}" seems to unite') and words in warning


def test_a_structure_whose_bones_are_where_they_should_be_is_not_named():
    found = evidence()
    clear = np.array([0.8, 0.8])
    together = [PartAgreement(n, clear, clear, 0.5) for n in (1, 2)]
    found = replace(found, agreement=replace(found.agreement, parts={FEMUR: together}))
    assert doubts_about(SCENE, found) == {} and united_warnings(SCENE, found) == []


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
