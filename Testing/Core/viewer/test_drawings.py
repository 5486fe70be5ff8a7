"""Ellipsoids of carried points on slices and X-rays, against their definition."""

import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
from matplotlib.path import Path as MplPath

from PolyPoseLib.data.carried import CHI2_95, CarriedPoints
from PolyPoseLib.geometry.camera import Camera, intrinsics_matrix, look_at
from PolyPoseLib.viewer import drawings
from PolyPoseLib.viewer.content import NamedPoints
from PolyPoseLib.viewer.planes import Frame

FRAME = Frame("coronal", 5.0, -50.0, -60.0, 100.0, 120.0)


def random_covariance(rng):
    root = rng.normal(size=(3, 3))
    return root @ root.T + 0.1 * np.eye(3)


def named(covariance, place=(1.0, 5.5, -3.0), name="p"):
    place = np.array([place])
    return NamedPoints(
        (name,), place - 2, CarriedPoints(place, covariance[None], ("femur",), np.array([True]))
    )


@pytest.mark.parametrize("seed", range(8))
def test_the_section_of_an_ellipsoid_lies_on_the_slice_and_on_the_ellipsoid(seed):
    rng = np.random.default_rng(seed)
    covariance, axis = random_covariance(rng), int(rng.integers(3))
    off = 0.7 * np.sqrt(CHI2_95 * covariance[axis, axis])
    ring = drawings._section(covariance, axis, off)
    np.testing.assert_allclose(ring[:, axis], -off)
    mahalanobis = np.einsum("ni,ij,nj->n", ring, np.linalg.inv(covariance), ring)
    np.testing.assert_allclose(mahalanobis, CHI2_95, rtol=1e-6)
    assert drawings._section(covariance, axis, 1.01 * np.sqrt(CHI2_95 * covariance[axis, axis])) is None


def ring_of(svg):
    """Points of the ring in a drawing."""
    path = re.search(r'<path d="M([^"]+)Z" fill="#ffffff"', svg)
    assert path is not None, svg
    return np.array([each.split() for each in path.group(1).split("L")], float)


@pytest.mark.parametrize("seed", range(5))
def test_the_ring_on_an_x_ray_holds_95_percent_of_where_the_point_may_be_seen(seed):
    rng = np.random.default_rng(seed)
    covariance, place = random_covariance(rng), rng.uniform(-20, 20, 3)
    camera = Camera(intrinsics_matrix(1000, 0.5, 400, 400), look_at((0, -800, 60), (0, 0, 0)), 400, 400)
    ring = ring_of(drawings.view_points(named(covariance, place), camera))
    pixels = camera.project(rng.multivariate_normal(place, covariance, 40000))
    assert MplPath(ring).contains_points(pixels).mean() == pytest.approx(0.95, abs=0.006)


def test_a_point_far_from_the_slice_is_not_drawn_and_one_without_interval_has_no_ring():
    unknown = np.full((3, 3), np.nan)
    assert "<text" in drawings.slice_points(named(unknown), FRAME, moved=True)
    assert "fill-opacity" not in drawings.slice_points(named(unknown), FRAME, moved=True)
    assert "<text" not in drawings.slice_points(named(unknown, (0, 40.0, 0)), FRAME, moved=True)


def test_names_are_text_and_drawings_are_xml():
    svg = drawings.slice_points(named(np.eye(3), name="</text><script>x</script>&"), FRAME, moved=True)
    root = ElementTree.fromstring(svg)
    assert [each.text for each in root.iter() if each.tag.endswith("text")] == ["</text><script>x</script>&"]
