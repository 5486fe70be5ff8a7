"""Where the first frame's fit starts."""

from types import SimpleNamespace

import numpy as np
import pytest

from PolyPoseLib.geometry.rigid import perturbation
from PolyPoseLib.tracking.first_frame import starting_poses

NAMES = ("femur", "tibia", "patella")


def patient(given):
    """Of these initial poses; the femur is the reference."""
    return SimpleNamespace(
        scene=SimpleNamespace(names=NAMES),
        sequence=SimpleNamespace(initial_poses=given),
        reference=0,
        enlarged=np.asarray,
    )


@pytest.mark.parametrize("placed", [("femur",), ("tibia",), ("tibia", "femur"), ("patella", "tibia"), NAMES])
def test_bones_without_a_pose_lie_about_one_that_has_one_as_in_the_ct(placed):
    """About the reference where it has one: the rig's world may be far from the CT's."""
    rng = np.random.default_rng(len(placed))
    given = {name: perturbation(np.r_[rng.normal(0, 0.5, 3), rng.normal(0, 300.0, 3)]) for name in placed}
    found = starting_poses(patient(given), None)
    base = given["femur" if "femur" in placed else placed[0]]
    for name, pose in zip(NAMES, found, strict=True):
        assert np.array_equal(pose, given.get(name, base))


def test_without_any_pose_the_rigs_world_is_that_of_the_ct():
    assert np.array_equal(starting_poses(patient({}), None), np.stack([np.eye(4)] * 3))
