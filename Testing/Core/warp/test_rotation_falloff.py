"""Tissue far from a bone takes its displacement without its rotation."""

import numpy as np
import pytest
import torch

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry import se3
from PolyPoseLib.warp.polyrigid import PolyrigidWarp, RotationFalloff


def apply(matrix, points) -> np.ndarray:
    return points @ matrix[:3, :3].T + matrix[:3, 3]


@pytest.mark.parametrize("reach_mm", [0.5, 10.0, 40.0])
def test_every_bone_stays_exactly_rigid(bones, reach_mm):
    warp = bones.warp(reach_mm=reach_mm)
    for n in range(3):
        moving = bones.points(n + 1)
        fixed = apply(np.linalg.inv(bones.poses[n]), moving)
        distance = bones.distances.under(torch.as_tensor(fixed), torch.as_tensor(bones.poses)).numpy()
        alone = (np.delete(distance, n, axis=0) > 0).all(axis=0)
        error = np.linalg.norm(warp(torch.as_tensor(fixed)).numpy() - moving, axis=1)
        assert error[alone].max() < 1e-3


def test_an_endless_reach_is_the_plain_mean(bones):
    points = torch.as_tensor(bones.somewhere(1000))
    assert (bones.warp(reach_mm=1e7)(points) - bones.warp()(points)).abs().max() < 1e-6


def test_translations_are_not_changed(straight_bones):
    """Without rotations a bone's own motion and its centroid's displacement are the same."""
    shifts = np.stack([np.eye(4)] * 3)
    shifts[1:, :3, 3] = [(4.0, -9.0, 2.0), (-3.0, 5.0, 7.0)]
    points = torch.as_tensor(straight_bones.somewhere(1000))
    plain = straight_bones.warp(poses=shifts)(points)
    assert (straight_bones.warp(poses=shifts, reach_mm=5.0)(points) - plain).abs().max() < 1e-9


def test_far_tissue_follows_the_centroids_and_does_not_turn(straight_bones, motion_of):
    """Where only one bone has weight, far tissue moves as that bone's centroid, whatever the bone's rotation."""
    bones = straight_bones
    limb = bones.centroids[1]
    poses = np.stack([np.eye(4), motion_of((20, -14, 30), (3, 8, -5), limb), np.eye(4)])
    share = np.array([1e-9, 1.0, 1e-9])
    warp = PolyrigidWarp(
        bones.distances, share, poses, rotation_falloff=RotationFalloff(0.1, bones.centroids)
    )
    rng = np.random.default_rng(1)
    far = limb + rng.normal(size=(200, 3)) * 5 + np.array([60.0, 0.0, 0.0])
    displacement = warp(torch.as_tensor(far)).numpy() - far
    expected = limb - apply(np.linalg.inv(poses[1]), limb)
    assert np.abs(displacement - expected).max() < 1e-2


def test_moving_the_whole_world_moves_the_warp_with_it(straight_bones, motion_of):
    bones = straight_bones
    world = motion_of((40, 100, -25), (120, -300, 80), np.zeros(3))
    points = bones.somewhere(400)
    here = bones.warp(reach_mm=15.0)(torch.as_tensor(points)).numpy()
    maps = type(bones.distances)(bones.distances.signed, world @ bones.distances.affine)
    rotation_falloff = RotationFalloff(15.0, apply(world, bones.centroids))
    moved = PolyrigidWarp(
        maps, bones.share, world @ bones.poses @ np.linalg.inv(world), rotation_falloff=rotation_falloff
    )
    there = moved(torch.as_tensor(apply(world, points))).numpy()
    assert np.abs(there - apply(world, here)).max() < 1e-4


def test_gradients_by_poses_and_points(straight_bones):
    bones = straight_bones
    maps = bones.distances.to(dtype=torch.float64)
    points = torch.as_tensor(bones.somewhere(12, seed=4))
    logs = se3.log(torch.as_tensor(bones.poses)).requires_grad_()
    rotation_falloff = RotationFalloff(12.0, bones.centroids)

    def warp(v, place):
        return PolyrigidWarp(maps, bones.share, se3.exp(v), rotation_falloff=rotation_falloff)(place)

    assert torch.autograd.gradcheck(warp, (logs, points.requires_grad_()), eps=1e-7, atol=5e-2, rtol=1e-3)


def test_other_poses_keep_the_reach(bones):
    warp = bones.warp(reach_mm=7.0)
    again = bones.warp(poses=np.stack([np.eye(4)] * 3), reach_mm=7.0).with_poses(bones.poses)
    points = torch.as_tensor(bones.somewhere(100))
    assert (warp(points) - again(points)).abs().max() < 1e-9


@pytest.mark.parametrize("reach_mm", [0.0, -3.0, np.nan, np.inf])
def test_a_reach_must_be_a_distance(bones, reach_mm):
    with pytest.raises(InputError, match="above 0 mm"):
        bones.warp(reach_mm=reach_mm)


def test_every_structure_needs_a_centroid(bones):
    with pytest.raises(InputError, match="3 centroids"):
        PolyrigidWarp(
            bones.distances,
            bones.share,
            bones.poses,
            rotation_falloff=RotationFalloff(40.0, np.zeros((2, 3))),
        )
