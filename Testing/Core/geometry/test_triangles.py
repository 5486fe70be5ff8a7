import numpy as np
import pytest
from scipy.spatial import Delaunay

from PolyPoseLib.geometry import triangles
from PolyPoseLib.geometry.triangles import covered


@pytest.mark.parametrize("seed", range(10))
def test_a_triangulated_hull_has_no_gap_and_ends_at_its_edge(seed, monkeypatch):
    monkeypatch.setattr(triangles, "AT_ONCE", 50)
    rng = np.random.default_rng(seed)
    points = rng.uniform((-20, -15), (70, 60), (int(rng.integers(4, 60)), 2))
    hull = Delaunay(points)
    column, row = np.meshgrid(np.arange(50), np.arange(40))
    inside = hull.find_simplex(np.stack([column, row], axis=-1)) >= 0
    assert np.array_equal(covered(points[hull.simplices], (40, 50)), inside)
    some = rng.permutation(hull.simplices)[: max(1, len(hull.simplices) // 2)]
    alone = np.zeros((40, 50), bool)
    for corners in points[some]:
        alone |= Delaunay(corners).find_simplex(np.stack([column, row], axis=-1)) >= 0
    assert np.array_equal(covered(points[some], (40, 50)), alone)


def test_triangles_without_area_or_beside_the_image_cover_nothing():
    flat = np.array(
        [[[1.0, 2], [5, 2], [9, 2]], [[3, 3], [3, 3], [3, 3]], [[3.5, 0.5], [3.5, 8.5], [3.5, 4.5]]]
    )
    assert not covered(flat, (10, 12)).any()
    assert not covered(
        np.array([[[20.0, 0], [30, 0], [20, 30]], [[-9, -9], [-1, -9], [-9, -1]]]), (10, 12)
    ).any()
    assert not covered(np.zeros((0, 3, 2)), (10, 12)).any()
