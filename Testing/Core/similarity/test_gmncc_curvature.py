"""The curvature of gmNCC against its second derivative."""

import numpy as np
import pytest
import torch
from scipy.ndimage import gaussian_filter

from PolyPoseLib.similarity.gmncc_curvature import gmncc_curvature
from PolyPoseLib.similarity.ncc import gmncc


def pictures(seed, unknowns=5, shape=(40, 44)):
    rng = np.random.default_rng(seed)
    images = gaussian_filter(rng.normal(size=(unknowns + 1, *shape)), (0, 2.5, 2.5))
    mask = np.ones(shape, bool)
    mask[:6, :9] = mask[25:31, 30:] = False
    return images[0], images[1:], mask


@pytest.mark.parametrize(("seed", "blur_px"), [(0, 0.0), (1, 0.0), (2, 0.0), (3, 10.0), (4, 1.2)])
def test_the_curvature_is_the_second_derivative_where_both_images_agree(seed, blur_px):
    image, slopes, mask = pictures(seed)
    target, use, directions = (torch.as_tensor(x) for x in (image[None], mask, slopes))

    def fall(x):
        moved = target + torch.tensordot(x, directions, 1)[None]
        return 1 - gmncc(moved, target, use, blur_px)[0]

    expected = torch.autograd.functional.hessian(fall, torch.zeros(5, dtype=torch.float64)).numpy()
    found = gmncc_curvature(image, mask, slopes, blur_px)
    assert np.abs(found - expected).max() < 0.01 * np.abs(expected).max()


def test_the_curvature_is_positive_and_blind_to_gain_and_masked_pixels():
    image, slopes, mask = pictures(4)
    found = gmncc_curvature(image, mask, slopes)
    assert np.linalg.eigvalsh(found).min() > 0
    louder = gmncc_curvature(3 * image + 2, mask, 3 * slopes)
    np.testing.assert_allclose(louder, found, rtol=1e-6)
    spoilt, changed = image.copy(), slopes.copy()
    spoilt[~mask], changed[:, ~mask] = 1e3, -1e3
    np.testing.assert_allclose(gmncc_curvature(spoilt, mask, changed), found, rtol=1e-9)
    blind = gmncc_curvature(image, mask, np.concatenate([slopes, image[None]]))
    assert abs(blind[-1, -1]) < 1e-3 * found.max()  # a change of gain changes nothing
