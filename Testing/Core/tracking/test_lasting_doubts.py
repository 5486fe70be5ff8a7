"""Doubts last as long as what causes them: frames that are flagged themselves do not tell what is ordinary."""

from copy import copy
from dataclasses import replace

import numpy as np
import pytest

from PolyPoseLib.data.tracking.track import TrackedFrame
from PolyPoseLib.geometry.rigid import about, perturbation
from PolyPoseLib.registration.uncertainty.covariance import NORMAL_95, PoseUncertainty
from PolyPoseLib.tracking import assessment, backward, sweep
from PolyPoseLib.tracking.assessment import WEAK, WIDE_MM, WORSENED, assess
from PolyPoseLib.tracking.frame_fit import FOLLOWING, Frame
from PolyPoseLib.tracking.kept import Kept

NARROW = np.eye(6) * 1e-4


@pytest.fixture(scope="module")
def of_one_camera(patient, right):
    """The fit of a frame that the first camera alone shows."""
    alone = Frame(patient, 3)
    alone.observations, alone.shown = alone.observations[:1], [0]
    return alone.fit(right, FOLLOWING, patient.moving)


def before(knee, count, doubt="", covariances=(NARROW,) * 3, residual=0.02):
    """Frames in which all structures are so."""
    lines = ((doubt,) if doubt else (),) * 3
    residuals = np.full(3, residual)
    return [
        TrackedFrame(n, knee.poses[0], np.stack(covariances), residuals, lines, ("forward",) * 3)
        for n in range(count)
    ]


@pytest.mark.parametrize("since", [0, 3, 8, 40])
def test_an_interval_stays_wide_while_a_camera_shows_nothing(patient, knee, of_one_camera, since):
    """Of two cameras, however many frames it has shown nothing for."""
    wide = assess(patient, of_one_camera, None, ()).covariances
    wide = patient.covariances_at_true_size(wide)
    frames = [*before(knee, 20), *before(knee, since, WEAK, wide)]
    assert WEAK in assess(patient, of_one_camera, None, frames).doubts[0]


@pytest.mark.parametrize("doubt", ["", WEAK])
def test_what_a_single_camera_always_leaves_open_is_no_doubt_and_more_is(
    patient, knee_sequence, knee, of_one_camera, doubt
):
    """Before a beam's intervals became four times as wide, and after it."""
    single = copy(patient)
    single.sequence = replace(knee_sequence, views=knee_sequence.views[:1])
    wide = assess(single, of_one_camera, None, ()).covariances
    wide = patient.covariances_at_true_size(wide)
    usual = before(knee, 20, covariances=wide if not doubt else wide / 16)
    found = assess(single, of_one_camera, None, [*usual, *before(knee, 40, doubt, wide)])
    assert (WEAK in found.doubts[0]) == bool(doubt)


@pytest.mark.parametrize("share", [0.95, 1.05])
def test_small_anatomy_is_held_to_the_millimetres_of_its_scene(
    patient, knee, of_one_camera, monkeypatch, share
):
    """As in a registration, where a finger's 5 mm are not those of a pelvis."""
    assert patient.factor > 1.1
    wide = PoseUncertainty.independent(1.0, share * WIDE_MM / NORMAL_95).covariance
    monkeypatch.setattr(assessment, "frame_covariances", lambda *_: dict.fromkeys(range(3), wide))
    found = assess(patient, of_one_camera, None, before(knee, 20))
    assert (WEAK in found.doubts[0]) == (share > 1)


@pytest.mark.parametrize("since", [1, 8, 40])
def test_a_match_stays_worse_than_before_the_change(patient, frame, right, knee, since):
    wrong = right.copy()
    step = perturbation(np.r_[np.zeros(3), 25.0, 10.0, 0.0])
    wrong[1] = about(step, patient.scene.centres[1]) @ wrong[1]
    fit = frame.fit(wrong, FOLLOWING[-1:], [0])
    residual = assess(patient, fit, None, ()).residuals[1]
    frames = [*before(knee, 20), *before(knee, since, WORSENED, residual=residual)]
    assert WORSENED in assess(patient, fit, None, frames).doubts[1]
    ordinary = before(knee, 20, residual=residual)
    assert WORSENED not in assess(patient, fit, None, ordinary).doubts[1]


def test_passes_remember_what_was_ordinary_long_ago(patient, knee, monkeypatch):
    seen = []
    frames = before(knee, 60)

    def next_frame(patient, number, past, corrected):
        seen.append(len(past))
        return frames[number]

    def look_back(patient, frame, after, before, direction):
        seen.append((len(before), len(after), after[-1].frame))
        return frame

    monkeypatch.setattr(sweep, "next_frame", next_frame)
    sweep.swept(patient, frames[:1], sweep.Course(range(1, 60)), Kept(3))
    assert seen == list(range(1, 60))
    seen.clear()
    monkeypatch.setattr(backward, "_looked_at_again", look_back)
    backward.looked_at_again(patient, frames, "backward", Kept(3))
    assert seen == [(n, 59 - n, n + 1) for n in range(58, -1, -1)]
