"""Joints found from labels, and the expectation that they keep together."""

from dataclasses import replace

import numpy as np
import pytest
from phantom_study import HEAD, phantom

from PolyPoseLib.geometry.rigid import about, perturbation
from PolyPoseLib.registration.articulations import (
    ArticulationPrior,
    OneBonePrior,
    bone_clouds,
    find_articulations,
)
from PolyPoseLib.registration.bones.restarts import chain_from_anchor
from PolyPoseLib.registration.scene import Scene


@pytest.fixture(scope="module")
def scene() -> Scene:
    ct, structures = phantom()
    return Scene(ct, structures, "pelvis")


def test_every_structure_hangs_from_the_anchor(scene: Scene) -> None:
    order = chain_from_anchor(scene)
    assert sorted(k for k, _ in order) == [1, 2]
    reached = {scene.anchor}
    for bone, neighbour in order:
        assert neighbour in reached
        reached.add(bone)


def test_the_hip_is_where_femur_and_socket_meet(scene: Scene) -> None:
    ct, structures = phantom()
    joints = find_articulations(bone_clouds(structures, ct.affine), 0)
    (hip,) = [joint for joint in joints if (joint.first, joint.second) == (0, 1)]
    assert np.linalg.norm(hip.point - HEAD) < 25
    assert hip.point[2] > HEAD[2]


@pytest.mark.parametrize("seed", range(8))
def test_only_joints_that_others_can_stand_in_for_yield(seed: int) -> None:
    rng = np.random.default_rng(seed)
    clouds = [place + rng.uniform(-6, 6, (60, 3)) for place in rng.uniform(0, 45, (9, 3))]
    joints = find_articulations(clouds, 0)
    pairs = {frozenset((joint.first, joint.second)) for joint in joints}
    for joint in joints:
        others = pairs - {frozenset((joint.first, joint.second))}
        reached = {joint.first}
        while more := set().union(*(pair for pair in others if pair & reached)) - reached:
            reached |= more
        assert np.isfinite(joint.yields_at) == (joint.second in reached)
        assert joint.is_joint


def test_a_bone_that_glides_over_one_it_touches_costs_less_than_one_that_leaves_its_only_joint() -> None:
    ball = np.random.default_rng(0).normal(size=(200, 3))
    ball *= 8 / np.linalg.norm(ball, axis=1, keepdims=True)
    places = np.array([[0, 0, 0], [20, 0, 0], [10, 17, 0], [40, 0, 0]])
    drawn = [ball + place for place in places]
    away = np.stack([np.eye(4)] * 3)
    away[2, :3, 3] = [0, 0, 40]
    costs = []
    for clouds in (drawn[:3], [*drawn[:2], drawn[3]]):
        centres = np.array([cloud.mean(axis=0) for cloud in clouds])
        joints = find_articulations(clouds, 0)
        costs.append(ArticulationPrior(joints, centres, [1, 2], 1.0).cost(away) * len(joints))
    assert costs[0] < 10 < costs[1]


def test_moving_all_bones_alike_costs_nothing(scene: Scene) -> None:
    prior = ArticulationPrior(scene.articulations, scene.centres, [0, 1, 2], 1.0)
    motion = about(perturbation(np.array([0.3, -0.2, 0.1, 20.0, -30.0, 5.0])), scene.centres[0])
    assert prior.cost(np.stack([motion] * 3)) == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_costs_of_many_poses_at_once_are_those_of_each(scene: Scene, seed: int) -> None:
    rng = np.random.default_rng(seed)
    prior = ArticulationPrior(scene.articulations, scene.centres, [1, 2], 0.7)
    steps = rng.normal(size=(7, 3, 6)) * ([rng.choice([0.05, 1.5])] * 3 + [8.0] * 3)
    poses = np.array([[perturbation(step) for step in each] for each in steps])
    np.testing.assert_allclose(prior.costs(poses), [prior.cost(each) for each in poses], rtol=1e-9)
    alone = OneBonePrior(prior, 2, poses[0])
    np.testing.assert_allclose(alone.costs(poses[:, 2:]), [alone.cost(each[2:]) for each in poses], rtol=1e-9)


def turned_hip(scene: Scene, degrees: float) -> np.ndarray:
    poses = scene.rest_poses
    (hip,) = [each for each in scene.articulations if (each.first, each.second) == (0, 1)]
    poses[1] = about(perturbation(np.r_[np.radians(degrees), 0, 0, 0, 0, 0]), hip.point)
    return poses


def test_a_joint_that_turns_far_costs_hardly_more_than_one_that_turns_by_forty_degrees(scene: Scene) -> None:
    prior = ArticulationPrior(scene.articulations, scene.centres, [1, 2], 1.0)
    five, ten, forty, ninety = (prior.cost(turned_hip(scene, degrees)) for degrees in (5, 10, 40, 90))
    assert ten / five == pytest.approx(3.4, abs=0.3)
    assert forty < ninety < 1.25 * forty


@pytest.mark.parametrize("seed", range(5))
def test_prior_gradient(scene: Scene, seed: int) -> None:
    rng = np.random.default_rng(seed)
    joints = [
        replace(each, weight=rng.uniform(0.5, 30), yields_at=rng.choice([np.inf, 2.0, 0.7]))
        for each in scene.articulations
    ]
    prior = ArticulationPrior(joints, scene.centres, [1, 2], 0.7)

    def moved(step: np.ndarray, poses: np.ndarray) -> np.ndarray:
        new = poses.copy()
        for n, k in enumerate((1, 2)):
            new[k] = about(perturbation(step[6 * n : 6 * n + 6]), scene.centres[k]) @ poses[k]
        return new

    poses = moved(np.tile([0.02] * 3 + [4.0] * 3, 2) * rng.normal(size=12), np.stack([np.eye(4)] * 3))
    matrix, gradient = np.zeros((12, 12)), np.zeros(12)
    cost = prior.add_to(poses, matrix, gradient)
    numeric = np.array(
        [
            (prior.cost(moved(1e-4 * e, poses)) - prior.cost(moved(-1e-4 * e, poses))) / 4e-4
            for e in np.eye(12)
        ]
    )
    assert cost == pytest.approx(prior.cost(poses))
    # The rotation's derivative is exact to first order of the joint's own angle.
    np.testing.assert_allclose(gradient, numeric, atol=0.03 * np.abs(numeric).max())
    assert (np.linalg.eigvalsh(matrix) > -1e-9).all()


def test_strain_grows_with_every_degree_and_is_of_the_bones_own_joints(scene: Scene) -> None:
    prior = ArticulationPrior(scene.articulations, scene.centres, [1, 2], 1.0)
    strains = [prior.strain(turned_hip(scene, degrees)) for degrees in (0, 10, 20, 40, 80, 160)]
    assert strains[0] == pytest.approx(0, abs=1e-12)
    np.testing.assert_allclose(strains[3:], [4 * strains[2], 16 * strains[2], 64 * strains[2]], rtol=1e-6)
    poses = turned_hip(scene, 50)
    assert OneBonePrior(prior, 1, poses).strain(poses[1]) == pytest.approx(prior.strain(poses))
    assert OneBonePrior(prior, 2, poses).strain(poses[2]) == pytest.approx(0, abs=1e-12)
