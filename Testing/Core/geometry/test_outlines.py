import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from PolyPoseLib.geometry.contours import filled
from PolyPoseLib.geometry.outlines import area, simplified, traced


@pytest.mark.parametrize("seed", range(12))
def test_outlines_enclose_just_the_pixels_above_the_level(seed):
    rng = np.random.default_rng(seed)
    shape = rng.integers(3, 60, 2)
    image = gaussian_filter(rng.normal(size=shape), rng.uniform(0.3, 4))
    level = float(np.quantile(image, rng.uniform(0.1, 0.9)))
    lines = traced(image, level)
    assert (image > level).any() and lines
    decided = np.abs(image - level) > 1e-3 * np.ptp(
        image
    )  # `filled` counts what is as good as on a line as inside
    assert decided.mean() > 0.95
    assert np.array_equal(filled(lines, image.shape)[decided], (image > level)[decided])


def test_a_disc_has_one_outline_of_its_radius_and_a_ring_one_more_that_runs_the_other_way():
    row, column = np.indices((80, 90))
    distance = np.hypot(row - 40.3, column - 41.6)
    (disc,) = traced(25 - distance, 0)
    assert np.abs(np.hypot(disc[:, 1] - 40.3, disc[:, 0] - 41.6) - 25).max() < 0.02
    ring = sorted(traced(5 - np.abs(distance - 20), 0), key=area)
    assert len(ring) == 2 and area(ring[0]) < 0 < area(ring[1])
    assert abs(area(disc)) == pytest.approx(np.pi * 25**2, rel=2e-3)


def test_what_reaches_the_edge_ends_where_the_pixels_end():
    (line,) = traced(np.ones((5, 7)), 0.5)
    assert line.min() == pytest.approx(-0.5) and np.allclose(line.max(axis=0), (6.5, 4.5))
    assert traced(np.zeros((5, 7)), 0.5) == []


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("tolerance", [0.05, 0.5, 3.0])
def test_simplified_outlines_stay_within_the_tolerance(seed, tolerance):
    rng = np.random.default_rng(seed)
    line = max(traced(gaussian_filter(rng.normal(size=(50, 60)), 3), 0.0), key=len)
    fewer = simplified(line, tolerance)
    assert 2 <= len(fewer) < len(line)
    ends = np.roll(fewer, -1, axis=0)
    along = ends - fewer
    share = ((line[:, None] - fewer) * along).sum(-1) / (along**2).sum(-1)
    nearest = fewer + np.clip(share, 0, 1)[..., None] * along
    assert np.linalg.norm(line[:, None] - nearest, axis=-1).min(axis=1).max() <= tolerance + 1e-9
