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
    oracle = abs(spearmanr(own.ravel(), other.ravel())[0])
    assert rank_correlation(own, other) == pytest.approx(oracle, abs=1e-9)


def test_a_negative_that_registration_inverted_is_the_same_picture():
    given, mask = picture(0), np.zeros((90, 110), bool)
    mask[10:80, 20:70] = True
    given[~mask] = given.max()  # a shutter
    assert rank_correlation(given, given.max() - given) > 0.999
    kept = np.where(mask, given[mask].max() - given, 0)  # as registration inverts
    assert rank_correlation(given, kept) > 0.999


def test_large_and_even_pictures_are_compared():
    large = picture(1, (1000, 700))
    assert rank_correlation(large, large**3) > 0.999
    even = np.ones((20, 30))
    assert rank_correlation(even, even) == 1 and rank_correlation(even, picture(0, (20, 30))) == 0
