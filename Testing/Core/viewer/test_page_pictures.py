"""Pictures: PNG as other readers understand it, and colours of maps."""

import io

import numpy as np
import pytest
from matplotlib import image as matplotlib_image

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.viewer.maps import displacement, volume_change
from PolyPoseLib.viewer.pictures import FOLD_COLOUR, Scale, png, rgb, windowed


@pytest.mark.parametrize("shape", [(3, 5), (1, 1), (7, 4, 3), (6, 9, 4)])
def test_a_png_holds_the_pixels(shape):
    pixels = np.random.default_rng(0).integers(0, 256, shape).astype(np.uint8)
    read = matplotlib_image.imread(io.BytesIO(png(pixels)), format="png")
    np.testing.assert_array_equal(np.rint(read * 255).astype(np.uint8), pixels)


def test_windows_run_from_black_to_white():
    values = np.array([-1e9, -300.0, 450.0, 1200.0, 1e9, np.nan])
    assert windowed(values, -300, 1200).tolist() == [0, 0, 128, 255, 255, 0]


def test_a_scale_gives_its_first_and_last_colour_at_its_ends_and_beyond():
    scale = Scale(0.5, 2.0, diverging=True, logarithmic=True)
    colours = scale.colours(np.array([0.1, 0.5, 1.0, 2.0, 9.0]))
    assert (colours[0] == colours[1]).all()
    assert (colours[3] == colours[4]).all()
    assert colours[0, 2] > colours[0, 0], "less than 1 is blue"
    assert colours[4, 0] > colours[4, 2], "more than 1 is red"
    assert scale.opacities(np.array([1.0, 2.0])).tolist() == [0, 255], "nothing covers what does not change"


def field(vectors):
    return DisplacementField(np.asarray(vectors, np.float32), np.diag([2.0, 2.0, 2.0, 1.0]))


def test_maps_hold_lengths_and_volume_changes():
    k, _, i = np.meshgrid(*[np.arange(8.0)] * 3, indexing="ij")
    shrinking = np.zeros((8, 8, 8, 3))
    shrinking[..., 0] = 2 * i * 0.25  # x grows by a quarter on the way to the CT
    change = volume_change(field(shrinking))
    np.testing.assert_allclose(change.values, 1.25, rtol=1e-5)
    shifted = np.zeros((8, 8, 8, 3))
    shifted[..., 1], shifted[..., 2] = 3, 4 * (k > 3)
    length = displacement(field(shifted))
    points = np.array([[[4.0, 4.0, 2.0], [4.0, 4.0, 12.0], [4.0, 4.0, 90.0]]])
    np.testing.assert_allclose(length.at(points)[0, :2], [3, 5])
    assert length.picture(points)[0, :, 3].tolist() == [255, 255, 0], "nothing is known beyond the grid"


def test_folds_have_a_colour_of_their_own():
    i = np.meshgrid(*[np.arange(8.0)] * 3, indexing="ij")[2]
    folding = np.zeros((8, 8, 8, 3))
    folding[..., 0] = -2 * 1.5 * i
    picture = volume_change(field(folding)).picture(np.full((1, 1, 3), 6.0))
    assert tuple(picture[0, 0]) == (*rgb(FOLD_COLOUR), 255)
