"""Distance maps and the weights made of them."""

from types import SimpleNamespace

import numpy as np
import pytest
import torch
from scipy.ndimage import distance_transform_edt
from scipy.spatial import cKDTree

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry import se3
from PolyPoseLib.warp.weights import distance_maps, weights


def nearest_by_tree(points, bone) -> np.ndarray:
    return cKDTree(bone).query(points)[0]


def test_distances_at_voxels_agree_with_scipy(bones):
    voxels = bones.ct.to_world(np.argwhere(np.ones(bones.ct.shape))[:, ::-1])
    found = bones.distances(torch.as_tensor(voxels)).numpy()
    sampling = bones.ct.spacing[::-1]
    for n in (1, 2, 3):
        expected = distance_transform_edt(bones.structures.labels != n, sampling=sampling).ravel()
        assert np.abs(found[n - 1] - expected).max() < 2e-4
        assert (found[n - 1][bones.structures.labels.ravel() == n] < 1e-4).all()


def test_coarser_maps_stay_within_half_a_cell(bones):
    coarse = distance_maps(bones.structures, bones.affine, spacing_mm=4.0)
    assert coarse.signed.numel() < bones.distances.signed.numel() / 3
    points = torch.as_tensor(bones.somewhere(2000))
    error = (coarse(points) - bones.distances(points)).abs()
    assert error.max() < 2.5
    assert error.mean() < 0.1
    inside = torch.as_tensor(bones.points(1))
    assert coarse(inside)[0].mean() < 0.4
    assert coarse(inside)[0].max() < 2.0


def test_distances_at_the_nodes_of_a_coarser_grid_are_exact(bones):
    coarse = distance_maps(bones.structures, bones.affine, spacing_mm=3.7, margin_mm=7)
    index = np.argwhere(np.ones(coarse.signed.shape[1:]))[:, ::-1]
    nodes = index @ coarse.affine[:3, :3].T + coarse.affine[:3, 3]
    for n in (1, 2, 3):
        expected = nearest_by_tree(nodes, bones.points(n)).reshape(coarse.signed.shape[1:])
        far = expected > 2.5
        assert far.mean() > 0.5
        assert np.abs(coarse.signed[n - 1].numpy() - expected)[far].max() < 1e-3
        assert np.abs(np.maximum(coarse.signed[n - 1].numpy(), 0) - expected)[~far].max() < 1.8


def test_distance_is_exactly_zero_between_voxels_of_one_bone(bones):
    rng = np.random.default_rng(5)
    index = rng.uniform([5, 14, 4], [12, 21, 25], (500, 3))
    assert bones.distances(torch.as_tensor(bones.ct.to_world(index)))[0].max() == 0


def test_distances_beyond_the_maps_are_continuous_and_bounded(bones):
    rng = np.random.default_rng(6)
    size = np.array(bones.ct.shape[::-1])
    points = bones.ct.to_world(rng.uniform(-size, 2 * size, (400, 3)))
    found = bones.distances(torch.as_tensor(points)).numpy()
    for n in (1, 2, 3):
        expected = nearest_by_tree(points, bones.points(n))
        # The sum of two legs is never shorter than the way, nor longer than sqrt(2) times it, but for interpolation.
        assert (found[n - 1] >= expected - 1.0).all()
        assert (found[n - 1] <= np.sqrt(2) * expected + 2.5).all()
    steps = bones.ct.to_world(np.linspace([-30, 10, 15], [5, 10, 15], 2000))
    along = bones.distances(torch.as_tensor(steps)).numpy()
    assert np.abs(np.diff(along, axis=1)).max() < 1.5 * np.linalg.norm(steps[1] - steps[0])


def test_distances_are_invariant_to_rigid_motion(bones, motion_of):
    """d(T x) to a bone is the distance of x to the bone moved back by T."""
    points = torch.as_tensor(bones.somewhere(300))
    moved = np.stack([motion_of((10, -20, 30), (5, 3, -8), bones.points(1).mean(0))] * 3)
    under = bones.distances.under(points, torch.as_tensor(moved))
    direct = bones.distances(points @ torch.as_tensor(moved[0, :3, :3].T) + torch.as_tensor(moved[0, :3, 3]))
    assert (under - direct).abs().max() < 1e-4


def test_gradient_of_distance_has_unit_length_outside(straight_bones):
    points = torch.as_tensor(straight_bones.somewhere(500)).requires_grad_()
    distance = straight_bones.distances(points)[0]
    (gradient,) = torch.autograd.grad(distance.sum(), points)
    far = distance > 3
    assert (gradient[far].norm(dim=1) - 1).abs().mean() < 0.05
    assert gradient[distance == 0].abs().max() == 0


def test_gradcheck_by_points_and_poses(straight_bones):
    maps = straight_bones.distances.to(dtype=torch.float64)
    points = torch.as_tensor(straight_bones.somewhere(20, seed=3)).requires_grad_()
    outside = (points.detach() + torch.tensor([300.0, 50.0, -20.0])).requires_grad_()
    logs = se3.log(torch.as_tensor(straight_bones.poses)).requires_grad_()

    def distance(place, v):
        return maps.under(place, se3.exp(v))

    assert torch.autograd.gradcheck(distance, (points, logs), eps=1e-7, atol=1e-2, rtol=1e-4)
    assert torch.autograd.gradcheck(distance, (outside, logs), eps=1e-7, atol=1e-2, rtol=1e-4)


@pytest.mark.parametrize("form", ["mass", "epsilon", "rigid"])
@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_weights_sum_to_one_and_are_not_negative(form, dtype):
    rng = np.random.default_rng(0)
    distance = torch.as_tensor(rng.exponential(30, (26, 5000))).to(dtype)
    distance[rng.integers(0, 26, 1000), np.arange(1000)] = 0
    share = torch.as_tensor(rng.dirichlet(np.full(26, 0.3)) + 1e-6)
    found = weights(distance, share, form)
    assert (found.sum(0) - 1).abs().max() < 1e-5
    assert found.min() >= 0
    assert torch.isfinite(found).all()


def test_weights_are_the_stated_formulas():
    distance = torch.tensor([[0.0, 3.0], [4.0, 5.0]], dtype=torch.float64)
    share = torch.tensor([0.75, 0.25])
    mass = torch.tensor([[0.75, 0.075], [0.25 / 17, 0.25 / 26]], dtype=torch.float64)
    assert torch.allclose(weights(distance, share, "mass"), mass / mass.sum(0))
    epsilon = torch.tensor([[1.0, 1 / 5.5], [1 / 9.0, 1 / 13.5]], dtype=torch.float64)
    assert torch.allclose(weights(distance, share, "epsilon", 0.5), epsilon / epsilon.sum(0))
    rigid = weights(distance, share, "rigid")
    assert rigid[0, 0] > 1 - 1e-8
    assert rigid[0, 1] == pytest.approx((0.75 / 9) / (0.75 / 9 + 0.25 / 25), abs=1e-6)


def test_memory_budget_makes_the_grid_coarser(straight_bones):
    maps = distance_maps(straight_bones.structures, straight_bones.affine, budget_bytes=150_000)
    assert maps.signed.numel() * 4 <= 150_000
    assert maps.signed.numel() * 4 > 75_000


def test_structures_without_voxels_and_unknown_forms_are_refused(straight_bones):
    empty = SimpleNamespace(names=("spine", "ghost"), labels=np.ones((4, 4, 4), dtype=np.int16))
    with pytest.raises(InputError, match="ghost"):
        distance_maps(empty, np.eye(4))
    with pytest.raises(InputError, match="mass, epsilon, rigid"):
        weights(torch.ones(2, 2), torch.ones(2), "linear")
    sheared = np.eye(4)
    sheared[0, 1] = 1
    with pytest.raises(InputError, match="right angles"):
        distance_maps(straight_bones.structures, sheared)
