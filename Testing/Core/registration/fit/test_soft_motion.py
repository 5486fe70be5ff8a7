"""The soft tissue's own motion: its derivative, organs that it finds, and rest that it leaves alone."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from chest_phantom import chest
from quiet_run import quiet_run
from scipy.ndimage import gaussian_filter, map_coordinates

from PolyPoseLib.data.volume import hounsfield_to_attenuation
from PolyPoseLib.registration.fit import soft_motion
from PolyPoseLib.registration.fit.levels import Level, Observation
from PolyPoseLib.registration.fit.soft_jacobian import SoftJacobian
from PolyPoseLib.registration.fit.soft_motion import fit_soft_motion
from PolyPoseLib.registration.fit.soft_tissue import SoftTissue
from PolyPoseLib.registration.fit.views import LevelViews
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.simulation.independent_projector import project
from PolyPoseLib.simulation.simulate import arc_angles, view_cameras

LEVEL = Level(6.0, 40.0, 10)
LIVER = np.array([-40.0, 0.0, -30.0])
RADIUS_MM = 90.0


@pytest.fixture(scope="module")
def patient():
    """The chest with texture as organs, vessels and fat give it, which shows how tissue moves."""
    ct, structures, _ = chest(spacing=3.0)
    rng = np.random.default_rng(0)
    texture = gaussian_filter(rng.normal(size=ct.shape), 4.0)
    hu = ct.voxels + 120.0 * texture / texture.std()
    return ct.with_voxels(np.where(ct.voxels > -900, hu, ct.voxels).astype(np.float32)), structures


@pytest.fixture(scope="module")
def scene(patient):
    ct, structures = patient
    return Scene(ct, structures, "thoracic_spine")


@pytest.fixture(scope="module")
def cameras(patient):
    return view_cameras(patient[0], arc_angles(2, 40.0), 90, detector_mm=430.0)


def true_shift(points, descent_mm):
    """(N, 3) fixed to moving: tissue around the liver's dome has descended, bones have not."""
    away = np.linalg.norm((points - LIVER) / [1.0, 1.0, 1.3], axis=-1) / RADIUS_MM
    return np.exp(-(away**2))[..., None] * np.array([0.0, 0.0, descent_mm])


def observed(patient, cameras, descent_mm):
    """X-rays, by a projector that shares no code, of the CT whose soft tissue descended."""
    ct, structures = patient
    index = np.stack(np.meshgrid(*map(np.arange, ct.shape), indexing="ij"), -1)[..., ::-1]
    points = index @ ct.affine[:3, :3].T + ct.affine[:3, 3]
    source = ct.to_index((points + true_shift(points, descent_mm)).reshape(-1, 3))[:, ::-1]
    moved = map_coordinates(ct.voxels, source.T, order=1, mode="nearest").reshape(ct.shape)
    moved = np.where(structures.labels > 0, ct.voxels, moved)
    attenuation = ct.with_voxels(hounsfield_to_attenuation(moved).astype(np.float32))
    images = [project(attenuation, camera, "sum") for camera in cameras]
    return [
        Observation(image, np.ones(image.shape, bool), camera)
        for image, camera in zip(images, cameras, strict=True)
    ]


def fitted(scene, observations, steps=4):
    run = quiet_run(scene, rotation_reach_mm=40.0)
    views = LevelViews(run, observations, LEVEL)
    problem, state = views.posed_structures(run.scene.rest_poses)
    for _ in range(steps):
        soft, _ = fit_soft_motion(views, problem, state)
        views.run = replace(views.run, soft_tissue=soft)
    return views.run.soft_tissue, soft.coarse_field(run.scene.rest_poses)


@pytest.mark.parametrize("seed", range(3))
def test_its_derivative_is_that_of_the_rendering(scene, patient, cameras, seed):
    run = quiet_run(scene)
    soft, poses = run.soft_tissue, scene.rest_poses
    rng = np.random.default_rng(seed)
    spread = np.sqrt(soft.modes.variances)[:, None]
    start = 0.2 * rng.normal(size=(soft.modes.count, 3)) * spread
    step = 0.05 * rng.normal(size=start.shape) * spread
    following = soft.following(poses)
    camera = cameras[seed % 2].binned(2)
    shown = [
        soft.render(soft.with_motion(c).moved(following), camera, np.eye(4), 4.0, run.backend)
        for c in (start - step, start + step)
    ]
    numeric = (shown[1] - shown[0]) / 2
    field = soft.with_motion(start).moved(following)
    jacobian = SoftJacobian(soft, field, soft.freedom(following), 3.0).of_view(camera, np.eye(4))
    analytic = np.tensordot(step.reshape(-1), jacobian, 1)
    # It takes the nearest voxel's gradient, and modes at the middles of 12 mm.
    assert np.corrcoef(numeric.ravel(), analytic.ravel())[0, 1] > 0.9
    assert (numeric * analytic).sum() / (analytic**2).sum() == pytest.approx(1, abs=0.15)


@pytest.mark.parametrize("device", [None, torch.device("cpu")], ids=["loops", "torch"])
@pytest.mark.parametrize("beyond_mm", [10.0, 30.0, 400.0])
def test_views_past_the_end_of_the_ct_are_served(scene, cameras, beyond_mm, device):
    """Rays that are nearly perpendicular to the CT's axis meet its end at enormous depths."""
    soft = SoftTissue(scene, device=device)
    following = soft.following(scene.rest_poses)
    jacobian = SoftJacobian(soft, following, soft.freedom(following), 6.0)
    camera = cameras[0].binned(2)
    bottom = scene.volume("soft", 6.0).corners[:, 2].min()
    extrinsic = camera.extrinsic.copy()
    extrinsic[:3, 3] += extrinsic[:3, :3] @ [0, 0, camera.source[2] - bottom + beyond_mm]
    change = jacobian.of_view(camera.with_extrinsic(extrinsic), np.eye(4))
    assert np.isfinite(change).all()
    assert change.any() == (beyond_mm < 100)
    assert not change[:, camera.height // 2 + 3 :].any()  # these rays go down, away from it


@pytest.fixture
def weak_prior(monkeypatch):
    """The phantom shows little of its organs against a prior for real ones."""
    monkeypatch.setattr(soft_motion, "PRIOR", 0.02)


@pytest.mark.parametrize("descent_mm", [8.0, -8.0, 14.0])
def test_it_finds_organs_that_moved_beside_bones_that_did_not(
    scene, patient, cameras, weak_prior, descent_mm
):
    _, field = fitted(scene, observed(patient, cameras, descent_mm), steps=6)
    rng = np.random.default_rng(0)
    points = LIVER + rng.uniform(-25, 25, (500, 3))
    true = true_shift(points, descent_mm)
    error = np.linalg.norm(field.sample(points) - true, axis=1).mean()
    assert error < 0.5 * np.linalg.norm(true, axis=1).mean()


def test_bones_keep_the_place_that_their_poses_give_them(scene, patient, cameras, weak_prior):
    ct, structures = patient
    _, field = fitted(scene, observed(patient, cameras, 14.0))
    assert np.abs(field.vectors).max() > 4
    inside = np.argwhere(structures.labels > 0)[::7, ::-1]
    moved = np.linalg.norm(field.sample(ct.to_world(inside)), axis=1)
    assert np.quantile(moved, 0.95) < 1.0


def test_a_body_at_rest_stays_at_rest(scene, patient, cameras):
    _, field = fitted(scene, observed(patient, cameras, 0.0))
    body = patient[0].to_world(np.argwhere(patient[0].voxels > -900)[::50, ::-1])
    moved = np.linalg.norm(field.sample(body), axis=1)
    assert moved.mean() < 0.8 and np.quantile(moved, 0.95) < 2.0  # voxels of 6 mm


def test_the_xrays_tell_how_large_the_motion_is_along_each_axis(scene, patient, cameras, weak_prior):
    still, _ = fitted(scene, observed(patient, cameras, 0.0), steps=6)
    moved, _ = fitted(scene, observed(patient, cameras, 14.0), steps=6)
    assert (still.sizes < 0.1).all()
    assert moved.sizes[2] > 5 * max(*moved.sizes[:2], still.sizes[2])


def test_how_far_tissue_moved_is_told_where_bones_hold_it_as_well(scene):
    soft = quiet_run(scene).soft_tissue
    assert soft.motion_around(LIVER) == 0
    rng = np.random.default_rng(0)
    spread = np.sqrt(soft.modes.variances)[:, None]
    moved = soft.with_motion(rng.normal(size=(soft.modes.count, 3)) * spread)
    free = moved.modes.at(LIVER[None]) @ moved.coefficients
    assert moved.motion_around(LIVER) == pytest.approx(np.linalg.norm(free))


def test_without_pixels_nothing_moves(scene, patient, cameras):
    nowhere = [replace(each, mask=np.zeros_like(each.mask)) for each in observed(patient, cameras, 8.0)]
    _, field = fitted(scene, nowhere, steps=1)
    assert not field.vectors.any()


def test_the_fitted_motion_becomes_that_of_the_size_found(scene, patient, cameras):
    """Less moves than under the wide prior where nothing descended; what did descend is better than at rest."""
    ct, _ = patient
    body = np.argwhere(ct.voxels > -500)[::50, ::-1] @ ct.affine[:3, :3].T + ct.affine[:3, 3]

    def error(soft, descent):
        found = soft.coarse_field(scene.rest_poses).sample(body)
        return np.linalg.norm(found - true_shift(body, descent), axis=1).mean()

    still, _ = fitted(scene, observed(patient, cameras, 0.0))
    assert error(still.of_likeliest_size(), 0.0) < error(still, 0.0)
    moved, _ = fitted(scene, observed(patient, cameras, 15.0))
    at_rest = np.linalg.norm(true_shift(body, 15.0), axis=1).mean()
    assert error(moved.of_likeliest_size(), 15.0) < at_rest
    untouched = quiet_run(scene, rotation_reach_mm=40.0).soft_tissue
    assert untouched.of_likeliest_size() is untouched
