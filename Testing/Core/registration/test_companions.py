"""Bones that lie side by side: neighbouring ribs are companions, and stay together as far as that is likely."""

from itertools import pairwise

import numpy as np
import pytest
from chest_phantom import NUMBERS, chest

from PolyPoseLib.geometry.rigid import about, perturbation
from PolyPoseLib.registration.articulations import Articulation, ArticulationPrior, bone_clouds
from PolyPoseLib.registration.companions import POINTS, SIDE_MM, YIELDS_AT, find_companions


@pytest.fixture(scope="module", params=[1, -1])
def ribs(request):
    """Names, clouds and links of the phantom's bones, in both handednesses."""
    ct, structures, _ = chest(handedness=request.param)
    clouds = bone_clouds(structures, ct.affine)
    return structures.names, clouds, find_companions(clouds)


def test_neighbouring_ribs_of_a_side_are_companions_and_nothing_else(ribs):
    names, _, links = ribs
    found = {frozenset((names[link.first], names[link.second])) for link in links}
    expected = {
        frozenset(f"rib_{side}_{number}" for number in pair)
        for side in ("left", "right")
        for pair in pairwise(NUMBERS)
    }
    assert found == expected and len(links) == POINTS * len(expected)


def test_bones_with_a_joint_are_no_companions(ribs):
    _, clouds, links = ribs
    pair = links[0].first, links[0].second
    fewer = find_companions(clouds, [Articulation(*pair, links[0].point, 5.0)])
    assert len(fewer) == len(links) - POINTS
    assert pair not in {(link.first, link.second) for link in fewer}


def test_links_do_not_dilute_joints(ribs):
    names, clouds, links = ribs
    centres = np.array([cloud.mean(axis=0) for cloud in clouds])
    joint = Articulation(0, len(names) - 1, centres[0], 5.0)
    apart = np.stack([np.eye(4)] * len(names))
    apart[-1, :3, 3] = [0, 0, 3]
    alone, among = (
        ArticulationPrior(each, centres, range(len(names)), 1.0).cost(apart)
        for each in ([joint], [joint, *links])
    )
    assert among == pytest.approx(alone)


def test_links_lie_between_their_bones_and_along_all_of_them(ribs):
    _, clouds, links = ribs
    for link in links:
        for bone in (link.first, link.second):
            assert np.linalg.norm(clouds[bone] - link.point, axis=1).min() < SIDE_MM
    for first in range(0, len(links), POINTS):
        points = np.array([link.point for link in links[first : first + POINTS]])
        length = np.ptp(clouds[links[first].first], axis=0).max()
        assert np.linalg.norm(points[:, None] - points, axis=-1).max() > 0.6 * length


def test_a_rib_in_its_neighbours_place_costs_more_than_ribs_that_move_alike(ribs):
    names, clouds, links = ribs
    centres = np.array([cloud.mean(axis=0) for cloud in clouds])
    joint = Articulation(0, len(names) - 1, centres[0], 5.0)
    prior = ArticulationPrior([joint, *links], centres, range(len(names)), 1.0)
    rng = np.random.default_rng(0)
    poses = np.stack([np.eye(4)] * len(names))
    alike = poses.copy()
    alike[:] = about(perturbation(np.r_[rng.normal(0, 0.1, 3), rng.normal(0, 10, 3)]), centres[0])
    jumped = poses.copy()
    jumped[names.index("rib_left_4"), :3, 3] = [0, 0, 17]
    far = poses.copy()
    far[names.index("rib_left_4"), :3, 3] = [0, 0, 170]
    assert prior.cost(alike) == pytest.approx(0, abs=1e-12)
    most = 2 * YIELDS_AT**2  # two neighbours, each of which weighs as much as a joint
    assert 0.6 * most < prior.cost(jumped) < prior.cost(far) < most
