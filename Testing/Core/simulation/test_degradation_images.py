"""Processing and detector of degraded X-rays: laws they must obey."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from PolyPoseLib.geometry.camera import Camera, intrinsics_matrix, look_at
from PolyPoseLib.simulation.degradations.degraded_case import View, stated_of
from PolyPoseLib.simulation.degradations.detector import measure_view
from PolyPoseLib.simulation.degradations.distortion import undistorted_pixels
from PolyPoseLib.simulation.degradations.processing import amplified, equalized
from PolyPoseLib.simulation.xray_physics import XrayPhysics, measure


def view_of(line, body=None, leaves=None):
    height, width = line.shape
    intrinsics = intrinsics_matrix(1000.0, 1.0, height, width)
    camera = Camera(intrinsics, look_at(np.array([0.0, -700, 0]), np.zeros(3)), height, width)
    return View(camera, line if body is None else body, line, line, stated_of(camera, 1000.0), leaves)


def smooth(seed=0, shape=(96, 96), scale=6.0):
    return scale * gaussian_filter(np.random.default_rng(seed).random(shape), 6, mode="wrap") * 2


def test_without_metal_and_leaves_the_detector_is_the_simulation_s():
    line, physics = smooth(), XrayPhysics()
    usual = measure(line, physics, np.random.default_rng(1))
    ours = measure_view(view_of(line), physics, np.random.default_rng(2))
    noise = np.exp(line.max() / 2) / np.sqrt(physics.photons)
    assert abs((ours - usual).mean()) < 3e-3 and (ours - usual).std() < 3 * noise


def test_metal_that_stops_everything_leaves_scatter_and_noise():
    body = np.full((64, 64), 3.0)
    line = body.copy()
    line[20:40, 20:40] += 50
    image = measure_view(view_of(line, body), XrayPhysics(), np.random.default_rng(0))
    behind = image[24:36, 24:36]
    assert np.isfinite(image).all() and behind.std() > 0.01
    assert 3.3 < np.median(behind) < 6


def test_leaves_lower_the_scatter():
    body = np.full((96, 96), 3.0)
    leaves = np.full_like(body, 2e-3)
    leaves[24:72, 24:72] = 1
    physics = XrayPhysics(photons=1e9, scatter_to_primary=1.0)
    closed, opened = (
        measure_view(view_of(body, leaves=some), physics, np.random.default_rng(0)) for some in (leaves, None)
    )
    assert closed[48, 48] > opened[48, 48] + 0.05


def test_equalisation_keeps_the_order_of_a_flat_image_s_levels_and_its_range():
    grey = np.clip(smooth(3, scale=0.5), 0, 1)
    out = equalized(grey.astype(np.float32))
    assert out.min() >= 0 and out.max() <= 1 + 1e-6
    assert np.corrcoef(np.argsort(np.argsort(out.ravel())), np.argsort(np.argsort(grey.ravel())))[0, 1] > 0.6
    wide = equalized(grey.astype(np.float32), clip_limit=1.0)
    assert wide.std() > out.std()


def test_multi_scale_processing_raises_weak_detail():
    grey = np.full((96, 96), 0.5)
    grey[:, 48:] = 0.9
    grey[20:30, 10:20] += 0.02
    before = grey[24, 14] - grey[60, 14]
    out = amplified(grey, 0.65, 0.3)
    assert out[24, 14] - out[60, 14] > 2 * before


@pytest.mark.parametrize(("pincushion", "turn"), [(0.06, 0.0), (0.0, 0.05), (0.06, -0.04)])
def test_distortion_is_what_it_is_called(pincushion, turn):
    shape = (121, 121)
    rows, columns = undistorted_pixels(shape, pincushion, turn)
    assert rows[60, 60] == pytest.approx(60) and columns[60, 60] == pytest.approx(60)
    half = 121 / 2
    ideal = ((columns - 60) + 1j * (rows - 60)) / half
    row, column = np.indices(shape)
    seen = ((column - 60) + 1j * (row - 60)) / half
    square = np.abs(ideal) ** 2
    inside = np.abs(seen) < 1
    again = ideal * (1 + pincushion * square) * np.exp(1j * turn * square)
    assert np.abs(again - seen)[inside].max() < 1e-6
    assert (np.abs(ideal) <= np.abs(seen) + 1e-9).all()
