"""Similarity measures against their definitions, written slowly, and their invariances."""

import math

import numpy as np
import pytest
import torch
from scipy.ndimage import convolve, gaussian_filter, minimum_filter

from PolyPoseLib.similarity import ncc as similarity
from PolyPoseLib.similarity.ncc import gmncc, gradient_ncc, ncc, patch_ncc

MEASURES = [ncc, patch_ncc, gradient_ncc, gmncc]


def images(seed=0, views=2, height=19, width=23, smooth=1.5):
    """Two smooth stacks that are partly alike."""
    rng = np.random.default_rng(seed)
    pair = rng.normal(size=(2, views, height, width))
    pair = gaussian_filter(pair, (0, 0, smooth, smooth))
    pair /= pair.std()
    return torch.tensor(pair[0]), torch.tensor(0.7 * pair[0] + 0.5 * pair[1])


def random_mask(seed=0, views=2, height=19, width=23):
    rng = np.random.default_rng(seed)
    mask = rng.random((views, height, width)) > 0.08
    mask[:, :4] = False
    mask[:, :, -3:] = False
    return torch.tensor(mask)


# The definitions, one pixel and one patch at a time, in plain numpy


def slow_ncc(x, y, used):
    x, y = x[used], y[used]
    x, y = x - x.mean(), y - y.mean()
    return (x * y).sum() / math.sqrt((x * x).sum() * (y * y).sum())


def slow_patch_ncc(x, y, used, size):
    floor = [similarity.PATCH_FLOOR * image[used].var() for image in (x, y)]
    total = weight = 0.0
    for row in range(x.shape[0] - size + 1):
        for column in range(x.shape[1] - size + 1):
            patch = np.s_[row : row + size, column : column + size]
            here = used[patch]
            if not here.any():
                continue
            p, q = x[patch][here], y[patch][here]
            p, q = p - p.mean(), q - q.mean()
            score = (p * q).mean() / math.sqrt(((p * p).mean() + floor[0]) * ((q * q).mean() + floor[1]))
            total += here.sum() * score
            weight += here.sum()
    return total / weight


def slow_gradient_ncc(x, y, used, size):
    kernel = np.array([[-1, 0, 1], [-2, 0, 2], [-1, 0, 1]])
    height, width = x.shape

    def derivative(image, weights):
        out = np.full((height - 2, width - 2), np.nan)
        for row in range(height - 2):
            for column in range(width - 2):
                out[row, column] = (weights * image[row : row + 3, column : column + 3]).sum()
        return out

    inside = np.array(
        [[used[r : r + 3, c : c + 3].all() for c in range(width - 2)] for r in range(height - 2)]
    )
    return np.mean(
        [slow_patch_ncc(derivative(x, k), derivative(y, k), inside, size) for k in (kernel, kernel.T)]
    )


def slow_gmncc(x, y, used):
    multiscale = 0.5 * slow_ncc(x, y, used) + 0.5 * slow_patch_ncc(x, y, used, 9)
    return 0.5 * multiscale + 0.5 * slow_gradient_ncc(x, y, used, 11)


SLOW = [
    (ncc, slow_ncc),
    (lambda a, b, mask: patch_ncc(a, b, 9, mask), lambda x, y, used: slow_patch_ncc(x, y, used, 9)),
    (lambda a, b, mask: patch_ncc(a, b, 4, mask), lambda x, y, used: slow_patch_ncc(x, y, used, 4)),
    (lambda a, b, mask: gradient_ncc(a, b, 11, mask), lambda x, y, used: slow_gradient_ncc(x, y, used, 11)),
    (gmncc, slow_gmncc),
]


@pytest.mark.parametrize("masked", [False, True])
@pytest.mark.parametrize("index", range(len(SLOW)))
def test_agrees_with_the_definition(index, masked):
    fast, slow = SLOW[index]
    a, b = images(seed=index)
    mask = random_mask(index) if masked else None
    used = np.ones(a.shape, bool) if mask is None else mask.numpy()
    expected = [slow(*view) for view in zip(a.numpy(), b.numpy(), used, strict=True)]
    np.testing.assert_allclose(fast(a, b, mask).numpy(), expected, rtol=1e-9)


@pytest.mark.parametrize("measure", MEASURES)
@pytest.mark.parametrize("seed", range(3))
def test_gain_and_offset_change_nothing(measure, seed):
    rng = np.random.default_rng(seed)
    a, b = images(seed)
    mask = random_mask(seed)
    expected = measure(a, b, mask=mask)
    gain = torch.tensor(rng.uniform(0.01, 100, size=(2, 1, 1)))
    offset = torch.tensor(rng.normal(size=(2, 1, 1)) * 100)
    np.testing.assert_allclose(measure(gain * a + offset, b, mask=mask), expected, rtol=1e-8)
    np.testing.assert_allclose(measure(a, gain * b + offset, mask=mask), expected, rtol=1e-8)


@pytest.mark.parametrize("measure", MEASURES)
def test_symmetric_and_highest_for_equal_images(measure):
    a, b = images()
    np.testing.assert_allclose(measure(a, b), measure(b, a), rtol=1e-10)
    assert (measure(a, a) > measure(a, b) + 0.05).all()
    np.testing.assert_allclose(measure(a, a), 1, atol=2e-3)
    np.testing.assert_allclose(measure(a, -a), -measure(a, a), atol=1e-12)


@pytest.mark.parametrize("measure", MEASURES)
@pytest.mark.parametrize("poison", [float("nan"), float("inf"), 1e30])
def test_masked_pixels_have_no_influence_on_value_or_gradient(measure, poison):
    a, b = images()
    mask = random_mask()
    results = []
    for fill in (0.0, poison):
        x = torch.where(mask, a, fill).requires_grad_()
        y = torch.where(mask, b, fill).requires_grad_()
        value = measure(x, y, mask=mask)
        value.sum().backward()
        assert not x.grad[~mask].any()
        assert not y.grad[~mask].any()
        results.append((value.detach(), x.grad, y.grad))
    for clean, poisoned in zip(*results, strict=True):
        assert torch.equal(clean, poisoned)


@pytest.mark.parametrize("measure", MEASURES)
def test_a_full_mask_is_no_mask(measure):
    a, b = images()
    expected = measure(a, b)
    assert torch.equal(measure(a, b, mask=torch.ones_like(a, dtype=torch.bool)), expected)
    assert torch.equal(measure(a, b, mask=torch.ones(a.shape[1:], dtype=torch.bool)), expected)


@pytest.mark.parametrize("measure", MEASURES)
def test_views_do_not_mix(measure):
    a, b = images(views=3)
    together = measure(a, b)
    for view in range(3):
        one = slice(view, view + 1)
        np.testing.assert_allclose(measure(a[one], b[one]), together[one], rtol=1e-12)


@pytest.mark.parametrize("measure", MEASURES)
@pytest.mark.parametrize("masked", [False, True])
def test_gradcheck(measure, masked):
    a, b = images(views=1, height=14, width=15)
    mask = random_mask(views=1, height=14, width=15) if masked else None
    if mask is not None:
        mask[:, 3:] = True
        mask[0, 13, 14] = False
    a, b = a.clone().requires_grad_(), b.clone().requires_grad_()
    assert torch.autograd.gradcheck(lambda x, y: measure(x, y, mask=mask), (a, b), atol=1e-7)


@pytest.mark.parametrize("measure", MEASURES)
@pytest.mark.parametrize("level", [0.0, 0.1, 3e4])
@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_a_flat_image_scores_zero_with_a_finite_gradient(measure, level, dtype):
    a = torch.full((2, 19, 23), level, dtype=dtype, requires_grad=True)
    b = images()[1].to(dtype).requires_grad_()
    value = measure(a, b)
    value.sum().backward()
    np.testing.assert_allclose(value.detach(), 0, atol=1e-6)
    assert torch.isfinite(a.grad).all()
    assert torch.isfinite(b.grad).all()


@pytest.mark.parametrize("measure", MEASURES)
def test_an_image_with_nothing_to_use_scores_zero(measure):
    a, b = images()
    mask = torch.ones_like(a, dtype=torch.bool)
    mask[1] = False
    a, b = a.requires_grad_(), b.requires_grad_()
    value = measure(a, b, mask=mask)
    value.sum().backward()
    assert value[1] == 0
    assert not a.grad[1].any()
    assert not b.grad[1].any()
    assert torch.isfinite(a.grad).all()


@pytest.mark.parametrize("measure", [patch_ncc, gradient_ncc])
def test_small_contrast_on_a_large_offset_keeps_its_digits(measure):
    a, b = images()
    ramp = torch.linspace(0, 1, 23, dtype=torch.float64)[None, None]
    x, y = a + 1e3 * ramp, b + 1e3 * ramp
    np.testing.assert_allclose(measure(1e6 + x, 1e6 + y), measure(x, y), rtol=1e-5)


@pytest.mark.parametrize("measure", MEASURES)
def test_float32_agrees_with_float64(measure):
    a, b = images(height=64, width=70)
    value = measure(a.float(), b.float())
    assert value.dtype == torch.float32
    np.testing.assert_allclose(value, measure(a, b), atol=1e-5)


@pytest.mark.parametrize("measure", MEASURES)
def test_the_same_input_gives_the_same_bits(measure):
    a, b = images()
    assert torch.equal(measure(a, b), measure(a, b))


@pytest.mark.parametrize("blur_px", [0.7, 10.0])
@pytest.mark.parametrize("masked", [False, True])
def test_blurred_gradients_agree_with_the_definition(blur_px, masked):
    a, b = images(seed=5, height=30, width=33)
    used = np.ones(a.shape, bool)
    if masked:
        used[0, :5] = used[:, 12:14, 20] = used[1, :, -4:] = False
    place = np.arange(-2, 3)
    kernel = np.exp(-(place[:, None] ** 2 + place**2) / (2 * blur_px**2))
    kernel /= kernel.sum()

    def standardised(image, use):
        return np.where(use, (image - image[use].mean()) / image[use].std(), 0)

    expected = []
    for x, y, use in zip(a.numpy(), b.numpy(), used, strict=True):
        x, y = (convolve(standardised(image, use), kernel, mode="constant")[2:-2, 2:-2] for image in (x, y))
        whole = minimum_filter(use, 5)[2:-2, 2:-2]
        expected.append(slow_gradient_ncc(x, y, whole, 11))
    mask = torch.as_tensor(used)
    np.testing.assert_allclose(gradient_ncc(a, b, 11, mask, blur_px).numpy(), expected, rtol=1e-3)
    multiscale = 0.5 * (ncc(a, b, mask) + patch_ncc(a, b, 9, mask))
    gradients = gradient_ncc(a, b, 11, mask, blur_px)
    np.testing.assert_allclose(gmncc(a, b, mask, blur_px), 0.5 * multiscale + 0.5 * gradients)


def test_masked_pixels_have_no_influence_on_blurred_gradients():
    a, b = images()
    mask = random_mask()
    expected = gmncc(a, b, mask, 10.0)
    spoilt = torch.where(mask, a, 1e6)
    torch.testing.assert_close(gmncc(spoilt, b, mask, 10.0), expected)


def test_a_wide_blur_is_a_mean_and_a_narrow_one_is_none():
    image = torch.tensor(np.random.default_rng(0).normal(size=(1, 12, 9)))
    wide, narrow = (similarity.blurred(image, width)[0] for width in (1e3, 0.05))
    assert torch.equal(similarity.blurred(image, 0.0), image)
    torch.testing.assert_close(narrow, image[0, 2:-2, 2:-2])
    assert wide[0, 0] == pytest.approx(float(image[0, :5, :5].mean()), rel=1e-5)


@pytest.mark.parametrize(
    ("call", "word"),
    [
        (lambda a, b: gradient_ncc(a, b, 15, None, 10.0), "21 or more"),
        (lambda a, b: ncc(a, b[:1]), "shapes"),
        (lambda a, b: ncc(a[0], b[0]), "shapes"),
        (lambda a, b: ncc(a.long(), b.long()), "dtypes"),
        (lambda a, b: ncc(a, b, torch.ones(3, 3, dtype=torch.bool)), "mask"),
        (lambda a, b: ncc(a, b, torch.ones_like(a)), "mask"),
        (lambda a, b: patch_ncc(a, b, 20), "19 x 23"),
        (lambda a, b: gradient_ncc(a, b, 18), "20 or more"),
    ],
)
def test_wrong_arguments_are_refused(call, word):
    with pytest.raises(ValueError, match=word):
        call(*images())
