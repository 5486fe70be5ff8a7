"""Codes and cameras are one to one over the range, without jumps, and decode to rigid motions whatever they are."""

import numpy as np
import torch
from scipy.spatial.transform import Rotation

from PolyPoseLib.learned import pose_code
from PolyPoseLib.learned.view_range import ViewRange

VIEWS = ViewRange(("AP", "LL"), 750.0)
CENTRE = np.array([12.0, -30.0, 80.0])
UNITS = (0.2, 750.0)


def cameras(count, seed=0):
    rng = np.random.default_rng(seed)
    drawn = [VIEWS.draw(rng, CENTRE) for _ in range(count)]
    rotations = np.stack([VIEWS.centres[view] for view, _ in drawn])
    return torch.as_tensor(np.stack([each for _, each in drawn])), torch.as_tensor(rotations)


def test_round_trip():
    extrinsics, rotations = cameras(200)
    centre = torch.as_tensor(CENTRE)
    codes = pose_code.encode(extrinsics, rotations, centre, *UNITS)
    assert codes.shape == (200, pose_code.LENGTH) and codes.abs().max() < 5
    back = pose_code.decode(codes, rotations, centre, *UNITS)
    torch.testing.assert_close(back, extrinsics, rtol=0, atol=1e-9)


def test_any_numbers_give_a_rigid_motion():
    torch.manual_seed(0)
    codes = torch.randn(200, pose_code.LENGTH, dtype=torch.float64) * 3
    extrinsics = pose_code.decode(codes, cameras(200)[1], torch.as_tensor(CENTRE), *UNITS)
    rotation = extrinsics[:, :3, :3]
    identity = torch.eye(3, dtype=torch.float64).expand(200, 3, 3)
    torch.testing.assert_close(rotation @ rotation.transpose(1, 2), identity, rtol=0, atol=1e-9)
    torch.testing.assert_close(torch.linalg.det(rotation), torch.ones(200, dtype=torch.float64))
    depth = rotation[:, 2] @ torch.as_tensor(CENTRE) + extrinsics[:, 2, 3]
    assert (depth > 0).all()


def test_a_turn_about_the_source_changes_only_place_depth_and_roll():
    """The rotation seen along the ray keeps its direction of view: third row of the code's rotation."""
    extrinsics, rotations = cameras(50)
    turn = torch.eye(4, dtype=torch.float64)
    turn[:3, :3] = torch.as_tensor(Rotation.from_rotvec([0.1, -0.07, 0.2]).as_matrix())
    centre = torch.as_tensor(CENTRE)
    before, after = (pose_code.encode(e, rotations, centre, *UNITS) for e in (extrinsics, turn @ extrinsics))

    def direction(codes):
        first, second = codes[:, :3], codes[:, 3:6]
        return torch.linalg.cross(first, second)[:, 2]

    torch.testing.assert_close(direction(before), direction(after), rtol=0, atol=1e-9)
    assert (before[:, 6:8] - after[:, 6:8]).abs().max() > 0.1


def test_codes_change_little_with_small_motions():
    extrinsics, rotations = cameras(100)
    small = torch.eye(4, dtype=torch.float64)
    small[:3, :3] = torch.as_tensor(Rotation.from_rotvec([1e-4, 2e-4, -1e-4]).as_matrix())
    small[:3, 3] = torch.tensor([0.1, 0.1, 0.1])
    centre = torch.as_tensor(CENTRE)
    before, after = (pose_code.encode(e, rotations, centre, *UNITS) for e in (extrinsics, small @ extrinsics))
    assert (before - after).abs().max() < 1e-2


def test_gradients():
    extrinsics, rotations = cameras(3)
    centre = torch.as_tensor(CENTRE)
    codes = pose_code.encode(extrinsics, rotations, centre, *UNITS).requires_grad_()
    assert torch.autograd.gradcheck(
        lambda c: pose_code.decode(c, rotations, centre, *UNITS) / 100, (codes,), atol=1e-4
    )
