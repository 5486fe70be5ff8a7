"""The noise that is read off an X-ray, and what the fit makes of it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.registration.fit.levels import Level, Observation, view_at
from PolyPoseLib.registration.fit.weighting import reliability
from PolyPoseLib.similarity.noise import noise_map


def anatomy(rng: np.random.Generator, shape: tuple[int, int]) -> np.ndarray:
    """Smooth shadows with some sharp edges, in line integrals."""
    smooth = gaussian_filter(rng.normal(size=shape), 12)
    edges = gaussian_filter(rng.normal(size=shape), 6) > 0
    return 3 + smooth / smooth.std() + 0.5 * edges


@pytest.mark.parametrize("seed", range(5))
def test_noise_of_photons_is_found_at_every_brightness(seed: int) -> None:
    rng = np.random.default_rng(seed)
    clean = anatomy(rng, (220, 260))
    photons = 2e4
    counts = rng.poisson(photons * np.exp(-clean))
    image = -np.log(np.maximum(counts, 0.5) / photons)
    found = noise_map(image, np.ones(image.shape, bool))
    true = 1 / np.sqrt(photons * np.exp(-clean))
    ratio = found / true
    assert np.median(ratio) == pytest.approx(1.0, abs=0.15)
    assert np.percentile(np.abs(np.log(ratio)), 90) < 0.4


@pytest.mark.parametrize("seed", range(3))
def test_noise_scales_with_the_image_and_ignores_what_the_mask_hides(seed: int) -> None:
    rng = np.random.default_rng(seed)
    image = anatomy(rng, (150, 140)) + rng.normal(0, 0.05, (150, 140))
    mask = np.ones(image.shape, bool)
    mask[:, :30] = False
    spoilt = image.copy()
    spoilt[:, :30] = rng.normal(0, 50, (150, 30))
    expected = noise_map(image, mask)
    np.testing.assert_allclose(noise_map(spoilt, mask)[mask], expected[mask], rtol=1e-5)
    np.testing.assert_allclose(noise_map(4 * image, mask), 4 * expected, rtol=1e-5)


def test_an_image_without_noise_has_little_and_an_empty_mask_none() -> None:
    rng = np.random.default_rng(0)
    image = gaussian_filter(rng.normal(size=(120, 120)), 8)
    assert noise_map(image, np.ones(image.shape, bool)).max() < 0.01 * image.std()
    assert not noise_map(image, np.zeros(image.shape, bool)).any()


def test_pixels_count_less_the_noisier_they_are() -> None:
    rng = np.random.default_rng(1)
    clean = anatomy(rng, (120, 120))
    camera = _camera(120)
    level, centre = Level(1.0, 12.0, 1), np.zeros(3)
    means = []
    for deviation in (0.0, 0.1, 0.4):
        noisy = (clean + rng.normal(0, deviation, clean.shape)).astype(np.float32)
        view = view_at(level, Observation(noisy, np.ones(noisy.shape, bool), camera), centre)
        assert np.all((reliability(view) > 0) & (reliability(view) <= 1))
        means.append(float(reliability(view).mean()))
    assert means[0] > 0.9
    assert means[0] > means[1] > means[2]


def _camera(pixels: int) -> Camera:
    extrinsic = np.eye(4)
    extrinsic[2, 3] = 1000.0
    middle = (pixels - 1) / 2
    return Camera(np.array([[1000.0, 0, middle], [0, 1000.0, middle], [0, 0, 1]]), extrinsic, pixels, pixels)
