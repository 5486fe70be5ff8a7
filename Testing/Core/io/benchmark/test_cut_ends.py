"""Where what is scored of a bone begins that an end of the CT cuts off."""

import numpy as np
import pytest
from cut_shaft import ASIDE, DOWN, GROUPS, LOWEST, REST, SHAFT, SPACING, UP, labels_in
from two_postures import SKULL, moved, rigid

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.io.benchmark.cut_ends import FARTHEST_MM, MARGIN_MM, cut_at_ends

SIDE = LOWEST - SPACING / 2


def height(motion, later=LOWEST - 40):
    """mm above the CT's lower side where the shaft's scores begin."""
    _, ends = cut_at_ends(labels_in(), labels_in(motion, later), GROUPS)
    assert set(ends) == {"femur_left"}  # no end cuts the skull off
    (plane,) = ends["femur_left"]
    assert plane[:3] == pytest.approx((0, 0, -1))
    return -plane[3] - SIDE


@pytest.mark.parametrize(
    ("motion", "far"), [(REST, 0), (UP, 8), (DOWN, 8), (ASIDE, 20), (rigid((0, 0, 1), 0, (60.0, 0, 0)), 40)]
)
def test_the_farther_a_bone_has_moved_the_farther_from_the_end_it_is_scored(motion, far):
    assert height(motion) == pytest.approx(MARGIN_MM + far, abs=1.5 if far < 20 else 3)
    assert far <= FARTHEST_MM


def test_an_end_of_the_later_scan_is_no_surface():
    """A shaft that both scans cut off at one height has moved no farther for that."""
    assert height(UP, LOWEST) == pytest.approx(MARGIN_MM + 8, abs=1.5)
    assert height(UP, LOWEST + 20) == pytest.approx(MARGIN_MM + 8, abs=1.5)


def test_labels_end_at_the_plane_and_other_structures_nowhere():
    fixed = labels_in(UP, LOWEST - 40)
    kept, ends = cut_at_ends(labels_in(), fixed, GROUPS)
    k, _, _ = np.indices(fixed.shape)
    beyond = fixed.affine[2, 3] + SPACING * k < -ends["femur_left"][0, 3]
    expected = np.where((fixed.voxels == SHAFT) & beyond, 0, fixed.voxels)
    assert np.array_equal(kept.voxels, expected) and (kept.voxels == SHAFT).any()
    assert np.array_equal(kept.voxels == SKULL, fixed.voxels == SKULL)


def test_planes_are_those_of_the_patient_whatever_the_grids_orientation():
    turn = rigid((1, 2, 0.5), 35.0, (40.0, -20.0, 7.0))
    moving, fixed = labels_in(), labels_in(UP, LOWEST - 40)
    (straight,) = cut_at_ends(moving, fixed, GROUPS)[1]["femur_left"]
    flipped = moving.affine @ np.diag([-1.0, 1, -1, 1])
    flipped[:3, 3] = moving.to_world(np.array([moving.shape[2] - 1, 0, moving.shape[0] - 1]))
    turned = Volume(moving.voxels[::-1, :, ::-1], turn @ flipped)
    (plane,) = cut_at_ends(turned, Volume(fixed.voxels, turn @ fixed.affine), GROUPS)[1]["femur_left"]
    assert plane[:3] == pytest.approx(turn[:3, :3] @ straight[:3])
    point = np.array([3.0, 5.0, -straight[3]])  # on the plane
    assert plane[:3] @ moved(turn, point) == pytest.approx(plane[3])


def test_structures_of_one_scan_alone_are_passed_over():
    fixed = labels_in(UP)
    bare = fixed.with_voxels(np.where(fixed.voxels == SHAFT, 0, fixed.voxels))
    for first, second in ((labels_in(), bare), (bare, fixed)):
        kept, ends = cut_at_ends(first, second, GROUPS)
        assert not ends and np.array_equal(kept.voxels, second.voxels)
