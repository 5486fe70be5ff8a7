"""What widens a stated interval, and how far."""

from types import SimpleNamespace

import numpy as np
import pytest
from ct_values import as_volume, random_ct
from random_camera import camera

from PolyPoseLib.registration.fit.levels import Observation, pixel_size_mm
from PolyPoseLib.registration.uncertainty.covariance import FAINTEST, TYPICAL_CONTRAST, PoseUncertainty
from PolyPoseLib.registration.uncertainty.intervals import (
    CLIPPED_MM,
    DISTORTION,
    HIDDEN_SHARE,
    SOFT_SHARE,
    UNCONFIRMED_MM,
    _beam,
    distortion_error,
    error_behind_metal,
    error_beside_soft_motion,
    systematic_error,
)


@pytest.mark.parametrize("seed", range(5))
def test_fainter_bones_are_less_certain_and_clear_ones_no_more_than_before(seed):
    rng = np.random.default_rng(seed)
    uncertainty = PoseUncertainty.independent(*rng.uniform(0.1, 3, 2))
    contrasts = np.sort(rng.uniform(0.001, 0.5, 20))
    widths = [uncertainty.at_contrast(each).widest_mm for each in contrasts]
    assert (np.diff(widths) <= 1e-12).all()
    assert uncertainty.at_contrast(TYPICAL_CONTRAST).widest_mm == pytest.approx(uncertainty.widest_mm)
    assert uncertainty.at_contrast(0.0).widest_mm == pytest.approx(np.sqrt(FAINTEST) * uncertainty.widest_mm)


@pytest.mark.parametrize("seed", range(5))
def test_an_error_along_a_direction_is_none_across_it(seed):
    rng = np.random.default_rng(seed)
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    error = PoseUncertainty.shift_along(direction, 4.0)
    across = np.cross(direction, rng.normal(size=3))
    assert direction @ error.covariance[3:, 3:] @ direction == pytest.approx(16)
    assert across @ error.covariance[3:, 3:] @ across == pytest.approx(0, abs=1e-9)
    assert error.widest_mm == pytest.approx(1.96 * 4)
    assert not error.covariance[:3].any()


@pytest.mark.parametrize("seed", range(5))
def test_the_beam_through_a_bone_is_the_direction_in_which_it_does_not_move_in_the_picture(seed):
    rng = np.random.default_rng(seed)
    view = camera(seed)
    centre = view.source + 700 * view.axis + rng.uniform(-50, 50, 3)
    beam = _beam(view, np.eye(4), centre)
    np.testing.assert_allclose(view.project(centre), view.project(centre + 30 * beam), atol=1e-6)
    assert beam @ view.axis > 0


@pytest.mark.parametrize("seed", range(5))
def test_the_farther_soft_tissue_moved_by_itself_the_less_certain_is_a_bone_in_it(seed):
    moved = np.sort(np.random.default_rng(seed).uniform(0.1, 30, 10))
    widths = [error_beside_soft_motion(each).widest_mm for each in moved]
    assert np.allclose(widths, 1.96 * SOFT_SHARE * moved)
    assert not error_beside_soft_motion(0.0).covariance.any()


@pytest.mark.parametrize("seed", range(5))
def test_the_more_of_a_bone_metal_hides_the_less_certain_it_is(seed):
    shares = np.sort(np.random.default_rng(seed).uniform(0.01, 1, 10))
    widths = [error_behind_metal(float(each)).widest_mm for each in shares]
    assert (np.diff(widths) > 0).all()
    half = error_behind_metal(HIDDEN_SHARE)
    assert half.widest_mm == pytest.approx(1.96 * UNCONFIRMED_MM)
    assert error_behind_metal(0.1).widest_mm < 0.5


def test_distortion_grows_with_the_field_and_is_that_of_the_x_rays_that_may_have_it():
    view = camera(0)
    point = view.source + 700 * view.axis
    image = np.zeros((view.height, view.width), np.float32)
    observation = Observation(image, image == 0, view)
    clean, bent = (SimpleNamespace(maybe_distorted=each) for each in (False, True))
    assert distortion_error([clean], [observation], point) is None
    error = distortion_error([clean, bent], [observation] * 2, point)
    assert error is not None
    radius = min(image.shape) / 2 * pixel_size_mm(view, point)
    assert error.widest_mm == pytest.approx(1.96 * DISTORTION * radius)


@pytest.mark.parametrize("seed", range(3))
def test_a_ct_clipped_to_soft_tissue_makes_all_poses_less_certain(seed):
    view = camera(seed)
    point = view.source + 700 * view.axis
    image = np.zeros((view.height, view.width), np.float32)
    observations = [Observation(image, image == 0, view)]
    whole = random_ct(np.random.default_rng(seed))
    clean, bent = ([SimpleNamespace(maybe_distorted=each)] for each in (False, True))

    def width(values, xrays):
        error = systematic_error(as_volume(values), xrays, observations, point)
        return 0.0 if error is None else error.widest_mm

    clipped = np.clip(whole, -160, 240)
    assert width(whole, clean) == 0
    assert width(clipped, clean) == pytest.approx(1.96 * CLIPPED_MM)
    assert width(clipped, bent) == pytest.approx(np.hypot(width(clipped, clean), width(whole, bent)))
