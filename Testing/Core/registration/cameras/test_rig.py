"""Cameras of one rig keep their relative pose from the initial camera to the result."""

from dataclasses import replace

import numpy as np
import pytest
from quiet_run import quiet_run
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.found_camera import FoundCamera
from PolyPoseLib.data.xray import RigPose
from PolyPoseLib.errors import InputError, UntrustedResultError
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.rigid import about, perturbation
from PolyPoseLib.pipeline import register
from PolyPoseLib.registration.bones.joint import fit_structures
from PolyPoseLib.registration.cameras import rig_initial as rig_initial
from PolyPoseLib.registration.cameras.hypotheses import apart_mm
from PolyPoseLib.registration.cameras.rig import (
    best_for_rig,
    find_rig,
    find_rig_near,
    placed_rig,
    relative_poses,
)
from PolyPoseLib.registration.cameras.rig_initial import initial_rig_cameras
from PolyPoseLib.registration.cameras.study import grouped_by_rig
from PolyPoseLib.registration.fit.levels import Level, Observation
from PolyPoseLib.registration.presets import PRESETS
from PolyPoseLib.simulation.case_study import case_to_study

LEVELS = (Level(6.0, 40.0, 12), Level(3.0, 20.0, 12))


@pytest.fixture(scope="module")
def rig_world():
    """Some other world, in which the rig was calibrated."""
    world = np.eye(4)
    world[:3, :3] = Rotation.from_rotvec([0.7, -1.1, 2.0]).as_matrix()
    world[:3, 3] = (400, -90, 1200)
    return world


@pytest.fixture
def study(simulated, rig_world):
    """Two X-rays of one rig; the first has a rough camera, the second has none."""
    plain = case_to_study(simulated)
    xrays = [
        replace(xray, rig=RigPose("biplane", true.extrinsic @ rig_world))
        for xray, true in zip(plain.xrays, simulated.cameras, strict=True)
    ]
    xrays[1] = replace(xrays[1], extrinsic=None, camera="absent")
    return replace(plain, xrays=tuple(xrays), options={"preset": "fast"})


def relative(cameras) -> np.ndarray:
    return cameras[1].extrinsic @ np.linalg.inv(cameras[0].extrinsic)


def observed_rig(simulated) -> list[Observation]:
    """The X-rays with the initial first camera, and the second placed by the rig."""
    true = simulated.cameras
    blank = [
        Observation(image, np.ones(image.shape, bool), camera)
        for image, camera in zip(simulated.images, true, strict=True)
    ]
    poses = relative_poses([camera.extrinsic for camera in true])
    return placed_rig(blank, poses, simulated.initial_cameras[0].extrinsic)


def test_relative_poses_do_not_depend_on_the_rigs_world(simulated, rig_world):
    poses = [camera.extrinsic for camera in simulated.cameras]
    here, there = relative_poses(poses), relative_poses([pose @ rig_world for pose in poses])
    np.testing.assert_allclose(here, there, atol=1e-9)
    np.testing.assert_allclose(here[0], np.eye(4), atol=1e-12)


@pytest.mark.parametrize("find", [find_rig, find_rig_near])
def test_refining_keeps_the_relative_pose(simulated, scene, points, find):
    start = observed_rig(simulated)
    found = find(quiet_run(scene), start, LEVELS)
    cameras = [getattr(each, "camera", each) for each in found]
    np.testing.assert_allclose(relative(cameras), relative(simulated.cameras), atol=1e-9)
    for was, now, right in zip(start, cameras, simulated.cameras, strict=True):
        assert apart_mm(right, now, points) < min(2.0, apart_mm(right, was.camera, points))


def test_the_candidate_that_agrees_with_all_x_rays_wins(simulated, scene):
    start = observed_rig(simulated)
    poses = relative_poses([camera.extrinsic for camera in simulated.cameras])
    off = np.eye(4)
    off[:3, 3] = (25.0, -10.0, 5.0)
    candidates = [(0, simulated.cameras[0].extrinsic @ off), (1, simulated.cameras[1].extrinsic)]
    best, cameras = best_for_rig(quiet_run(scene), start, poses, candidates, Level(6.0, 40.0, 0))
    assert best == 1
    np.testing.assert_allclose(cameras[0].extrinsic, simulated.cameras[0].extrinsic, atol=1e-9)


def test_a_study_keeps_its_rig_to_the_end(simulated, study, points):
    result = register(study)
    np.testing.assert_allclose(relative(result.cameras), relative(simulated.cameras), atol=1e-9)
    for found, true in zip(result.cameras, simulated.cameras, strict=True):
        camera = Camera(found.intrinsics, found.extrinsic, found.height, found.width)
        assert apart_mm(true, camera, points) < 2.5
    assert not result.distrust


def test_a_rig_moves_on_with_the_bones(simulated, scene, points):
    """Stage A ends at millimetres; the bones then refine the rig as one body."""
    true = simulated.cameras
    off = about(perturbation(np.r_[np.radians([1.0, -0.5, 1.0]), 1.0, -1.0, 2.0]), scene.anchor_centre)
    start = [
        Observation(image, np.ones(image.shape, bool), camera.with_extrinsic(camera.extrinsic @ off))
        for image, camera in zip(simulated.images, true, strict=True)
    ]
    fitted = fit_structures(quiet_run(scene), start, scene.rest_poses, [[0, 1]], PRESETS["fast"].joint).joint
    np.testing.assert_allclose(relative(fitted.cameras), relative(true), atol=1e-9)
    for was, now, right in zip(start, fitted.cameras, true, strict=True):
        assert apart_mm(right, now, points) < 0.5 * apart_mm(right, was.camera, points)


def test_a_known_camera_places_the_others_exactly(simulated, study):
    true = simulated.cameras
    known = replace(study.xrays[0], extrinsic=true[0].extrinsic, camera="known")
    result = register(replace(study, xrays=(known, study.xrays[1])))
    for found, right in zip(result.cameras, true, strict=True):
        np.testing.assert_allclose(found.extrinsic, right.extrinsic, atol=1e-6)


@pytest.mark.parametrize("how", ["a known camera", "not refined"])
def test_cameras_that_are_not_refined_must_show_the_anchor(simulated, study, how):
    """Whether the rig holds them or the study says so: nothing says how far off they may be, the X-ray decides."""
    centre = study.ct.to_world(np.array(study.ct.voxels.shape)[None, ::-1] / 2)[0]
    wrong = about(perturbation(np.r_[np.zeros(3), 0.0, 0.0, 25.0]), centre)
    camera, options = ("known", {}) if how == "a known camera" else ("initial", {"refine_cameras": False})
    first = replace(study.xrays[0], extrinsic=simulated.cameras[0].extrinsic @ wrong, camera=camera)
    result = register(replace(study, xrays=(first, study.xrays[1]), options={**study.options, **options}))
    assert sum("was not to be refined" in reason for reason in result.distrust) == 2


def test_two_known_cameras_stay_as_they_are_and_must_fit_their_rig(simulated, study):
    nudge = np.eye(4)
    nudge[0, 3] = 1.0
    given = [simulated.cameras[0].extrinsic, nudge @ simulated.cameras[1].extrinsic]
    xrays = [
        replace(xray, extrinsic=extrinsic, camera="known")
        for xray, extrinsic in zip(study.xrays, given, strict=True)
    ]
    result = register(replace(study, xrays=tuple(xrays)))
    for found, extrinsic in zip(result.cameras, given, strict=True):
        np.testing.assert_allclose(found.extrinsic, extrinsic, atol=1e-9)
    xrays[1] = replace(xrays[1], extrinsic=simulated.initial_cameras[1].extrinsic)
    with pytest.raises(InputError, match="contradict their rig"):
        replace(study, xrays=tuple(xrays))


def test_an_x_ray_that_shows_nothing_is_placed_by_another(simulated, scene, study, monkeypatch):
    true = simulated.cameras

    def find(run, xray, method, model):
        if xray.name == study.xrays[0].name:
            raise UntrustedResultError("nothing shows")
        return FoundCamera(true[1].extrinsic, True, (2, 10), "searched")

    monkeypatch.setattr(rig_initial, "initial_camera", find)
    found = initial_rig_cameras(quiet_run(scene), study.xrays)
    np.testing.assert_allclose(found[0].extrinsic, true[0].extrinsic, atol=1e-9)
    assert "placed by the rig" in found[0].how and found[1].how == "searched"


def test_a_rig_without_any_initial_camera_says_why(scene, study, monkeypatch):
    def refuse(*_):
        raise UntrustedResultError("nothing shows")

    monkeypatch.setattr(rig_initial, "initial_camera", refuse)
    with pytest.raises(UntrustedResultError, match="nothing shows"):
        initial_rig_cameras(quiet_run(scene), study.xrays)


def test_x_rays_are_grouped_in_order(study):
    single = replace(study.xrays[0], rig=None)
    assert grouped_by_rig([study.xrays[0], single, study.xrays[1], single]) == [[0, 2], [1], [3]]


def test_a_rig_of_one_x_ray_is_refused(study):
    with pytest.raises(InputError, match='rig "biplane" has one X-ray only'):
        replace(study, xrays=(study.xrays[0], replace(study.xrays[1], rig=None)))
