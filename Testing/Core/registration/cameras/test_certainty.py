"""Cameras are compared with where they were expected, and with the anchor in their X-ray."""

import numpy as np
import pytest
from quiet_run import quiet_run
from random_camera import camera
from scipy.spatial.transform import Rotation

from PolyPoseLib.geometry.rigid import about, perturbation
from PolyPoseLib.registration.cameras.certainty import (
    departure,
    expected_near,
    judge_cameras,
    stage_warnings,
)
from PolyPoseLib.registration.cameras.initial import GIVEN_RADIUS
from PolyPoseLib.registration.fit.camera_prior import CameraPrior
from PolyPoseLib.registration.fit.levels import Observation


def moved(start, degrees, millimetres, centre, rng):
    """The camera after a turn about a point and a shift of it, in random directions."""
    turn, shift = (each / np.linalg.norm(each) for each in rng.normal(size=(2, 3)))
    motion = about(perturbation(np.r_[np.radians(degrees) * turn, millimetres * shift]), centre)
    return start.with_extrinsic(start.extrinsic @ motion)


@pytest.mark.parametrize("seed", range(10))
def test_a_departure_is_the_angle_and_the_shift_of_the_anchor(seed):
    rng = np.random.default_rng(seed)
    start, centre = camera(seed), rng.uniform(-200, 200, 3)
    degrees, millimetres = rng.uniform(0, 40), rng.uniform(0, 300)
    prior = CameraPrior(start, 5.0, 20.0)
    found = departure(prior, moved(start, degrees, millimetres, centre, rng), centre)
    np.testing.assert_allclose(found, (degrees, millimetres), atol=1e-6)


@pytest.mark.parametrize("seed", range(10))
def test_the_prior_measures_the_same_in_radii_whatever_the_level_started_from(seed):
    rng = np.random.default_rng(seed)
    start, centre = camera(seed), rng.uniform(-200, 200, 3)
    level = moved(start, 3.0, 10.0, centre, rng)
    turn, shift = Rotation.random(random_state=seed).as_rotvec() * 0.05, rng.normal(0, 10, 3)
    correction = about(perturbation(np.r_[turn, shift]), centre)
    prior = CameraPrior(start, 5.0, 20.0)
    ended = level.with_extrinsic(level.extrinsic @ np.linalg.inv(correction))
    deviation = prior.deviation(level, correction, centre) * prior.radii
    degrees, millimetres = departure(prior, ended, centre)
    assert np.degrees(np.linalg.norm(deviation[:3])) == pytest.approx(degrees, abs=1e-6)
    assert np.linalg.norm(deviation[3:]) == pytest.approx(millimetres, abs=1e-6)


def test_no_initial_camera_is_held_closer_than_one_that_was_typed():
    prior = expected_near(camera(0), (2.0, 90.0))
    assert (prior.rotation_deg, prior.translation_mm) == (GIVEN_RADIUS[0], 90.0)


def observed(simulated, number, **changes):
    image = simulated.images[number]
    return Observation(image, np.ones(image.shape, bool), **{"camera": simulated.cameras[number], **changes})


def test_right_cameras_are_not_spoken_of(simulated, scene):
    near = expected_near(simulated.initial_cameras[0], GIVEN_RADIUS)
    right = [observed(simulated, 0, expected=near), observed(simulated, 1)]
    verdict = judge_cameras(quiet_run(scene), ["A", "B"], right, {0})
    assert verdict.warnings == [] and verdict.distrust == []


@pytest.mark.parametrize(
    ("degrees", "millimetres", "warned", "distrusted"),
    [(0.0, 20.0, 0, 0), (8.0, 0.0, 1, 0), (0.0, 30.0, 1, 0), (11.0, 0.0, 0, 1), (0.0, 60.0, 0, 1)],
)
def test_a_camera_that_left_its_radius(simulated, scene, degrees, millimetres, warned, distrusted):
    """The X-ray supports it a little outside, and nothing does far outside."""
    rng = np.random.default_rng(3)
    initial = moved(simulated.cameras[0], degrees, millimetres, scene.anchor_centre, rng)
    found = observed(simulated, 0, expected=expected_near(initial, GIVEN_RADIUS))
    verdict = judge_cameras(quiet_run(scene), ["A"], [found], set())
    assert (len(verdict.warnings), len(verdict.distrust)) == (warned, distrusted)
    for sentence in verdict.warnings + verdict.distrust:
        assert '"A"' in sentence and f"{degrees:.0f} degrees and {millimetres:.0f} mm" in sentence


def test_a_camera_that_was_not_refined_must_show_the_anchor_where_the_x_ray_does(simulated, scene):
    wrong = moved(simulated.cameras[0], 0.0, 25.0, scene.anchor_centre, np.random.default_rng(1))
    verdict = judge_cameras(quiet_run(scene), [""], [observed(simulated, 0, camera=wrong)], set())
    (reason,) = verdict.distrust
    assert "not to be refined" in reason and "X-ray 1" in reason


def test_an_uncertain_camera_needs_an_x_ray_that_agrees(simulated, scene):
    initial = simulated.cameras[0]
    wrong = moved(initial, 4.0, 12.0, scene.anchor_centre, np.random.default_rng(2))
    found = observed(simulated, 0, camera=wrong, expected=expected_near(initial, GIVEN_RADIUS))
    run = quiet_run(scene)
    assert "uncertain" in judge_cameras(run, ["A"], [found], {0}).distrust[0]
    assert judge_cameras(run, ["A"], [found], set()).distrust == []


@pytest.mark.parametrize("seed", range(5))
def test_both_stages_must_agree_about_a_camera(simulated, scene, seed):
    """Within 1.5 degrees about the anchor and 10 mm along the axis; across it the picture shows a difference anyway."""
    start, centre = simulated.cameras[0], scene.anchor_centre
    rng = np.random.default_rng(seed)

    def warnings(camera):
        pairs = observed(simulated, 0, camera=start), observed(simulated, 0, camera=camera)
        return stage_warnings(quiet_run(scene), ["A"], *([each] for each in pairs))

    def shifted(along, across):
        direction = start.extrinsic[:3, :3].T @ (0.0, across, along)
        return start.with_extrinsic(start.extrinsic @ perturbation(np.r_[np.zeros(3), direction]))

    assert warnings(moved(start, 1.4, 0.0, centre, rng)) == []
    assert warnings(shifted(9.9, 3.0)) == warnings(shifted(-9.9, 3.0)) == []
    (turned,) = warnings(moved(start, 1.6, 0.0, centre, rng))
    (deeper,), (nearer,) = warnings(shifted(10.4, 0.0)), warnings(shifted(-12.0, 0.0))
    assert '"A"' in turned and "1.6 degrees" in turned
    assert "+10 mm in depth" in deeper and "-12 mm in depth" in nearer
