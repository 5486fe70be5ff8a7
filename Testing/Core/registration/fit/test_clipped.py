"""Pixels that a window or a detector clipped inside the patient are left out; the direct beam and anatomy are not."""

import numpy as np
import pytest
from quiet_run import quiet_run

from PolyPoseLib.registration.fit.clipped import clipped_pixels, without_clipped
from PolyPoseLib.registration.fit.levels import Observation

AIR = 0.3
"""Line integral below which the detector may saturate."""


def observed(simulated, image, number=0, mask=None):
    mask = np.ones(image.shape, bool) if mask is None else mask
    return Observation(image.astype(np.float32), mask, simulated.initial_cameras[number])


@pytest.mark.parametrize("number", [0, 1])
@pytest.mark.parametrize(("low", "high"), [(0.4, 0.93), (0.4, 1.0), (0.0, 0.9)])
@pytest.mark.parametrize("seen", [lambda x: x, lambda x: 3 * x - 7, lambda x: np.rint(255 * x / x.max())])
def test_what_a_window_clips_is_left_out_and_nothing_else(simulated, scene, number, low, high, seen):
    image = simulated.images[number]
    shows = image > AIR
    bottom, top = np.quantile(image[shows], (low, high))
    given = observed(simulated, seen(np.clip(image, bottom, top)), number, shows)
    found = clipped_pixels(quiet_run(scene), given)
    beyond = shows & ((image < bottom) & (low > 0) | (image > top) & (high < 1))
    assert found[beyond].mean() > 0.99
    inside = (image > bottom + 0.02 * (top - bottom)) & (image < top - 0.02 * (top - bottom))
    assert not found[inside].any()


@pytest.mark.parametrize("number", [0, 1])
@pytest.mark.parametrize("seen", [lambda x: x, lambda x: 3 * x - 7, np.sqrt])
def test_a_direct_beam_that_saturates_the_detector_stays(simulated, scene, number, seen):
    image = seen(np.maximum(simulated.images[number], AIR))
    assert not clipped_pixels(quiet_run(scene), observed(simulated, image, number)).any()


@pytest.mark.parametrize("seed", range(3))
def test_noise_that_meets_the_extremes_here_and_there_is_no_plateau(simulated, scene, seed):
    image = simulated.images[0]
    speckle = np.random.default_rng(seed).random(image.shape) < 0.03
    image = np.where(speckle, image.max() + 1, image)
    assert not clipped_pixels(quiet_run(scene), observed(simulated, image)).any()


def test_a_picture_that_is_nearly_all_clipped_is_left_as_it_is(simulated, scene):
    image = np.minimum(simulated.images[0], np.quantile(simulated.images[0], 0.2))
    assert not clipped_pixels(quiet_run(scene), observed(simulated, image)).any()


def test_the_mask_loses_the_pixels_and_they_are_told_apart(simulated, scene):
    image = simulated.images[0]
    before = observed(simulated, np.minimum(image, np.quantile(image[image > AIR], 0.9)))
    after = without_clipped(quiet_run(scene), before)
    assert after.clipped is not None and after.clipped.any()
    np.testing.assert_array_equal(after.mask, before.mask & ~after.clipped)
    np.testing.assert_array_equal(after.image, before.image)
    whole = observed(simulated, image)
    assert without_clipped(quiet_run(scene), whole) is whole
