"""A copy is told from another view by its fine detail, whatever was done to its grey levels."""

import numpy as np
import pytest
from scipy import ndimage
from sphere_views import SIZE, heap, view

from PolyPoseLib.similarity.same_picture import SAME_PICTURE, SAME_VIEW, detail_of, likeness

EVERYWHERE = np.ones((SIZE, SIZE), dtype=bool)


def alike(first, second, masks=(EVERYWHERE, EVERYWHERE)):
    return likeness(detail_of(first, masks[0]), detail_of(second, masks[1]))


def grey(image):
    return (image - image.min()) / np.ptp(image)


CHANGES = {
    "8 bits": lambda image: np.rint(255 * grey(image)),
    "inverted": lambda image: 1 - grey(image),
    "gamma": lambda image: grey(image) ** 0.6,
    "intensity": lambda image: np.exp(-image),
    "rescaled": lambda image: 1000 + 37 * image,
    "mirrored": lambda image: image[:, ::-1],
}


@pytest.mark.parametrize("change", CHANGES)
def test_a_copy_is_the_same_picture(change):
    for seed in range(3):
        image = view(heap(seed), seed=seed)
        assert alike(image, CHANGES[change](image))[0] > SAME_PICTURE


def test_a_copy_that_lost_its_noise_is_the_same_view():
    for seed in range(3):
        image = view(heap(seed), seed=seed)
        fine, coarse = alike(image, ndimage.gaussian_filter(image, 1.0))
        assert coarse > SAME_VIEW and fine < 1


@pytest.mark.parametrize("turn", [12, 30, 90])
def test_other_directions_are_other_views(turn):
    for seed in range(2):
        spheres = heap(seed)
        fine, coarse = alike(view(spheres, 0, seed=1), view(spheres, turn, seed=2))
        assert fine < 0.6 * SAME_PICTURE and coarse < 0.9 * SAME_VIEW


def test_what_is_masked_does_not_count():
    first, second = view(heap(0)), view(heap(1))
    letters = np.random.default_rng(5).random((60, SIZE)) * 50
    first[:60], second[:60] = letters, letters
    below = EVERYWHERE.copy()
    below[:60] = False
    assert max(alike(first, second, (below, below))) < 0.5
    nothing = np.zeros_like(below)
    nothing[0, 0] = True
    assert alike(first, first, (nothing, below)) == (0, 0)


def test_plain_pictures_and_other_sizes_have_nothing_in_common():
    plain = np.full((SIZE, SIZE), 3.0)
    assert alike(plain, plain) == (0, 0)
    small = np.ones((30, 40), dtype=bool)
    assert alike(view(heap(0)), np.random.default_rng(0).random((30, 40)), (EVERYWHERE, small)) == (0, 0)
