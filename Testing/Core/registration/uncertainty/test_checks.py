"""What speaks against a result, and what does not."""

import numpy as np
import pytest
from phantom_study import phantom

from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.registration.uncertainty.checks import ViewScores, hidden_structures, reasons_for_distrust

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
    assert len(hidden_structures(scene, scores[1])) == len(left)
