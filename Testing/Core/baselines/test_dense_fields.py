"""Dense fields: the CT that is rendered is the CT at x + u(x), and every derivative is that of what is computed."""

import dataclasses

import numpy as np
import pytest
import torch
from moved_bones import moved_bones
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.spatial.transform import Rotation

from PolyPoseLib.baselines import dense
from PolyPoseLib.baselines.dense import DenseObjective, Nodes
from PolyPoseLib.baselines.dense_r3 import DenseR3, R3Model
from PolyPoseLib.baselines.dense_se3 import DenseSE3, SE3Model, log_singular_norm
from PolyPoseLib.baselines.published.objective import View
from PolyPoseLib.data.benchmark.system import SystemSetting
from PolyPoseLib.data.volume import Volume, hounsfield_to_attenuation
from PolyPoseLib.errors import CancelledError, InputError
from PolyPoseLib.geometry.camera import Camera, intrinsics_matrix, look_at

MODELS = (lambda nodes, seed: R3Model(nodes), SE3Model)


def oblique_ct(seed=0, shape=(9, 11, 10), spacing=(5.0, 6.0, 7.0)):
    """Smooth HU on an oblique left-handed grid around the origin."""
    rng = np.random.default_rng(seed)
    affine = np.eye(4)
    affine[:3, :3] = Rotation.random(random_state=seed).as_matrix() * spacing
    affine[:3, 0] *= -1
    affine[:3, 3] = -affine[:3, :3] @ ((np.array(shape[::-1]) - 1) / 2)
    hu = gaussian_filter(rng.normal(0, 900, shape), 1.0)
    return Volume(hu.astype(np.float32), affine)


def views(seed=0, pixels=20):
    rng = np.random.default_rng(seed)
    found = []
    for angle in (0.0, 1.3):
        source = 500 * np.array([np.sin(angle), -np.cos(angle), 0.1])
        camera = Camera(
            intrinsics_matrix(800, 4.0, pixels, pixels), look_at(source, np.zeros(3)), pixels, pixels
        )
        image = gaussian_filter(rng.normal(size=(pixels, pixels)), 1.5).astype(np.float32)
        mask = np.ones((pixels, pixels), bool)
        mask[:2, :3] = False
        found.append(View(image, mask, camera))
    return found


def in_double(ct):
    return Nodes.of(ct, dtype=torch.float64)


def test_nodes_are_the_cts_own_voxels_where_these_are_coarse():
    ct = oblique_ct()
    nodes = in_double(ct)
    np.testing.assert_allclose(nodes.volume, hounsfield_to_attenuation(ct.voxels), rtol=1e-6)
    np.testing.assert_allclose(nodes.affine, ct.affine)
    assert nodes.share == pytest.approx(1.0)


def test_nodes_are_so_far_apart_that_they_are_few(monkeypatch):
    monkeypatch.setattr(dense, "MOST_NODES", 300)
    ct = oblique_ct(shape=(20, 24, 30), spacing=(2.0, 2.0, 2.5))
    nodes = in_double(ct)
    assert nodes.volume.numel() <= 300
    cell = np.prod(nodes.spacing)
    assert nodes.share == pytest.approx(cell / np.prod(ct.spacing))
    # Zeros that fill the last blocks add nothing.
    total = hounsfield_to_attenuation(ct.voxels).sum() * np.prod(ct.spacing)
    assert float(nodes.volume.sum()) * cell == pytest.approx(total, rel=1e-4)


def test_the_warped_ct_is_the_ct_at_the_displaced_nodes():
    ct = oblique_ct(1)
    nodes = in_double(ct)
    rng = np.random.default_rng(3)
    in_lps = rng.normal(0, 4, (*ct.shape, 3))
    along_axes = in_lps @ nodes.axes.numpy()
    index = np.stack(np.meshgrid(*map(np.arange, ct.shape), indexing="ij"), -1)[..., ::-1]
    place = ct.to_index(ct.to_world(index) + in_lps)
    expected = map_coordinates(nodes.volume.numpy(), np.moveaxis(place, -1, 0)[::-1], order=1, mode="nearest")
    np.testing.assert_allclose(nodes.warped(torch.tensor(along_axes)), expected, atol=1e-9)


def test_the_nodes_points_are_about_the_middle():
    ct = oblique_ct(2)
    nodes = in_double(ct)
    index = np.stack(np.meshgrid(*map(np.arange, ct.shape), indexing="ij"), -1)[..., ::-1]
    np.testing.assert_allclose(nodes.points, ct.to_world(index), atol=1e-4)


@pytest.mark.parametrize("make", MODELS)
@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.long)])
def test_the_slope_is_that_of_the_present_field(make, seed):
    """In float64, far from rest, against differences of an objective in which nothing is kept."""
    nodes, xrays = in_double(oblique_ct(seed)), views(seed)
    objective = DenseObjective(nodes, xrays, 5.0)
    model = make(nodes, seed)
    rng = np.random.default_rng(seed)
    leaves = [group["params"][0] for group in model.groups]
    with torch.no_grad():
        for leaf, size in zip(leaves, (0.5,) if len(leaves) == 1 else (0.05, 2.0), strict=True):
            leaf += torch.tensor(rng.normal(0, size, leaf.shape))
    displacement = model.displacement()
    similarity = objective.similarity(displacement, gradient=True)
    (-model.penalty(displacement)).backward()

    def value():
        with torch.no_grad():
            present = model.displacement()
            return objective.similarity(present) - float(model.penalty(present))

    with torch.no_grad():
        assert objective.similarity(model.displacement()) == pytest.approx(similarity, abs=1e-12)
        for leaf in leaves:
            for _ in range(3):
                direction = torch.tensor(rng.normal(size=leaf.shape))
                direction *= (torch.tensor(rng.random(leaf.shape[:-1])) < 0.2)[..., None]
                step = 1e-6
                leaf += step * direction
                above = value()
                leaf -= 2 * step * direction
                below = value()
                leaf += step * direction
                assert float((leaf.grad * direction).sum()) == pytest.approx(
                    (above - below) / (2 * step), rel=1e-3, abs=1e-8
                )


def test_the_penalty_of_displacements_is_the_published_sum_of_differences():
    nodes = in_double(oblique_ct(4, shape=(4, 5, 6)))
    model = R3Model(nodes)
    assert float(model.penalty(model.displacement()).detach()) == 0
    rng = np.random.default_rng(0)
    with torch.no_grad():
        model.voxels += torch.tensor(rng.normal(size=model.voxels.shape))
    u, total = model.voxels.detach().numpy(), []
    for k in range(3):
        for j in range(4):
            for i in range(5):
                total.append((u[k + 1, j, i] + u[k, j + 1, i] + u[k, j, i + 1] - 3 * u[k, j, i]) ** 2)
    assert float(model.penalty(model.displacement()).detach()) == pytest.approx(1e-2 * np.mean(total))


def test_the_penalty_of_twists_leaves_rigid_motions_free():
    nodes = in_double(oblique_ct(5))
    model = SE3Model(nodes)
    assert float(model.penalty(model.displacement()).detach()) < 1e-8
    with torch.no_grad():
        model.rotation += torch.tensor([0.3, -0.2, 0.4])
        model.translation += torch.tensor([5.0, 3.0, -2.0])
    assert float(model.penalty(model.displacement()).detach()) < 1e-8
    rotation = Rotation.from_rotvec([0.3, -0.2, 0.4]).as_matrix()
    moved = (model.displacement() @ nodes.axes.T + nodes.points).detach()
    offset = moved - nodes.points @ torch.tensor(rotation).T
    assert float((offset - offset[0, 0, 0]).abs().max()) < 1e-5
    with torch.no_grad():
        model.translation += torch.randn(model.translation.shape, dtype=torch.float64)
    assert float(model.penalty(model.displacement()).detach()) > 1e-4


@pytest.mark.parametrize("equal", [False, True])
def test_singular_values_and_their_slopes(equal):
    rng = np.random.default_rng(7)
    matrices = rng.normal(size=(20, 3, 3))
    if equal:  # two singular values of the same size
        u, s, v = np.linalg.svd(matrices)
        s[:, 1] = s[:, 0]
        matrices = u * s[:, None] @ v
    given = torch.tensor(matrices).requires_grad_()
    found = log_singular_norm(given)
    expected = np.linalg.norm(np.log(np.linalg.svd(matrices)[1] + 1e-6), axis=1)
    np.testing.assert_allclose(found.detach(), expected, rtol=1e-10)
    found.sum().backward()
    direction = rng.normal(size=matrices.shape)

    def norms(step):
        return np.linalg.norm(np.log(np.linalg.svd(matrices + step * direction)[1] + 1e-6), axis=1)

    numerical = (norms(1e-6) - norms(-1e-6)) / 2e-6
    np.testing.assert_allclose((given.grad.numpy() * direction).sum((1, 2)), numerical, rtol=1e-4, atol=1e-6)


def test_the_slope_at_rest_is_finite():
    given = torch.eye(3, dtype=torch.float64).expand(4, 3, 3).clone().requires_grad_()
    log_singular_norm(given).sum().backward()
    assert torch.isfinite(given.grad).all()


SYSTEMS = (DenseR3, DenseSE3)


@pytest.mark.parametrize("system", SYSTEMS)
def test_a_short_fit_raises_the_similarity_and_covers_the_ct(system):
    moved = moved_bones(0, 0.0, 5.0, 0.3, pixels=24, spacing=10.0)
    told = []
    setting = SystemSetting(progress=lambda *step: told.append(step))
    motion = system(4).fit(moved.study, setting)
    assert [step[:2] for step in told] == [(n, 4) for n in range(4)]
    assert told[-1][2] > told[0][2]
    assert not motion.poses and motion.field.spacing.max() <= 4.0
    assert np.abs(motion.field.vectors).max() > 0
    ends = moved.study.ct.to_world(np.array([[-0.5] * 3, np.array(moved.study.ct.shape[::-1]) - 0.5]))
    index = (ends - motion.field.affine[:3, 3]) @ np.linalg.inv(motion.field.affine[:3, :3]).T
    assert (index >= -1e-6).all() and (index <= np.array(motion.field.shape[::-1]) - 1 + 1e-6).all()
    again = system(4).fit(moved.study, SystemSetting())
    np.testing.assert_array_equal(again.field.vectors, motion.field.vectors)


@pytest.mark.parametrize(("system", "epsilon", "iterations"), [(DenseR3, 3e-6, 26), (DenseSE3, 4e-5, 12)])
@pytest.mark.parametrize("seed", [0, *(pytest.param(n, marks=pytest.mark.long) for n in (1, 2))])
def test_a_shifted_body_is_better_matched_than_at_rest(monkeypatch, system, epsilon, iterations, seed):
    """Of clean line integrals that the body fills, of a body without texture, by some of the iterations.

    epsilon: a node of so small a body has larger slopes than one of a patient's, whose CT has finer voxels as well.
    """
    monkeypatch.setattr(dense, "EPSILON", epsilon)
    moved = moved_bones(seed, 0.0, 5.0, 0.3, pixels=40, spacing=7.0)
    motion = system(iterations).fit(moved.study, SystemSetting())
    (error, overlap), (at_rest, overlap_at_rest) = moved.errors(motion), moved.errors()
    assert error < at_rest - 0.1
    assert overlap > overlap_at_rest + 0.04


def test_no_point_moves_farther_than_adam_can_go():
    moved = moved_bones(0, 0.0, 5.0, 0.3, pixels=24, spacing=10.0)
    motion = DenseR3(5).fit(moved.study, SystemSetting())
    assert np.abs(motion.field.vectors).max() <= 5 * 0.01 * 10.0 * 1.01


@pytest.mark.parametrize("system", SYSTEMS)
def test_a_dense_fit_can_be_cancelled(system):
    moved = moved_bones(0, 0.0, 5.0, 0.3, pixels=24, spacing=10.0)
    told = []
    setting = SystemSetting(progress=lambda *step: told.append(step), cancelled=lambda: len(told) == 2)
    with pytest.raises(CancelledError):
        system().fit(moved.study, setting)
    assert len(told) == 2


def test_a_dense_fit_needs_cameras():
    moved = moved_bones(0, 0.0, 5.0, 0.3, pixels=24, spacing=10.0)
    absent = dataclasses.replace(moved.study.xrays[1], extrinsic=None, camera="absent")
    study = dataclasses.replace(moved.study, xrays=(moved.study.xrays[0], absent))
    with pytest.raises(InputError, match="has no camera"):
        DenseR3().fit(study, SystemSetting())
