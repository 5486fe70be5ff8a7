"""Doubtful bones say why, in words; the others say nothing."""

from types import SimpleNamespace

import numpy as np
import pytest

from PolyPoseLib.registration.bones.agreement import Agreement
from PolyPoseLib.registration.bones.rows import Break
from PolyPoseLib.registration.bones.visibility import Visibility
from PolyPoseLib.registration.uncertainty.covariance import PoseUncertainty
from PolyPoseLib.registration.uncertainty.doubts import WIDE_MM, Evidence, disputed_warnings, doubts_about

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


def test_a_bone_that_no_x_ray_shows_says_so():
    nothing = {(SPINE, n): np.nan for n in (0, 1)}
    at = {"residuals": nothing, "support": nothing, "contrast": nothing}
    assert doubts_about(SCENE, evidence(at=at)) == {SPINE: ("it shows in no X-ray",)}


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
