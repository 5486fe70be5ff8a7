"""What holds for every pair of images: range, symmetry, and no change by gain, offset, mirroring or masked pixels."""

from collections.abc import Callable

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter
from torch import Tensor

from PolyPoseLib.similarity.local_contrast import LocalContrast
from PolyPoseLib.similarity.ncc import gmncc, gradient_ncc, ncc, patch_ncc
from PolyPoseLib.similarity.noise import noise_map

MEASURES = [ncc, patch_ncc, gradient_ncc, gmncc]

gains = st.floats(0.01, 100)
offsets = st.floats(-100, 100)


@st.composite
def pairs(draw: st.DrawFn) -> tuple[Tensor, Tensor, Tensor]:
    """Two images (1, H, W), from unrelated to equal up to contrast, and a mask with most pixels in use."""
    rng = np.random.default_rng(draw(st.integers(0, 1 << 32)))
    height, width = draw(st.integers(14, 24)), draw(st.integers(14, 24))
    images = gaussian_filter(rng.normal(size=(2, 1, height, width)), (0, 0, 1, 1))
    share = draw(st.floats(-1, 1))
    mask = rng.random((1, height, width)) > draw(st.floats(0, 0.2))
    first = torch.from_numpy(images[0] / images[0].std())
    second = share * first + (1 - abs(share)) * torch.from_numpy(images[1] / images[1].std())
    return first, second + 1e-3 * torch.from_numpy(images[1]), torch.from_numpy(mask)


@pytest.mark.parametrize("measure", MEASURES)
@given(pairs(), gains, gains, offsets, offsets)
def test_range_symmetry_and_affine_grey_levels(
    measure: Callable, pair, gain_a, gain_b, offset_a, offset_b
) -> None:
    a, b, mask = pair
    value = measure(a, b, mask=mask)
    assert value.abs() <= 1 + 1e-9
    torch.testing.assert_close(measure(b, a, mask=mask), value, rtol=0, atol=1e-9)
    torch.testing.assert_close(
        measure(gain_a * a + offset_a, gain_b * b + offset_b, mask=mask), value, rtol=0, atol=1e-6
    )
    torch.testing.assert_close(measure(a, -b, mask=mask), -value, rtol=0, atol=1e-9)
    assert measure(a, a, mask=mask) >= value - 1e-9


@pytest.mark.parametrize("measure", MEASURES)
@given(pairs(), st.sampled_from([(1,), (2,), (1, 2)]))
def test_mirroring_both_images_changes_nothing(measure: Callable, pair, axes) -> None:
    a, b, mask = pair
    flipped = [each.flip(axes) for each in pair]
    found = measure(flipped[0], flipped[1], mask=flipped[2])
    torch.testing.assert_close(found, measure(a, b, mask=mask), rtol=0, atol=1e-9)


@pytest.mark.parametrize("measure", MEASURES)
@given(pairs(), st.floats(-1e6, 1e6))
def test_masked_pixels_do_not_count(measure: Callable, pair, value: float) -> None:
    a, b, mask = pair
    other = torch.where(mask, a, torch.full_like(a, value))
    assert torch.equal(measure(other, b, mask=mask), measure(a, b, mask=mask))


@given(pairs(), gains, offsets)
def test_locally_normalised_images_ignore_gain_and_offset(pair, gain: float, offset: float) -> None:
    image, mask = pair[0][0].numpy(), pair[2][0].numpy()
    plain = LocalContrast(mask, 5, 1e-3).normalise(image).values
    scaled = LocalContrast(mask, 5, 1e-3 * gain).normalise(gain * image + offset).values
    np.testing.assert_allclose(scaled, plain, atol=1e-3)
    assert not plain[~mask].any()


@given(st.integers(0, 99), st.floats(0.01, 10), offsets)
def test_noise_scales_with_the_image_and_ignores_its_offset(seed: int, sigma: float, offset: float) -> None:
    noise = np.random.default_rng(seed).normal(0, 1, (64, 64))
    mask = np.ones(noise.shape, bool)
    found = noise_map(offset + sigma * noise, mask)
    np.testing.assert_allclose(found, sigma * noise_map(noise, mask), rtol=1e-3, atol=1e-5)
    assert np.median(found) == pytest.approx(sigma, rel=0.3)
