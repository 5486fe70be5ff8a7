"""Pictures: PNG as other readers understand it, and colours of maps."""

import io
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib import image as matplotlib_image

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.options import Weighting
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.viewer.maps import displacement, volume_change, weight
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


@pytest.mark.parametrize("form", ["rigid", "mass", "epsilon"])
def test_weights_are_measured_in_the_frame_of_the_warp(form):
    """As published, where a structure went does not change its weights; by default they go with it."""
    labels = np.zeros((24, 24, 24), np.uint8)
    labels[8:16, 8:16, 2:6], labels[8:16, 8:16, 18:22] = 1, 2
    grid = np.diag([4.0, 4.0, 4.0, 1.0])

    def shown(frame, shift_mm):
        away = np.eye(4)
        away[0, 3] = shift_mm
        structures = {
            "still": SimpleNamespace(fixed_to_moving=np.eye(4)),
            "moved": SimpleNamespace(fixed_to_moving=away),
        }
        result = SimpleNamespace(
            transform=DisplacementField(np.zeros((*labels.shape, 3), np.float32), grid), structures=structures
        )
        content = SimpleNamespace(
            result=result, labels=Volume(labels, grid), weighting=Weighting(form, frame)
        )
        return weight(content, 1).values

    np.testing.assert_allclose(shown("fixed", 15.0), shown("fixed", 0.0), atol=1e-6)
    assert np.abs(shown("moving", 15.0) - shown("moving", 0.0)).max() > 0.1
    np.testing.assert_allclose(shown("moving", 0.0), shown("fixed", 0.0), atol=1e-6)
