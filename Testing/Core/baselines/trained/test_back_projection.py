"""A ball's shadow back-projects through the ball, and every node takes the pixel that a ray of its own meets."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from PolyPoseLib.baselines.trained.back_projection import back_projected
from PolyPoseLib.geometry.camera import Camera, intrinsics_matrix, look_at

ANGLES = st.floats(-3.1, 3.1)


def camera_at(azimuth, elevation=0.2, height=40, width=52, pitch=8.0):
    source = 700 * np.array([np.sin(azimuth) * np.cos(elevation), -np.cos(azimuth), np.sin(elevation)])
    return Camera(
        intrinsics_matrix(1000.0, pitch, height, width), look_at(source, (5.0, -3, 8)), height, width
    )


def shadow(camera, centre, radius):
    """Pixels whose ray passes within the radius of a point, by the ray's own equation."""
    image = np.zeros((camera.height, camera.width), np.float32)
    to_world = np.linalg.inv(camera.extrinsic)
    for row in range(camera.height):
        for column in range(camera.width):
            local = np.linalg.solve(camera.intrinsics, (column, row, 1.0))
            ray = to_world[:3, :3] @ local
            ray /= np.linalg.norm(ray)
            offset = centre - to_world[:3, 3]
            image[row, column] = np.linalg.norm(offset - (offset @ ray) * ray) < radius
    return image


@settings(max_examples=10)
@given(azimuth=ANGLES, x=st.floats(-40, 40), y=st.floats(-40, 40), z=st.floats(-40, 40))
def test_a_balls_shadow_back_projects_through_the_ball(azimuth, x, y, z):
    camera, centre = camera_at(azimuth, 0.2, 24, 26, 14.0), np.array([x, y, z])
    image = shadow(camera, centre, 30.0)
    line = np.mgrid[-80:81:16, -80:81:16, -80:81:16].reshape(3, -1).T.astype(float)
    values = back_projected(image, camera, line)
    source = np.linalg.inv(camera.extrinsic)[:3, 3]
    rays = (line - source) / np.linalg.norm(line - source, axis=1, keepdims=True)
    offset = centre - source
    distance = np.linalg.norm(offset - (rays @ offset)[:, None] * rays, axis=1)
    assert (values[distance < 14] == 1).all()  # a pixel is 10 mm wide there
    assert (values[distance > 46] == 0).all()
    assert (distance < 14).any() and (distance > 46).any()


@given(azimuth=ANGLES, row=st.integers(0, 39), column=st.integers(0, 51), depth=st.floats(300, 1500))
def test_a_point_on_a_pixels_ray_takes_its_value(azimuth, row, column, depth):
    camera = camera_at(azimuth)
    image = np.random.default_rng(0).normal(size=(40, 52)).astype(np.float32)
    local = np.linalg.solve(camera.intrinsics, (column, row, 1.0)) * depth
    point = np.linalg.inv(camera.extrinsic) @ (*local, 1.0)
    inner = 0 < row < 39 and 0 < column < 51
    value = back_projected(image, camera, point[:3])
    # On the outermost pixels rounding decides whether the point is inside.
    assert value == pytest.approx(image[row, column], abs=1e-4) or (not inner and value == 0)


def test_nothing_beyond_the_image_or_behind_the_source():
    camera = camera_at(0.0)
    image = np.ones((40, 52), np.float32)
    behind = camera.source - 50 * camera.axis
    beside = camera.source + 700 * camera.axis + 600 * camera.extrinsic[0, :3]
    ahead = camera.source + 700 * camera.axis
    assert back_projected(image, camera, np.stack([behind, beside, ahead])).tolist() == [0, 0, 1]
