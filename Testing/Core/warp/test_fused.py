"""The compiled warp of many points against torch's."""

import numpy as np
import pytest
import torch

from PolyPoseLib.geometry.grid import covering_grid
from PolyPoseLib.warp.dense import displacement_field
from PolyPoseLib.warp.fused import fused_displacements

pytest.importorskip("numba")
FORMS = ("mass", "epsilon", "rigid")


def by_torch(warp, points: np.ndarray) -> np.ndarray:
    return warp(torch.as_tensor(points)).numpy() - points


@pytest.mark.parametrize("frame", ["moving", "fixed"])
@pytest.mark.parametrize("form", FORMS)
def test_equals_torch_inside_and_far_outside_the_maps(bones, frame, form):
    warp = bones.warp(frame, form)
    points = bones.somewhere(4000)
    middle = points.mean(axis=0)
    points = np.concatenate([points, middle + 4 * (points - middle)])
    assert np.abs(fused_displacements(warp)(points) - by_torch(warp, points)).max() < 2e-3


@pytest.mark.parametrize("frame", ["moving", "fixed"])
@pytest.mark.parametrize("reach_mm", [0.5, 8.0, 40.0, 1e6])
def test_equals_torch_when_bones_turn_only_what_is_near(bones, frame, reach_mm):
    warp, points = bones.warp(frame, reach_mm=reach_mm), bones.somewhere(4000)
    assert np.abs(fused_displacements(warp)(points) - by_torch(warp, points)).max() < 2e-3


@pytest.mark.parametrize("form", FORMS)
def test_equals_torch_for_large_turns(bones, motion_of, form):
    middle = bones.somewhere(1000).mean(axis=0)
    poses = np.stack(
        [np.eye(4), motion_of((0, 0, 170), (5, 0, 0), middle), motion_of((-90, 80, 20), (0, 9, 0), middle)]
    )
    warp, points = bones.warp("moving", form, poses), bones.somewhere(4000)
    assert np.abs(fused_displacements(warp)(points) - by_torch(warp, points)).max() < 5e-3


def test_bones_are_rigid(bones):
    displacements = fused_displacements(bones.warp())
    for n, pose in enumerate(bones.poses):
        moving = bones.points(n + 1)
        back = np.linalg.inv(pose)
        fixed = moving @ back[:3, :3].T + back[:3, 3]
        off = np.linalg.norm(fixed + displacements(fixed) - moving, axis=1)
        # Bones that overlap once they moved share what both claim, so a few voxels may be off.
        assert np.quantile(off, 0.9) < 2e-3


def test_rest_moves_nothing(bones):
    warp = bones.warp(poses=np.stack([np.eye(4)] * 3))
    assert not fused_displacements(warp)(bones.somewhere(500)).any()


def test_only_polyrigid_warps_on_grids_that_the_kernel_reads(bones):
    assert fused_displacements(lambda points: points) is None
    assert fused_displacements(bones.warp()) is not None


def test_fields_come_from_it(bones, monkeypatch):
    grid, shape = covering_grid(bones.affine, bones.ct.shape, 5.0)
    compiled = displacement_field(bones.warp(), grid, shape).vectors
    monkeypatch.setattr("PolyPoseLib.warp.fused.fused_displacements", lambda warp: None)
    plain = displacement_field(bones.warp(), grid, shape).vectors
    assert np.abs(compiled - plain).max() < 2e-3
    assert np.abs(plain).max() > 1
