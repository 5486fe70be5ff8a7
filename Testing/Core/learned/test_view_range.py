"""Random cameras stay in the range that they are drawn from, and fill it."""

import learned_phantom
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.standard_views import STANDARD_VIEWS, standard_view_rotation
from PolyPoseLib.learned.view_range import ViewRange

CENTRE = np.array([12.0, -30.0, 80.0])


@pytest.mark.parametrize("views", [("AP",), ("LL", "RAO"), tuple(STANDARD_VIEWS)])
def test_draws_stay_in_range_and_fill_it(views):
    wanted, rng = ViewRange(views, 750.0), np.random.default_rng(1)
    angles, offsets, distances, seen = [], [], [], set()
    for _ in range(600):
        view, extrinsic = wanted.draw(rng, CENTRE)
        seen.add(views[view])
        rotation = extrinsic[:3, :3]
        np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
        relative = rotation @ standard_view_rotation(views[view]).T
        angles.append(np.degrees(Rotation.from_matrix(relative).magnitude()))
        place = rotation @ CENTRE + extrinsic[:3, 3]
        offsets.append(np.linalg.norm(place[:2]))
        distances.append(place[2])
    assert seen == set(views)
    assert max(angles) <= 45 + 1e-9 and max(angles) > 42
    assert max(offsets) <= 100 and max(offsets) > 80
    assert min(distances) >= 0.8 * 750 - 100 and max(distances) <= 1.2 * 750 + 100
    assert np.ptp(distances) > 250


def test_range_follows_from_the_xrays():
    named = [learned_phantom.xray("AP"), learned_phantom.xray("LL"), learned_phantom.xray("AP")]
    assert ViewRange.of_xrays(named).views == ("AP", "LL")
    assert ViewRange.of_xrays([*named, learned_phantom.xray(None)]).views == tuple(STANDARD_VIEWS)
    assert 700 < ViewRange.of_xrays(named).distance_mm < 800


@pytest.mark.parametrize(
    ("views", "distance"), [((), 750.0), (("up",), 750.0), (("AP",), 110.0), (("AP",), float("nan"))]
)
def test_impossible_ranges_are_refused(views, distance):
    with pytest.raises(InputError):
        ViewRange(views, distance)
