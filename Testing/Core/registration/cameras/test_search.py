"""Cameras are found from a standard view or landmarks; what cannot be found is flagged as uncertain."""

from dataclasses import replace

import numpy as np
import pytest
from quiet_run import quiet_run
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.landmarks import Landmarks
from PolyPoseLib.data.progress import Progress
from PolyPoseLib.data.xray import Xray
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.registration.cameras.hypotheses import (
    Hypothesis,
    apart_mm,
    distinct,
    merged,
    reasons_for_uncertainty,
)
from PolyPoseLib.registration.cameras.initial import initial_camera, scored_camera
from PolyPoseLib.registration.cameras.search import Density, SearchRange, Stage, find_cameras
from PolyPoseLib.registration.fit.levels import Level, Observation
from PolyPoseLib.simulation.case_study import case_to_study

QUICK = (Density(10.0, 11.0, 1.2, 30),)
STAGES = (Stage(Level(8.0, 60.0, 8), 6, 4.0), Stage(Level(5.0, 40.0, 10), 3, 5.0))


def xray(simulated, number, **changes) -> Xray:
    study = case_to_study(simulated, camera="absent")
    return replace(study.xrays[number], **changes)


def test_a_camera_is_found_without_an_initial_one(simulated, scene, points):
    true = simulated.cameras[0]
    turned = Rotation.from_rotvec([0.2, -0.15, 0.1]).as_matrix()
    searched = replace(SearchRange.around_view("AP", 1020.0), radius_deg=25.0, depths_mm=(600.0, 900.0))
    searched = replace(searched, centres=turned @ searched.centres)
    steps: list[Progress] = []
    image = simulated.images[0]
    observation = Observation(image, np.ones(image.shape, bool), true.with_extrinsic(np.eye(4)))
    found = find_cameras(quiet_run(scene, steps.append), observation, searched, QUICK, STAGES)
    assert apart_mm(true, found[0].camera, points) < 3
    assert found[0].similarity > 0.6
    shares = [step.iteration / step.of for step in steps]
    assert shares == sorted(shares) and shares[0] >= 0 and shares[-1] <= 1
    for n, one in enumerate(found):
        assert all(apart_mm(one.camera, other.camera, points) > 4 for other in found[:n])


def test_noise_makes_an_uncertain_camera(simulated, scene):
    rng = np.random.default_rng(0)
    image = rng.normal(size=(120, 120)).astype(np.float32)
    searched = replace(SearchRange.around_view("AP", 1020.0), radius_deg=15.0, depths_mm=(700.0, 800.0))
    observation = Observation(image, np.ones(image.shape, bool), simulated.cameras[0])
    found = find_cameras(quiet_run(scene), observation, searched, QUICK, STAGES)
    scored = scored_camera(found, "searched", "noise")
    assert not scored.sure
    assert "noise" in scored.warnings[0]


def test_landmarks_win_over_search(simulated, scene, points):
    true = simulated.cameras[1]
    some = points[:: len(points) // 8]
    landmarks = Landmarks(some, true.project(some))
    found = initial_camera(quiet_run(scene), xray(simulated, 1, landmarks=landmarks))
    assert apart_mm(true, true.with_extrinsic(found.extrinsic), points) < 3
    assert "landmarks" in found.how


def test_contradicting_landmarks_make_an_uncertain_camera(simulated, scene, points):
    rng = np.random.default_rng(0)
    some = points[:: len(points) // 8]
    landmarks = Landmarks(some, rng.uniform(0, 119, (len(some), 2)))
    try:
        found = initial_camera(quiet_run(scene), xray(simulated, 1, landmarks=landmarks))
    except InputError as error:
        assert "landmarks" in str(error)
    else:
        assert not found.sure and "landmarks" in found.warnings[0]


def test_an_initial_camera_of_the_study_is_taken_as_it_is(simulated, scene):
    given = case_to_study(simulated).xrays[0]
    found = initial_camera(quiet_run(scene), given)
    assert found.sure
    np.testing.assert_allclose(found.extrinsic, given.extrinsic)


@pytest.mark.parametrize(
    ("method", "reason"), [("dicom", "DICOM"), ("landmarks", "landmarks"), ("guessing", "method")]
)
def test_methods_that_do_not_apply_are_refused(simulated, scene, method, reason):
    with pytest.raises(InputError, match=reason):
        initial_camera(quiet_run(scene), xray(simulated, 0), method)


def hypothesis(camera: Camera, similarity: float, share: float = 1.0, votes: int = 3) -> Hypothesis:
    return Hypothesis(camera, similarity, share, votes)


def test_what_makes_a_camera_uncertain(simulated):
    camera = simulated.cameras[0]
    assert not reasons_for_uncertainty([hypothesis(camera, 0.8), hypothesis(camera, 0.3)])
    assert "does not match it well" in reasons_for_uncertainty([hypothesis(camera, 0.3)])[0]
    assert (
        "about as well (0.75 against 0.80)"
        in reasons_for_uncertainty([hypothesis(camera, 0.8), hypothesis(camera, 0.75)])[0]
    )
    assert "20 %" in reasons_for_uncertainty([hypothesis(camera, 0.8, 0.2)])[0]
    assert "one start" in reasons_for_uncertainty([hypothesis(camera, 0.5, votes=1)])[0]


def test_votes_of_the_same_camera_add_up(simulated, points):
    camera = simulated.cameras[0]
    near = camera.with_extrinsic(camera.extrinsic @ _shift(0.5))
    far = camera.with_extrinsic(camera.extrinsic @ _shift(30.0))
    found = [hypothesis(near, 0.7, votes=2), hypothesis(camera, 0.8, votes=1), hypothesis(far, 0.5, votes=4)]
    kept = merged(found, points, 3.0, 5, 2.0)
    assert [(h.similarity, h.votes) for h in kept] == [(0.8, 3), (0.5, 4)]
    assert distinct([], np.zeros(0), points, 3.0, 5) == []


def _shift(mm: float) -> np.ndarray:
    motion = np.eye(4)
    motion[0, 3] = mm
    return motion
