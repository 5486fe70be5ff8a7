"""Metal that the CT does not have is left out of an X-ray; anatomy is not, wherever the bones moved."""

import numpy as np
import pytest
from drawn_rod import rod
from quiet_run import quiet_run

from PolyPoseLib.registration.fit.foreign_objects import (
    REFINED_REACH_MM,
    foreign_objects,
    without_foreign_objects,
)
from PolyPoseLib.registration.fit.levels import Observation


def observed(simulated, image, number=0, initial=True):
    cameras = simulated.initial_cameras if initial else simulated.cameras
    return Observation(image.astype(np.float32), np.ones(image.shape, bool), cameras[number])


@pytest.mark.parametrize("number", [0, 1])
@pytest.mark.parametrize("initial", [True, False])
@pytest.mark.parametrize("curve", [lambda x: x, lambda x: 3 * x + 7, lambda x: np.sqrt(x + 1)])
def test_nothing_of_the_anatomy_is_left_out(simulated, scene, number, initial, curve):
    observation = observed(simulated, curve(simulated.images[number]), number, initial)
    reach = () if initial else (REFINED_REACH_MM,)
    assert not foreign_objects(quiet_run(scene), observation, *reach).any()


@pytest.mark.parametrize("seed", range(4))
def test_a_rod_is_left_out_and_little_else(simulated, scene, seed):
    rng = np.random.default_rng(seed)
    number = seed % 2
    image = simulated.images[number]
    metal = rod(image.shape, rng)
    found = foreign_objects(quiet_run(scene), observed(simulated, image + 2.5 * metal, number))
    assert found[metal].mean() > 0.9
    assert found.sum() < 4 * metal.sum()


@pytest.mark.parametrize("number", [0, 1])
def test_metal_of_which_there_is_much_does_not_hide_other_metal(simulated, scene, number):
    """Edges are compared with those of anatomy, not with those of the metal itself."""
    image = simulated.images[number]
    plate = np.zeros(image.shape)
    plate[: image.shape[0] // 5, : image.shape[1] // 3] = 15.0
    metal = rod(image.shape, np.random.default_rng(5)) & (plate == 0)
    found = foreign_objects(quiet_run(scene), observed(simulated, image + plate + 1.5 * metal, number))
    assert found[plate > 0].mean() > 0.9 and found[metal].mean() > 0.7


def test_the_mask_loses_the_metal_and_the_image_stays(simulated, scene):
    image = simulated.images[0] + 2.5 * rod(simulated.images[0].shape, np.random.default_rng(0))
    before = observed(simulated, image)
    after = without_foreign_objects(quiet_run(scene), before)
    assert after.mask.sum() < before.mask.sum() and not (after.mask & ~before.mask).any()
    np.testing.assert_array_equal(after.image, before.image)
    assert after.camera is before.camera


def test_an_x_ray_that_has_nothing_in_common_with_the_ct_is_not_blanked(simulated, scene):
    rng = np.random.default_rng(0)
    image = np.kron(rng.random((20, 20)) > 0.5, np.ones([n // 20 for n in simulated.images[0].shape])) * 20.0
    found = foreign_objects(quiet_run(scene), observed(simulated, image))
    assert found.mean() < 0.35


def test_a_flat_picture_has_no_metal(simulated, scene):
    flat = np.ones(simulated.images[0].shape)
    assert not foreign_objects(quiet_run(scene), observed(simulated, flat)).any()
