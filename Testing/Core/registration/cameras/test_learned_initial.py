"""What a regressor proposes is refined and scored like a search's hypotheses; auto asks it only when it may."""

import numpy as np
import pytest
from quiet_run import quiet_run

from PolyPoseLib.data.found_camera import FoundCamera
from PolyPoseLib.registration.cameras import initial as initial
from PolyPoseLib.registration.cameras.hypotheses import apart_mm
from PolyPoseLib.registration.cameras.initial import initial_camera
from PolyPoseLib.registration.cameras.search import perturbed
from PolyPoseLib.registration.scene import body_points
from PolyPoseLib.simulation.case_study import case_to_study


class Fake:
    """Proposes what it is told."""

    how = "learned by heart"
    warnings = ("It was trained too little.",)

    def __init__(self, cameras, covers=True):
        self.cameras, self.covered = cameras, covers

    def covers(self, xray):
        return self.covered

    def starts(self, xray):
        return list(self.cameras)


@pytest.fixture
def searches(monkeypatch):
    """Searches that cost nothing and find nothing."""
    asked = []

    def search(run, xray):
        asked.append(xray.name)
        return FoundCamera(np.eye(4), False, (2.0, 10.0), "searched", (), 0.01, 0.0)

    monkeypatch.setattr(initial, "searched_camera", search)
    return asked


def found_camera(simulated, scene, model, method="auto"):
    xray = case_to_study(simulated, camera="absent").xrays[0]
    return initial_camera(quiet_run(scene), xray, method, model)


def test_proposals_near_the_truth_lead_to_it(simulated, scene, searches):
    rng, true = np.random.default_rng(3), simulated.cameras[0]
    model = Fake([perturbed(true, scene.anchor_centre, rng) for _ in range(3)])
    points = body_points(scene.bodies(6.0)[scene.anchor], 200)
    assert min(apart_mm(true, camera, points) for camera in model.cameras) > 1
    found = found_camera(simulated, scene, model)
    assert apart_mm(true, true.with_extrinsic(found.extrinsic), points) < 1
    assert found.sure and "learned by heart" in found.how and not searches
    assert found.warnings == Fake.warnings


def test_wrong_proposals_are_uncertain_and_searched_instead(simulated, scene, searches):
    true = simulated.cameras[0]
    upside_down = true.extrinsic.copy()
    turn = np.diag([-1.0, 1.0, -1.0])
    upside_down[:3, :3] = upside_down[:3, :3] @ turn
    middle = true.extrinsic[:3, :3] @ scene.anchor_centre + true.extrinsic[:3, 3]
    upside_down[:3, 3] = middle - upside_down[:3, :3] @ scene.anchor_centre
    model = Fake([true.with_extrinsic(upside_down)])
    assert not found_camera(simulated, scene, model, "learned").sure
    assert not searches
    assert not found_camera(simulated, scene, model).sure
    assert len(searches) == 1


def test_auto_passes_over_a_model_of_other_views(simulated, scene, searches):
    assert found_camera(simulated, scene, Fake([simulated.cameras[0]], covers=False)).how == "searched"
    assert found_camera(simulated, scene, None).how == "searched"
