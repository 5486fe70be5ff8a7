"""Metal in the patient's space appears where the cameras say, and is as thick as it is."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from PolyPoseLib.geometry.camera import Camera, intrinsics_matrix, look_at
from PolyPoseLib.simulation.degradations.lettering import draw_text, text_bitmap
from PolyPoseLib.simulation.degradations.solids import (
    Box,
    Ellipsoid,
    HalfBall,
    Rod,
    metal_line,
    path_lengths,
    wire,
)

CENTRE = np.array([12.0, -8.0, 30.0])


def beside(x, y, z):
    return CENTRE + np.array([x, y, z], dtype=float)


def cameras(pixels=120):
    intrinsics = intrinsics_matrix(1000.0, 200 / pixels, pixels, pixels)
    sources = ([0, -700, 0], [500, -500, 60], [-600, 0, -100])
    return [Camera(intrinsics, look_at(np.array(s, float), np.zeros(3)), pixels, pixels) for s in sources]


def middle(image):
    row, column = np.indices(image.shape)
    return np.array([(column * image).sum(), (row * image).sum()]) / image.sum()


@pytest.mark.parametrize("camera", cameras())
def test_a_ball_appears_where_the_camera_says(camera):
    line = metal_line([Ellipsoid.ball(CENTRE, 3.0)], 0.05, camera)
    assert np.allclose(middle(line), camera.project(CENTRE), atol=0.1)


def test_views_agree_on_where_a_wire_lies():
    start, end = CENTRE, beside(20, 25, -30)
    for camera in cameras():
        line = metal_line([Rod(start, end, 1.0)], 1.0, camera) > 0.2
        on_wire = camera.project(start + np.linspace(0.05, 0.95, 40)[:, None] * (end - start))
        assert line[tuple(np.rint(on_wire[:, ::-1]).astype(int).T)].all()


@pytest.mark.parametrize("camera", cameras())
@pytest.mark.parametrize(
    ("solid", "volume"),
    [
        (Ellipsoid.ball(CENTRE, 9.0), 4 / 3 * np.pi * 9.0**3),
        (Ellipsoid(CENTRE, np.diag([5.0, 8.0, 12.0])), 4 / 3 * np.pi * 5 * 8 * 12),
        (Rod(CENTRE, beside(10, 20, -15), 6.0), np.pi * 36 * np.sqrt(725)),
        (Box(CENTRE, Rotation.random(random_state=1).as_matrix() * [[7.0], [4.0], [11.0]]), 8 * 7 * 4 * 11),
        (HalfBall(CENTRE, 10.0, np.array([0.6, 0.0, 0.8])), 2 / 3 * np.pi * 1000),
    ],
)
def test_lengths_add_up_to_the_volume(camera, solid, volume):
    lengths = path_lengths([solid], camera).mean(axis=-1)
    depth = camera.depth(solid.bounds()[0])
    area = (depth / camera.intrinsics[0, 0]) * (depth / camera.intrinsics[1, 1])
    assert (lengths * area).sum() == pytest.approx(volume, rel=0.04)


def test_overlapping_metal_counts_once():
    camera = cameras()[0]
    ball, other = Ellipsoid.ball(CENTRE, 9.0), Ellipsoid.ball(beside(2, 0, 0), 9.0)
    one, twice, both = (path_lengths(some, camera) for some in ([ball], [ball, ball], [ball, other]))
    assert np.allclose(one, twice, atol=1e-3)
    assert both.max() < 18.5 and (both >= one - 1e-3).all()


def test_a_bent_wire_has_no_knots():
    camera = cameras()[0]
    bent = wire([CENTRE, beside(10, 0, 5), beside(20, 0, 4)], 1.0)
    assert path_lengths(bent, camera).max() < 2.2


def test_metal_stops_the_beam_but_hardens_it():
    camera = cameras()[0]
    thin, thick = (metal_line([Ellipsoid.ball(CENTRE, r)], 1.0, camera).max() for r in (0.6, 20.0))
    assert 0 < thin < 1.2 and 15 < thick < 40


def test_what_is_out_of_sight_leaves_no_trace():
    for camera in cameras():
        assert not metal_line(
            [Ellipsoid.ball(camera.source + 900 * camera.axis + [0, 0, 900], 5.0)], 1.0, camera
        ).any()


def test_letters_are_drawn_where_and_as_large_as_asked():
    image = draw_text((90, 120), "R", (40.0, 70.0), 21.0)
    rows, columns = np.nonzero(image > 0.5)
    assert abs(np.ptp(rows) + 1 - 21) <= 2 and abs(rows.mean() - 40) < 3 and abs(columns.mean() - 70) < 3
    assert image[rows.min() : rows.min() + 3].sum() > 0 and not image[:20].any()
    assert text_bitmap("R 10").shape == (7, 23)
    turned = draw_text((90, 120), "I", (40.0, 70.0), 21.0, 90.0)
    assert np.ptp(np.nonzero(turned > 0.5)[1]) > np.ptp(np.nonzero(turned > 0.5)[0])
