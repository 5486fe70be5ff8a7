"""The polyrigid warp: rigidity, frames, invariance, gradients, Jacobian."""

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry import se3
from PolyPoseLib.warp.polyrigid import PolyrigidWarp, apply_exp
from PolyPoseLib.warp.weights import DistanceMaps

FRAMES_AND_FORMS = [(frame, form) for frame in ("moving", "fixed") for form in ("mass", "epsilon", "rigid")]


def apply(matrix, points) -> np.ndarray:
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def test_every_bone_is_exactly_rigid(bones):
    """|warp(x) - T_k x| < 1e-3 mm for x with T_k x inside bone k and no other bone's claim."""
    warp = bones.warp()
    for n in range(3):
        moving = bones.points(n + 1)
        fixed = apply(np.linalg.inv(bones.poses[n]), moving)
        distance = bones.distances.under(torch.as_tensor(fixed), torch.as_tensor(bones.poses)).numpy()
        alone = (np.delete(distance, n, axis=0) > 0).all(axis=0)
        assert alone.mean() > 0.99
        error = np.linalg.norm(warp(torch.as_tensor(fixed)).numpy() - moving, axis=1)
        assert error[alone].max() < 1e-3


def test_single_precision_keeps_bones_rigid(bones):
    warp = bones.warp()
    moving = bones.points(2)
    fixed = torch.as_tensor(apply(np.linalg.inv(bones.poses[1]), moving)).float()
    assert np.abs(warp(fixed).numpy() - moving).max() < 1e-3


def test_weights_that_travel_bend_bones_less_than_the_papers(bones):
    def error(frame, form):
        moving = bones.points(2)
        fixed = torch.as_tensor(apply(np.linalg.inv(bones.poses[1]), moving))
        return np.linalg.norm(bones.warp(frame, form)(fixed).numpy() - moving, axis=1).mean()

    assert error("moving", "mass") < 0.9 * error("fixed", "mass")
    assert error("moving", "rigid") < 1e-3 < error("fixed", "rigid")


@pytest.mark.parametrize(("frame", "form"), FRAMES_AND_FORMS)
def test_bones_at_rest_do_not_move_anything(straight_bones, frame, form):
    points = torch.as_tensor(straight_bones.somewhere(500))
    warp = straight_bones.warp(frame, form, np.stack([np.eye(4)] * 3))
    assert (warp(points) - points).abs().max() < 1e-10


@pytest.mark.parametrize(("frame", "form"), FRAMES_AND_FORMS)
def test_bones_that_move_together_move_everything_rigidly(straight_bones, motion_of, frame, form):
    together = motion_of((20, -35, 50), (30, -10, 5), straight_bones.points(1).mean(0))
    points = straight_bones.somewhere(500)
    warped = straight_bones.warp(frame, form, np.stack([together] * 3))(torch.as_tensor(points)).numpy()
    assert np.abs(warped - apply(together, points)).max() < 1e-8


@pytest.mark.parametrize(("frame", "form"), FRAMES_AND_FORMS)
def test_moving_the_whole_world_moves_the_warp_with_it(bones, motion_of, frame, form):
    """With the CT's affine A -> G A and poses T -> G T G^-1, the warp becomes G warp G^-1."""
    world = motion_of((40, 100, -25), (120, -300, 80), np.zeros(3))
    back = np.linalg.inv(world)
    points = bones.somewhere(400)
    here = bones.warp(frame, form)(torch.as_tensor(points)).numpy()
    moved_maps = DistanceMaps(
        bones.distances.signed, world @ bones.affine @ np.linalg.inv(bones.affine) @ bones.distances.affine
    )
    moved = PolyrigidWarp(moved_maps, bones.share, world @ bones.poses @ back, frame, form)
    there = moved(torch.as_tensor(apply(world, points))).numpy()
    assert np.abs(there - apply(world, here)).max() < 1e-4


def test_the_center_of_the_logarithms_does_not_matter(straight_bones):
    points = torch.as_tensor(straight_bones.somewhere(300))
    near = straight_bones.warp()
    far = PolyrigidWarp(
        straight_bones.distances,
        straight_bones.share,
        straight_bones.poses,
        center=np.array([900.0, -500, 700]),
    )
    assert (near(points) - far(points)).abs().max() < 1e-8
    assert near.logs[:, 3:].abs().max() < far.logs[:, 3:].abs().max() / 5


def test_warp_is_the_stated_formula(straight_bones):
    warp = straight_bones.warp("fixed", "mass")
    points = torch.as_tensor(straight_bones.somewhere(50))
    logs = se3.log(torch.as_tensor(straight_bones.poses))
    moved = se3.exp(warp.weights(points).T @ logs) @ torch.cat([points, torch.ones(50, 1)], 1)[:, :, None]
    assert (warp(points) - moved[:, :3, 0]).abs().max() < 1e-9


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-4, 0.05, 0.1, 0.101, 1.0, 3.1])
def test_applied_exponential_agrees_with_matrices(angle):
    rng = np.random.default_rng(0)
    axis = rng.normal(size=(200, 3))
    axis *= angle / np.linalg.norm(axis, axis=1, keepdims=True)
    logs = torch.as_tensor(np.concatenate([axis, rng.normal(0, 50, (200, 3))], axis=1)).requires_grad_()
    points = torch.as_tensor(rng.normal(0, 200, (200, 3)))
    matrix = se3.exp(logs)
    expected = (matrix[:, :3, :3] @ points[:, :, None])[:, :, 0] + matrix[:, :3, 3]
    found = apply_exp(logs, points)
    assert (found - expected).abs().max() < 1e-9
    (by_ours,) = torch.autograd.grad(found.square().sum(), logs, retain_graph=True)
    (by_matrix,) = torch.autograd.grad(expected.square().sum(), logs)
    assert torch.allclose(by_ours, by_matrix, rtol=1e-7, atol=1e-3)
    assert torch.isfinite(by_ours).all()


@pytest.mark.parametrize(("frame", "form"), FRAMES_AND_FORMS)
def test_gradients_by_poses(straight_bones, frame, form):
    maps = straight_bones.distances.to(dtype=torch.float64)
    points = torch.as_tensor(straight_bones.somewhere(12, seed=4))
    logs = se3.log(torch.as_tensor(straight_bones.poses)).requires_grad_()

    def warp(v, place):
        return PolyrigidWarp(maps, straight_bones.share, se3.exp(v), frame, form)(place)

    assert torch.autograd.gradcheck(warp, (logs, points.requires_grad_()), eps=1e-7, atol=5e-2, rtol=1e-3)


def test_gradients_are_finite_at_rest(straight_bones):
    poses = torch.eye(4, dtype=torch.float64).repeat(3, 1, 1).requires_grad_()
    points = torch.as_tensor(straight_bones.somewhere(300))
    warp = PolyrigidWarp(straight_bones.distances, straight_bones.share, poses)
    warp(points).square().sum().backward()
    assert torch.isfinite(poses.grad).all()
    assert poses.grad[0].abs().max() > 0


def test_chunks_change_neither_values_nor_gradients(straight_bones):
    points = torch.as_tensor(straight_bones.somewhere(1000))
    gradients = []
    for chunk in (1 << 17, 130):
        poses = torch.as_tensor(straight_bones.poses).requires_grad_()
        warped = PolyrigidWarp(straight_bones.distances, straight_bones.share, poses)(points, chunk=chunk)
        warped.square().sum().backward()
        gradients.append((warped.detach(), poses.grad))
    assert (gradients[0][0] - gradients[1][0]).abs().max() < 1e-9
    assert torch.allclose(gradients[0][1], gradients[1][1], rtol=1e-9)


@pytest.mark.parametrize(("frame", "form"), FRAMES_AND_FORMS)
def test_jacobian_agrees_with_central_differences(bones, frame, form):
    maps = bones.distances.to(dtype=torch.float64)
    warp = PolyrigidWarp(maps, bones.share, bones.poses, frame, form)
    points = torch.as_tensor(bones.somewhere(200))
    jacobian = warp.jacobian(points, chunk=77)
    step = 1e-5
    for axis in range(3):
        offset = torch.zeros(3, dtype=torch.float64)
        offset[axis] = step
        difference = (warp(points + offset) - warp(points - offset)) / (2 * step)
        # Distances have kinks at the planes through the nodes; a few differences straddle one.
        close = (jacobian[:, :, axis] - difference).abs().amax(1) < 1e-4
        assert close.double().mean() > 0.98
    assert torch.allclose(warp.jacobian_determinant(points), torch.linalg.det(jacobian))


def test_inside_a_bone_the_determinant_is_one(bones):
    fixed = apply(np.linalg.inv(bones.poses[1]), bones.points(2))
    centre = fixed[np.linalg.norm(fixed - fixed.mean(0), axis=1) < 4]
    assert (bones.warp().jacobian_determinant(torch.as_tensor(centre)) - 1).abs().max() < 1e-3


def test_random_postures_do_not_fold(straight_bones, motion_of):
    rng = np.random.default_rng(11)
    points = torch.as_tensor(straight_bones.somewhere(5000))
    for _ in range(5):
        limb, rib = (
            motion_of(rng.normal(0, 1, 3) * 5, rng.normal(0, 1, 3) * 2, straight_bones.points(n).mean(0))
            for n in (2, 3)
        )
        warp = straight_bones.warp(poses=np.stack([np.eye(4), limb, rib]))
        assert (warp.jacobian_determinant(points) > 0).double().mean() > 0.999


def test_rotations_near_the_branch_cut_are_refused(straight_bones, motion_of):
    poses = straight_bones.poses.copy()
    poses[1, :3, :3] = Rotation.from_rotvec([0, 0, np.radians(174)]).as_matrix()
    assert straight_bones.warp(poses=poses).largest_rotation_deg == pytest.approx(174)
    poses[1, :3, :3] = Rotation.from_rotvec([0, 0, np.radians(179)]).as_matrix()
    with pytest.raises(InputError, match=r"179\.0 degrees"):
        straight_bones.warp(poses=poses)


def test_arguments_that_do_not_fit_are_refused(straight_bones):
    with pytest.raises(InputError, match="poses of shape"):
        straight_bones.warp(poses=np.eye(4)[None])
    with pytest.raises(InputError, match="diverged"):
        straight_bones.warp(poses=straight_bones.poses * np.nan)
    with pytest.raises(InputError, match="frame"):
        straight_bones.warp(frame="patient")
    with pytest.raises(InputError, match="shares"):
        PolyrigidWarp(straight_bones.distances, np.array([0.5, 0.5, 0.0]), straight_bones.poses)
