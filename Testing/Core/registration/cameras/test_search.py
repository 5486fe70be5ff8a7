"""Cameras are found from a standard view or landmarks; what cannot be found is said to be doubtful."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.landmarks import Landmarks
from PolyPoseLib.data.progress import Monitor, Progress
from PolyPoseLib.data.xray import Xray
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.registration.cameras.hypotheses import Hypothesis, apart_mm, distinct, doubts, merged
from PolyPoseLib.registration.cameras.initial import initial_camera, scored_camera
from PolyPoseLib.registration.cameras.search import Density, SearchRange, Stage, find_cameras
from PolyPoseLib.registration.fit.levels import Level, Observation
from PolyPoseLib.rendering.select import select_backend
from PolyPoseLib.simulation.case_study import case_to_study

QUICK = (Density(10.0, 11.0, 1.2, 30),)
STAGES = (Stage(Level(8.0, 60.0, 8), 6, 4.0), Stage(Level(5.0, 40.0, 10), 3, 5.0))


def xray(simulated, number, **changes) -> Xray:
    study = case_to_study(simulated, camera="absent")
    return replace(study.xrays[number], **changes)


def test_a_camera_is_found_without_a_guess(simulated, scene, points):
    true = simulated.cameras[0]
    turned = Rotation.from_rotvec([0.2, -0.15, 0.1]).as_matrix()
    searched = replace(SearchRange.around_view("AP", 1020.0), radius_deg=25.0, depths_mm=(600.0, 900.0))
    searched = replace(searched, centres=turned @ searched.centres)
    steps: list[Progress] = []
    image = simulated.images[0]
    measured = Observation(image, np.ones(image.shape, bool), true.with_extrinsic(np.eye(4)))
    found = find_cameras(
        scene, measured, searched, select_backend(), Monitor(steps.append, None), "camera", QUICK, STAGES
    )
    assert apart_mm(true, found[0].camera, points) < 3
    assert found[0].similarity > 0.6
    shares = [step.iteration / step.of for step in steps]
    assert shares == sorted(shares) and shares[0] >= 0 and shares[-1] <= 1
    for n, one in enumerate(found):
        assert all(apart_mm(one.camera, other.camera, points) > 4 for other in found[:n])


def test_noise_is_not_believed(simulated, scene):
    rng = np.random.default_rng(0)
    image = rng.normal(size=(120, 120)).astype(np.float32)
    searched = replace(SearchRange.around_view("AP", 1020.0), radius_deg=15.0, depths_mm=(700.0, 800.0))
    measured = Observation(image, np.ones(image.shape, bool), simulated.cameras[0])
    found = find_cameras(
        scene, measured, searched, select_backend(), Monitor(None, None), "camera", QUICK, STAGES
    )
    guess = scored_camera(found, "searched", "noise")
    assert not guess.sure
    assert "noise" in guess.warnings[0]


def test_landmarks_win_over_search(simulated, scene, points):
    true = simulated.cameras[1]
    some = points[:: len(points) // 8]
    landmarks = Landmarks(some, true.project(some))
    guess = initial_camera(
        scene, xray(simulated, 1, landmarks=landmarks), select_backend(), Monitor(None, None), "camera"
    )
    assert apart_mm(true, true.with_extrinsic(guess.extrinsic), points) < 3
    assert "landmarks" in guess.how


def test_contradicting_landmarks_are_not_believed(simulated, scene, points):
    rng = np.random.default_rng(0)
    some = points[:: len(points) // 8]
    landmarks = Landmarks(some, rng.uniform(0, 119, (len(some), 2)))
    try:
        guess = initial_camera(
            scene, xray(simulated, 1, landmarks=landmarks), select_backend(), Monitor(None, None), "camera"
        )
    except InputError as error:
        assert "landmarks" in str(error)
    else:
        assert not guess.sure and "landmarks" in guess.warnings[0]


def test_a_guess_in_the_study_is_taken_as_it_is(simulated, scene):
    given = case_to_study(simulated).xrays[0]
    guess = initial_camera(scene, given, select_backend(), Monitor(None, None), "camera")
    assert guess.sure
    np.testing.assert_allclose(guess.extrinsic, given.extrinsic)


@pytest.mark.parametrize(
    ("method", "reason"), [("dicom", "DICOM"), ("landmarks", "landmarks"), ("guessing", "method")]
)
def test_methods_that_do_not_apply_are_refused(simulated, scene, method, reason):
    with pytest.raises(InputError, match=reason):
        initial_camera(scene, xray(simulated, 0), select_backend(), Monitor(None, None), "camera", method)


def hypothesis(camera: Camera, similarity: float, share: float = 1.0, votes: int = 3) -> Hypothesis:
    return Hypothesis(camera, similarity, share, votes)


def test_what_is_doubted(simulated):
    camera = simulated.cameras[0]
    assert not doubts([hypothesis(camera, 0.8), hypothesis(camera, 0.3)])
    assert "badly" in doubts([hypothesis(camera, 0.3)])[0]
    assert (
        "nearly as well (0.75 against 0.80)" in doubts([hypothesis(camera, 0.8), hypothesis(camera, 0.75)])[0]
    )
    assert "20 %" in doubts([hypothesis(camera, 0.8, 0.2)])[0]
    assert "one start" in doubts([hypothesis(camera, 0.5, votes=1)])[0]


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
