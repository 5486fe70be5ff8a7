"""What speaks against a result, and what does not."""

import numpy as np
import pytest
from phantom_study import phantom
from random_camera import camera

from PolyPoseLib.registration.fit.levels import Observation
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.registration.uncertainty.checks import (
    ViewScores,
    left_out_warnings,
    reasons_for_distrust,
)

REST = np.stack([np.eye(4)] * 3)


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene(*phantom(), "pelvis")


def reasons(scene: Scene, before: float, after: float) -> str:
    seen = np.ones((3, 2), bool)
    scores = (ViewScores([before, before], seen), ViewScores([after, after], seen))
    return " ".join(reasons_for_distrust(scene, ["a", "b"], *scores, REST))


def test_a_patient_at_rest_may_lose_a_hair_of_similarity(scene: Scene) -> None:
    assert reasons(scene, 0.9991, 0.9989) == ""
    assert reasons(scene, 0.93, 0.95) == ""


def test_a_similarity_that_falls_speaks_against_the_result(scene: Scene) -> None:
    assert "did not rise" in reasons(scene, 0.93, 0.80)
    assert "does not match" in reasons(scene, 0.2, 0.3)


@pytest.mark.parametrize(("left", "distrusted"), [((), False), ((1,), False), ((1, 2), True)])
def test_bones_that_left_every_x_ray_speak_against_the_result_when_they_are_most(scene, left, distrusted):
    before, after = np.ones((2, 3, 2), bool)
    after[list(left)] = False
    scores = (ViewScores([0.9, 0.9], before), ViewScores([0.95, 0.95], after))
    found = reasons_for_distrust(scene, ["a", "b"], *scores, REST)
    assert any("left every X-ray" in reason for reason in found) == distrusted


def test_what_is_left_out_is_said_in_shares_of_what_was_given():
    view = camera(0)
    whole = np.ones((view.height, view.width), bool)
    clipped, metal = np.zeros((2, *whole.shape), bool)
    clipped[: view.height // 2] = True
    metal[view.height // 4 : 3 * view.height // 4] = True
    image = np.zeros(whole.shape, np.float32)
    assert left_out_warnings("a", Observation(image, whole, view)) == []
    found = left_out_warnings("a", Observation(image, whole & ~clipped, view, clipped=clipped).without(metal))
    share = 100 * (metal & ~clipped).sum() / whole.size
    assert [line.startswith('X-ray "a": ') for line in found] == [True, True]
    assert "50% of it is all black or all white" in found[0] and f"cover {share:.1f} % of it" in found[1]
