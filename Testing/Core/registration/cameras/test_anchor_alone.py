"""The anchor alone finds its camera in front of what already looks in the picture as it does in the X-ray."""

import numpy as np
import pytest
from phantom_study import case
from quiet_run import quiet_run

from PolyPoseLib.geometry.rigid import about, perturbation, rotation_angle_deg
from PolyPoseLib.registration.cameras.anchor_alone import refine_by_anchor_alone
from PolyPoseLib.registration.fit.levels import Level, Observation
from PolyPoseLib.registration.fit.problem import corrected
from PolyPoseLib.registration.scene import Scene

LEVEL = Level(3.0, 20.0, 15)


@pytest.fixture(scope="module")
def simulated():
    return case(seed=2)


@pytest.fixture(scope="module")
def run(simulated):
    return quiet_run(Scene(simulated.ct, simulated.structures, simulated.anchor), rotation_reach_mm=40.0)


def error(run, true, found):
    """Degrees, mm across the beam and mm along it, at the anchor."""
    turn = rotation_angle_deg(found.extrinsic[:3, :3] @ true.extrinsic[:3, :3].T)
    shift = (found.extrinsic - true.extrinsic) @ np.r_[run.scene.anchor_centre, 1]
    return turn, float(np.linalg.norm(shift[:2])), abs(float(shift[2]))


def wrong(run, camera, seed):
    """A correction (4, 4) of a camera that is two degrees and 14 mm along the beam off."""
    rng = np.random.default_rng(seed)
    beam = run.scene.anchor_centre - camera.source
    axis = rng.normal(size=3)
    turn = np.radians(2.0) * axis / np.linalg.norm(axis)
    shift = rng.normal(0, 1, 3) + rng.choice([-14, 14]) * beam / np.linalg.norm(beam)
    return about(perturbation(np.r_[turn, shift]), run.scene.anchor_centre)


def test_cameras_that_their_surroundings_held_come_closer(simulated, run):
    """Eight of them; how far the phantom's small anchor is turned hardly shows."""
    before, after = [], []
    for seed in range(8):
        n = seed % 2
        true, image = simulated.cameras[n], simulated.images[n]
        correction = wrong(run, true, seed)
        start = Observation(image, np.ones(image.shape, bool), corrected(true, correction))
        # Seen by the wrong camera, the others look as the X-ray shows them.
        moved = np.stack([simulated.fixed_to_moving[name] for name in run.scene.names])
        poses = moved @ np.linalg.inv(correction)
        poses[run.scene.anchor] = np.eye(4)
        (found,) = refine_by_anchor_alone(run, [start], poses, [[0]], LEVEL)
        before.append(error(run, true, start.camera))
        after.append(error(run, true, found.camera))
    _, across, along = np.mean(after, axis=0) / np.mean(before, axis=0)
    assert across < 0.35 and along < 0.5
    assert np.max(after, axis=0)[1] < 0.6


def test_cameras_that_are_known_stay(simulated, run):
    observations = [
        Observation(image, np.ones(image.shape, bool), camera)
        for image, camera in zip(simulated.images, simulated.cameras, strict=True)
    ]
    found = refine_by_anchor_alone(run, observations, run.scene.rest_poses, [[1]], LEVEL)
    assert found[0].camera is observations[0].camera and found[1].camera is not observations[1].camera


def test_a_view_without_the_anchor_keeps_its_camera(simulated, run):
    camera = simulated.cameras[0]
    observation = Observation(simulated.images[0], np.zeros(simulated.images[0].shape, bool), camera)
    (found,) = refine_by_anchor_alone(run, [observation], run.scene.rest_poses, [[0]], LEVEL)
    assert np.array_equal(found.camera.extrinsic, camera.extrinsic)
