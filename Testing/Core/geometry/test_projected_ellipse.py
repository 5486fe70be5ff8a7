import numpy as np
import pytest
import random_camera

from PolyPoseLib.geometry.projected_ellipse import ellipse, half_axes, projected_covariances


@pytest.mark.parametrize("seed", range(6))
def test_ellipses_hold_95_percent_of_the_places_at_which_the_point_may_be(seed):
    rng = np.random.default_rng(seed)
    camera = random_camera.camera(seed)
    point = camera.source + camera.extrinsic[:3, :3].T @ [30.0, -20, 700]
    root = rng.normal(size=(3, 3))
    covariance = root @ root.T
    (flat,) = projected_covariances(camera, point[None], covariance[None])
    drawn = camera.project(rng.multivariate_normal(point, covariance, 40000))
    assert np.allclose(np.cov(drawn.T), flat, rtol=0.05, atol=0.05 * np.abs(flat).max())
    lengths, directions = half_axes(flat)
    place = (drawn - camera.project(point)) @ directions / lengths
    assert np.mean((place**2).sum(axis=1) <= 1) == pytest.approx(0.95, abs=0.01)
    line = ellipse(camera.project(point), flat)
    assert np.allclose((((line - camera.project(point)) @ directions / lengths) ** 2).sum(axis=1), 1)


def test_what_is_not_known_has_no_ellipse():
    camera = random_camera.camera(0)
    points = np.stack([camera.source - 5 * camera.axis, camera.source + 500 * camera.axis])
    covariances = np.stack([np.eye(3), np.full((3, 3), np.nan)])
    assert np.isnan(projected_covariances(camera, points, covariances)).all(axis=(1, 2)).all()
