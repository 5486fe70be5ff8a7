"""Slices: what is left, right, up and down on them, for volumes of any direction."""

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.viewer.planes import PLANES, SliceStack, sides

SIGNED = [
    (order, signs)
    for order in itertools.permutations(range(3))
    for signs in itertools.product((1, -1), repeat=3)
]
LETTERS = {"R": (0, -1), "L": (0, 1), "A": (1, -1), "P": (1, 1), "I": (2, -1), "S": (2, 1)}


def coordinates_volume(affine, shape=(5, 6, 7)):
    """Voxels that tell where they are: 1e4 x + 1e2 y + z, in rounded mm from the grid's middle."""
    volume = Volume(np.zeros(shape), affine)
    index = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1)[..., ::-1]
    points = volume.to_world(index)
    return volume.with_voxels(points @ [1e4, 1e2, 1.0])


@pytest.mark.parametrize(("order", "signs"), SIGNED)
def test_every_pixel_shows_the_voxel_at_its_place_whatever_the_directions(order, signs):
    affine = np.eye(4)
    affine[:3, :3] = (np.diag([2.0, 3.0, 4.0]) * signs)[list(order)]
    affine[:3, 3] = (-7, 11, 5)
    stack = SliceStack.from_volume(coordinates_volume(affine), -1)
    for plane in PLANES:
        assert stack.count(plane) > 1
        for index in range(stack.count(plane)):
            frame = stack.frame(plane, index)
            points = stack.points(frame)
            np.testing.assert_allclose(stack.picture(frame), points @ [1e4, 1e2, 1.0], atol=1e-6)


@pytest.mark.parametrize("plane", PLANES)
def test_letters_at_the_sides_are_where_the_patient_has_them(plane):
    stack = SliceStack.from_volume(coordinates_volume(np.diag([-2.0, -2.0, 3.0, 1.0])), -1)
    points = stack.points(stack.frame(plane, 1))
    ends = {"left": points[0, 0], "right": points[0, -1], "top": points[0, 0], "bottom": points[-1, 0]}
    opposite = {"left": "right", "right": "left", "top": "bottom", "bottom": "top"}
    for letter, side in zip(sides(plane), ("left", "right", "top", "bottom"), strict=True):
        axis, sign = LETTERS[letter]
        assert sign * (ends[side] - ends[opposite[side]])[axis] > 0, (plane, side, letter)


@pytest.mark.parametrize("plane", PLANES)
def test_marks_on_a_picture_fall_on_their_pixels(plane):
    stack = SliceStack.from_volume(coordinates_volume(np.diag([-2.0, 3.0, 4.0, 1.0])), -1)
    frame = stack.frame(plane, 2)
    points = stack.points(frame)
    height, width = points.shape[:2]
    place = frame.on_picture(points)
    column = (place[..., 0] - frame.left) / frame.width * width - 0.5
    row = (place[..., 1] - frame.top) / frame.height * height - 0.5
    expected = np.meshgrid(np.arange(width), np.arange(height))
    np.testing.assert_allclose(column, expected[0], atol=1e-9)
    np.testing.assert_allclose(row, expected[1], atol=1e-9)


def test_an_oblique_volume_is_resampled_to_the_patients_axes():
    affine = np.eye(4)
    affine[:3, :3] = Rotation.from_euler("xyz", (12, -8, 20), degrees=True).as_matrix() * 2.0
    volume = coordinates_volume(affine, (20, 22, 24))
    stack = SliceStack.from_volume(volume, -9e9)
    frame = stack.frame("axial", stack.count("axial") // 2)
    picture, points = stack.picture(frame), stack.points(frame)
    index = volume.to_index(points)
    inside = ((index > 0.01) & (index < np.array(volume.shape[::-1]) - 1.01)).all(axis=-1)
    assert inside.mean() > 0.2
    np.testing.assert_allclose(picture[inside], (points @ [1e4, 1e2, 1.0])[inside], rtol=1e-4, atol=2.0)


def test_an_index_beyond_the_ends_gives_the_slice_there():
    stack = SliceStack.from_volume(coordinates_volume(np.eye(4)), -1)
    assert stack.frame("axial", 999) == stack.frame("axial", stack.count("axial") - 1)
    assert stack.frame("axial", -3) == stack.frame("axial", 0)
