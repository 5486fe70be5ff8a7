"""Names of view sets, and the views that are kept for scores."""

import numpy as np
import pytest

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.benchmark.readers import READERS
from PolyPoseLib.io.benchmark.view_sets import HELD_OUT_DEGREES, PAPER_VIEWS, view_sets


def test_a_half_turn_leaves_out_its_end_and_a_limited_angle_does_not():
    sets = {each.name: each.angles_deg for each in view_sets(["2x30", "2x180", "3x180", "4x360", "1x0"], "x")}
    assert sets["2x30"] == (0, 30) and sets["2x180"] == (0, 90) and sets["3x180"] == (0, 60, 120)
    assert sets["4x360"] == (0, 90, 180, 270) and sets["1x0"] == (0,)


@pytest.mark.parametrize("views", PAPER_VIEWS)
def test_no_set_of_the_paper_sees_a_held_out_view(views):
    (each,) = view_sets([views], "x")
    assert len(each.angles_deg) == int(views[0]) and each.held_out_deg == HELD_OUT_DEGREES
    apart = np.abs(np.subtract.outer(each.angles_deg, each.held_out_deg)) % 180
    assert np.minimum(apart, 180 - apart).min() >= 3.9


def test_a_held_out_view_beside_a_given_one_or_its_opposite_is_dropped():
    (each,) = view_sets(["2x190"], "x")
    assert 10.0 not in each.held_out_deg and len(each.held_out_deg) == len(HELD_OUT_DEGREES) - 1


@pytest.mark.parametrize(
    "views", ["", "2", "x30", "0x30", "2x0", "2x400", "61x180", "2x-30", "2 x 30", "٢x30", "own", 2]
)
def test_other_names_are_refused(views):
    with pytest.raises(InputError, match=r'such as "2x30"'):
        view_sets([views], "headneck")


def test_every_reader_knows_its_own_views_and_no_others():
    for reader in READERS.values():
        assert all(reader.view_name(each) == each for each in reader.default_views)
    assert READERS["deepfluoro"].view_name("010+9") == "10+9"
    assert READERS["headneck"].view_name("02x30.0") == READERS["simulated"].view_name("2x030") == "2x30"
    for name, views in (
        ("deepfluoro", "2x30"),
        ("deepfluoro", "9+9"),
        ("headneck", "own"),
        ("thoraxcbct", "2x999"),
    ):
        with pytest.raises(InputError, match=r"none|twice"):
            READERS[name].view_name(views)
