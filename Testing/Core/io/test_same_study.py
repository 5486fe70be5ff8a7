"""Which X-rays count as those of a result."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from scipy.stats import spearmanr

from PolyPoseLib.io.same_study import LEAST_CORRELATION, rank_correlation


def picture(seed, size=(90, 110)):
    return gaussian_filter(np.random.default_rng(seed).normal(size=size), 4) + 5


@pytest.mark.parametrize("seed", range(5))
def test_a_monotone_change_alters_nothing_and_another_picture_is_told(seed):
    own, other = picture(seed), picture(seed + 100)
    for change in (np.exp, np.sqrt, lambda values: 3 * values - 7, lambda values: np.rint(values * 1000)):
        assert rank_correlation(own, change(own)) > 0.999
    assert rank_correlation(own, other) < LEAST_CORRELATION
    assert rank_correlation(own, other) == pytest.approx(spearmanr(own.ravel(), other.ravel())[0], abs=1e-9)
    assert rank_correlation(own, -own) < -0.999


def test_large_and_even_pictures_are_compared():
    large = picture(1, (1000, 700))
    assert rank_correlation(large, large**3) > 0.999
    even = np.ones((20, 30))
    assert rank_correlation(even, even) == 1 and rank_correlation(even, picture(0, (20, 30))) == 0
