"""Correlation by Fourier transform equals correlation by its definition."""

import numpy as np
import pytest

from PolyPoseLib.registration.cameras.template_match import MaskedMatcher


def direct(image, mask, template, weight, row, column):
    """Score and share with the template's middle at (row, column)."""
    half = template.shape[0] // 2
    terms = []
    for r in range(template.shape[0]):
        for c in range(template.shape[1]):
            y, x = row + r - half, column + c - half
            if 0 <= y < image.shape[0] and 0 <= x < image.shape[1] and mask[y, x]:
                terms.append((weight[r, c], template[r, c], image[y, x]))
    w, t, i = np.array(terms).T
    t = t - (weight * template).sum() / weight.sum()
    spread = (w * t**2).sum() * ((w * i**2).sum() - (w * i).sum() ** 2 / w.sum())
    centred = (w * t * i).sum()
    return centred / np.sqrt(spread + (1e-3 * weight.sum()) ** 2), w.sum() / weight.sum()


@pytest.mark.parametrize("seed", range(5))
def test_correlations_equal_their_definition(seed):
    rng = np.random.default_rng(seed)
    images, masks = rng.normal(size=(2, 20, 24)), rng.random((2, 20, 24)) > 0.1
    template, weight = rng.normal(size=(11, 11)), rng.random((11, 11))
    found = MaskedMatcher(images, masks, 5).best(template, weight, 0.3, np.array([0, 1]))
    for n in range(2):
        correlation, share = direct(
            images[n], masks[n], template, weight, int(found.row[n]), int(found.column[n])
        )
        assert found.correlation[n] == pytest.approx(correlation, abs=2e-3)
        assert found.share[n] == pytest.approx(share, abs=1e-3)


@pytest.mark.parametrize("seed", range(10))
def test_a_piece_of_the_image_is_found_where_it_was_cut(seed):
    rng = np.random.default_rng(seed)
    image = rng.normal(size=(40, 50))
    row, column = int(rng.integers(0, 40)), int(rng.integers(0, 50))
    padded = np.pad(image, 7)
    template = padded[row : row + 15, column : column + 15]
    weight = np.pad(np.ones(image.shape), 7)[row : row + 15, column : column + 15]
    found = MaskedMatcher(image[None], np.ones((1, 40, 50), bool), 7).best(
        template, weight, 0.3, np.array([0])
    )
    assert (int(found.row[0]), int(found.column[0])) == (row, column)
    assert found.correlation[0] > 0.9


def test_nothing_is_found_in_a_blocked_image():
    matcher = MaskedMatcher(np.ones((1, 20, 20)), np.zeros((1, 20, 20), bool), 3)
    found = matcher.best(np.random.default_rng(0).normal(size=(7, 7)), np.ones((7, 7)), 0.3, np.array([0]))
    assert found.correlation[0] == 0
    assert len(matcher.best(np.ones((7, 7)), np.zeros((7, 7)), 0.3, np.array([0])).correlation) == 1
