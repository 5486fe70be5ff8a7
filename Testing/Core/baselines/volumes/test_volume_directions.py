"""Every package's field points from fixed to moving, in mm along x, y, z: a translation and a rotation tell."""

import dataclasses
import itertools
import warnings

import numpy as np
import pytest
from moved_volumes import ROTATION, TRANSLATION, body, errors, inner, moved_pair, moved_points

from PolyPoseLib.baselines.packages import is_installed
from PolyPoseLib.baselines.volumes.convexadam import FdkConvexAdam
from PolyPoseLib.baselines.volumes.elastix import FdkElastix
from PolyPoseLib.baselines.volumes.fireants import FdkFireAnts
from PolyPoseLib.baselines.volumes.greedy import FdkGreedy
from PolyPoseLib.data.benchmark.system import SystemSetting
from PolyPoseLib.errors import CancelledError

SYSTEMS = [
    pytest.param(FdkGreedy, id="greedy"),
    pytest.param(FdkConvexAdam, id="convexadam"),
    pytest.param(FdkFireAnts, id="fireants", marks=pytest.mark.long),
    pytest.param(FdkElastix, id="elastix", marks=pytest.mark.long),
]


def require(system):
    for module, package in zip(system.modules, system.needs, strict=True):
        if not is_installed(module.split(".")[0] if not module.startswith("itk.") else module):
            pytest.skip(f"{package} is not installed")


def wrong_conventions(vectors):
    """The same vectors (N, 3) with axes exchanged or signs changed, all 47 of them."""
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1, -1), repeat=3):
            if (order, signs) != ((0, 1, 2), (1, 1, 1)):
                yield vectors[:, order] * signs


@pytest.mark.parametrize("system", SYSTEMS)
@pytest.mark.parametrize("motion", [TRANSLATION, ROTATION], ids=["translation", "rotation"])
def test_direction_axes_and_units(system, motion, capfd):
    require(system)
    pair, truth = moved_pair(motion)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        field = system().register(pair, SystemSetting())
    found, at_rest = errors(field, pair, truth)
    assert found < (0.25 if motion is TRANSLATION else 0.65) * at_rest
    inside = inner(pair)
    vectors, expected = field.sample(pair.points()[inside]), truth[inside]
    others = [np.linalg.norm(each - expected, axis=1).mean() for each in wrong_conventions(vectors)]
    assert found < 0.9 * min(others)
    scales = [np.linalg.norm(factor * vectors - expected, axis=1).mean() for factor in (1 / 3, 3)]
    assert found < min(scales)
    assert capfd.readouterr().out == ""


@pytest.mark.parametrize("system", SYSTEMS)
def test_what_the_x_rays_do_not_show_does_not_matter(system):
    """Another body beside what is seen, which moved the other way: the mask says that it is none of the patient."""
    require(system)
    pair, truth = moved_pair(TRANSLATION)
    contrary = body(moved_points(pair.points(), ([0, 0, 0], -2 * np.array(TRANSLATION[1]))), seed=0)
    seen = np.ones(pair.fixed.shape, bool)
    seen[:, :, :16] = False
    fixed = np.where(seen, pair.fixed, contrary)
    near_the_edge = inner(pair) & seen
    near_the_edge[:, :, 26:] = False
    found = []
    for mask in (seen, np.ones_like(seen)):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            field = system().register(dataclasses.replace(pair, fixed=fixed, seen=mask), SystemSetting())
        off = field.sample(pair.points()[near_the_edge]) - truth[near_the_edge]
        found.append(np.linalg.norm(off, axis=1).mean())
    assert found[0] < 0.6 * np.linalg.norm(TRANSLATION[1])
    assert found[0] < 0.9 * found[1]


def test_a_cancelled_fit_stops_before_anything_is_computed():
    require(FdkGreedy)
    with pytest.raises(CancelledError):
        FdkGreedy().fit(None, SystemSetting(cancelled=lambda: True))
