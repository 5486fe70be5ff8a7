"""A registration that starts where somebody has put the bones."""

from dataclasses import replace

import numpy as np
import pytest
from phantom_study import case, study

from PolyPoseLib.data.study import Study
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.rigid import about, perturbation
from PolyPoseLib.pipeline import register
from PolyPoseLib.registration.bones import joint
from PolyPoseLib.registration.magnification import magnified
from PolyPoseLib.registration.scene import Scene

SEEDS = (3, 5)


def error_mm(small: Study, simulated, poses, name: str) -> float:
    """Mean error of a bone's voxels: the poses (4, 4) by name, each fixed to moving, against the truth."""
    labels = small.structures.labels
    places = np.argwhere(labels == small.structures.names.index(name) + 1)[::7, ::-1]
    points = np.c_[places, np.ones(len(places))] @ small.ct.affine.T
    moved = points @ (poses[name] @ np.linalg.inv(simulated.fixed_to_moving[name])).T
    return float(np.linalg.norm((moved - points)[:, :3], axis=1).mean())


def shifted(pose: np.ndarray, centre: np.ndarray, rng, degrees: float, mm: float) -> np.ndarray:
    """A pose that somebody set by hand: off by a turn about the bone's centre and a shift, in random directions."""
    turn, shift = rng.normal(size=(2, 3))
    vector = np.r_[np.radians(degrees) * turn / np.linalg.norm(turn), mm * shift / np.linalg.norm(shift)]
    return pose @ about(perturbation(vector), (np.linalg.inv(pose) @ np.r_[centre, 1.0])[:3])


@pytest.mark.parametrize("seed", SEEDS)
def test_bones_that_were_placed_near_their_place_end_there_without_restarts(seed, monkeypatch):
    def never(*_arguments):
        raise AssertionError("a bone that somebody placed was restarted")

    monkeypatch.setattr(joint, "restart_bones", never)
    monkeypatch.setattr(joint, "restart_inconsistent", never)
    rng, simulated = np.random.default_rng(seed), case(seed)
    small = study(simulated, {"uncertainty": False}, camera="known")
    scene = Scene(small.ct, small.structures, small.anchor)
    placed = {
        scene.names[k]: shifted(simulated.fixed_to_moving[scene.names[k]], scene.centres[k], rng, 4.0, 4.0)
        for k in scene.moving
    }
    result = register(replace(small, initial_poses=placed))
    poses = {name: each.fixed_to_moving for name, each in result.structures.items()}
    for name, pose in placed.items():
        before = error_mm(small, simulated, placed, name)
        assert error_mm(small, simulated, poses, name) < min(1.5, before / 2), (name, pose)


@pytest.mark.long
def test_bones_that_were_not_placed_are_restarted_as_ever(monkeypatch):
    asked = []
    simulated = case(1)
    small = study(simulated, {"uncertainty": False}, camera="known")
    monkeypatch.setattr(
        joint, "restart_bones", lambda _run, _xrays, poses, _level, which: asked.append(list(which)) or poses
    )
    pose = simulated.fixed_to_moving["femur_left"]
    register(replace(small, initial_poses={"femur_left": pose}))
    assert asked and all(which == [small.structures.names.index("vertebra_L5")] for which in asked)


def test_initial_poses_grow_with_a_study_that_is_magnified():
    simulated = case(1)
    pose = simulated.fixed_to_moving["femur_left"]
    small = replace(study(simulated), initial_poses={"femur_left": pose})
    larger = magnified(small, 2.5).initial_poses["femur_left"]
    np.testing.assert_allclose(larger[:3, :3], pose[:3, :3])
    np.testing.assert_allclose(larger[:3, 3], 2.5 * pose[:3, 3])


@pytest.mark.parametrize(
    ("name", "pose", "options", "words"),
    [
        ("pelvis", np.eye(4), {}, "does not move"),
        ("femur_lft", np.eye(4), {}, "femur_left"),
        ("femur_left", 2 * np.eye(4), {}, "femur_left"),
        ("femur_left", np.eye(3), {}, "4x4"),
        ("femur_left", np.diag([1.0, 1, -1, 1]), {}, "femur_left"),
        ("femur_left", np.eye(4), {"preset": "paper"}, "paper"),
    ],
)
def test_wrong_initial_poses_are_refused_in_one_sentence(name, pose, options, words):
    small = study(case(), options)
    with pytest.raises(InputError, match=words):
        replace(small, initial_poses={name: pose})
