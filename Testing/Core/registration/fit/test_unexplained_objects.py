"""Thin metal over posed bones is left out; bones are not, where they are rendered and a little beside it."""

import numpy as np
import pytest
from drawn_rod import rod
from quiet_run import quiet_run

from PolyPoseLib.geometry.rigid import perturbation
from PolyPoseLib.registration.fit.levels import Observation
from PolyPoseLib.registration.fit.unexplained_objects import unexplained_objects

EVERY = (1, 2)
"""The bones of the phantom that move."""


THIN = (1.5, 0.25)
"""Half width in pixels and half length, over the X-ray's height, of a wire."""


def observed(simulated, image, number=0):
    return Observation(image.astype(np.float32), np.ones(image.shape, bool), simulated.cameras[number])


def true_poses(simulated, scene):
    return np.stack([simulated.fixed_to_moving[name] for name in scene.names])


@pytest.mark.parametrize("number", [0, 1])
@pytest.mark.parametrize("curve", [lambda x: x, lambda x: 3 * x + 7, lambda x: np.sqrt(x + 1)])
def test_nothing_of_the_anatomy_is_left_out(simulated, scene, number, curve):
    observation = observed(simulated, curve(simulated.images[number]), number)
    assert not unexplained_objects(quiet_run(scene), observation, true_poses(simulated, scene), EVERY).any()


@pytest.mark.parametrize("off_mm", [5, 15, 30])
@pytest.mark.parametrize("seed", range(4))
def test_bones_beside_their_place_are_not_taken_for_metal(simulated, scene, seed, off_mm):
    rng = np.random.default_rng(seed)
    poses = true_poses(simulated, scene)
    for k in scene.moving:
        shift = rng.normal(size=3)
        poses[k] = perturbation(np.r_[np.zeros(3), off_mm * shift / np.linalg.norm(shift)]) @ poses[k]
    observation = observed(simulated, simulated.images[seed % 2], seed % 2)
    assert unexplained_objects(quiet_run(scene), observation, poses, EVERY).mean() < (
        0.002 if off_mm < 30 else 0.02
    )


@pytest.mark.parametrize("seed", range(4))
def test_a_wire_is_left_out_and_little_else(simulated, scene, seed):
    number = seed % 2
    image = simulated.images[number]
    metal = rod(image.shape, np.random.default_rng(seed), *THIN)
    poses = true_poses(simulated, scene)
    found = unexplained_objects(
        quiet_run(scene), observed(simulated, image + 2.0 * metal, number), poses, EVERY
    )
    assert found[metal].mean() > 0.5  # of all that is not only around bones
    assert found.sum() < 6 * metal.sum()


def test_the_mask_loses_the_metal_and_tells_it_apart(simulated, scene):
    image = simulated.images[0] + 2.0 * rod(simulated.images[0].shape, np.random.default_rng(0), *THIN)
    before = observed(simulated, image)
    after = before.without(unexplained_objects(quiet_run(scene), before, true_poses(simulated, scene), EVERY))
    assert after.foreign is not None and after.foreign.any()
    np.testing.assert_array_equal(after.mask, before.mask & ~after.foreign)
    np.testing.assert_array_equal(after.given, before.mask)
    np.testing.assert_array_equal(after.image, before.image)


def test_a_flat_picture_has_no_metal(simulated, scene):
    flat = observed(simulated, np.ones(simulated.images[0].shape))
    assert not unexplained_objects(quiet_run(scene), flat, true_poses(simulated, scene), EVERY).any()


def test_a_masked_out_picture_has_no_metal(simulated, scene):
    flat = observed(simulated, simulated.images[0])
    empty = Observation(flat.image, np.zeros_like(flat.mask), flat.camera)
    assert not unexplained_objects(quiet_run(scene), empty, true_poses(simulated, scene), EVERY).any()


def test_where_nothing_contradicts_a_bone_all_is_left_as_it_is(simulated, scene):
    image = simulated.images[0] + 2.0 * rod(simulated.images[0].shape, np.random.default_rng(0), *THIN)
    before = observed(simulated, image)
    found = unexplained_objects(quiet_run(scene), before, true_poses(simulated, scene), ())
    assert before.without(found) is before
