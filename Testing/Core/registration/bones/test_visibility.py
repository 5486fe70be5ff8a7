"""Shares of a bone beside the picture, behind metal and in clipped pixels are those of its points."""

import numpy as np
import pytest

from PolyPoseLib.registration.bones.visibility import structure_visibility
from PolyPoseLib.registration.fit.levels import Observation

FEMUR = 1


def seen(simulated, scene, given, used=None, clipped=None):
    """Visibility in the first X-ray, of which something may be clipped, and the rest that is not used is metal."""
    given = given if clipped is None else given & ~clipped
    observation = Observation(simulated.images[0], given, simulated.cameras[0], clipped=clipped)
    if used is not None:
        observation = observation.without(given & ~used)
    poses = np.stack([simulated.fixed_to_moving[name] for name in scene.names])
    return structure_visibility(scene, [observation], poses)


def test_all_of_a_bone_is_in_a_picture_that_shows_all(simulated, scene):
    found = seen(simulated, scene, np.ones(simulated.images[0].shape, bool))
    assert not found.hidden.any() and (found.outside[scene.anchor] < 0.05).all()


def test_nothing_is_in_a_picture_that_looks_the_other_way(simulated, scene):
    camera = simulated.cameras[0]
    behind = camera.with_extrinsic(np.diag([-1.0, 1.0, -1.0, 1.0]) @ camera.extrinsic)
    mask = np.ones(simulated.images[0].shape, bool)
    poses = scene.rest_poses
    found = structure_visibility(scene, [Observation(simulated.images[0], mask, behind)], poses)
    assert (found.outside == 1).all() and not found.hidden.any()


@pytest.mark.parametrize("seed", range(4))
def test_what_one_half_of_the_picture_does_not_show_the_other_does(simulated, scene, seed):
    shape = simulated.images[0].shape
    middle = np.random.default_rng(seed).integers(shape[1] // 4, 3 * shape[1] // 4)
    left = np.zeros(shape, bool)
    left[:, :middle] = True
    whole = np.ones(shape, bool)
    alone, other, all_of_it = (seen(simulated, scene, mask).outside for mask in (left, ~left, whole))
    np.testing.assert_allclose((1 - alone) + (1 - other), 1 - all_of_it, atol=1e-9)
    np.testing.assert_allclose(seen(simulated, scene, whole, left).hidden, alone - all_of_it, atol=1e-9)


def test_what_is_clipped_is_not_called_hidden(simulated, scene):
    whole = np.ones(simulated.images[0].shape, bool)
    clipped, metal = np.zeros((2, *whole.shape), bool)
    clipped[:, : whole.shape[1] // 3] = True
    metal[:, -whole.shape[1] // 3 :] = True
    found = seen(simulated, scene, whole, ~clipped & ~metal, clipped)
    np.testing.assert_allclose(found.clipped, seen(simulated, scene, whole, ~clipped).hidden, atol=1e-9)
    np.testing.assert_allclose(found.hidden, seen(simulated, scene, whole, ~metal).hidden, atol=1e-9)
    assert found.clipped.any() and found.hidden.any()


def test_metal_over_clipped_pixels_is_not_counted_twice(simulated, scene):
    whole = np.ones(simulated.images[0].shape, bool)
    clipped, metal = np.zeros((2, *whole.shape), bool)
    clipped[:, : whole.shape[1] // 2] = True
    metal[:, whole.shape[1] // 4 :] = True
    observation = Observation(simulated.images[0], ~clipped, simulated.cameras[0], clipped=clipped).without(
        metal
    )
    assert not (observation.foreign & clipped).any()
    np.testing.assert_array_equal(observation.given, whole)
    found = structure_visibility(scene, [observation], scene.rest_poses)
    assert (found.hidden + found.clipped + found.outside <= 1 + 1e-9).all()


def test_the_share_that_metal_hides_is_that_of_what_is_in_the_pictures(simulated, scene):
    shape = simulated.images[0].shape
    everything, nothing = np.ones(shape, bool), np.zeros(shape, bool)
    covered = Observation(simulated.images[0], everything, simulated.cameras[0]).without(everything)
    beside = Observation(simulated.images[1], nothing, simulated.cameras[1])
    poses = np.stack([simulated.fixed_to_moving[name] for name in scene.names])
    share = structure_visibility(scene, [covered, beside], poses).hidden_share
    np.testing.assert_allclose(share, 1)
    open_view = Observation(simulated.images[1], everything, simulated.cameras[1])
    half = structure_visibility(scene, [covered, open_view], poses).hidden_share
    assert ((half > 0.3) & (half < 0.7)).all()
