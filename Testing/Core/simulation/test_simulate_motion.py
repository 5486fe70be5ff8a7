"""Joints are where the geometry says, and drawn postures keep the rules they promise."""

import numpy as np
import pytest
from simulation_phantom import HEAD_CENTRE, NAMES, phantom

from PolyPoseLib.errors import InputError
from PolyPoseLib.simulation.motion import (
    MAX_OVERLAP,
    ROTATION_RANGE_DEG,
    bone_kind,
    draw_motions,
    joint_centre,
    structure_points,
)


@pytest.fixture(scope="module")
def body():
    ct, structures, _ = phantom()
    return ct, structures


def angle_deg(matrix):
    return np.degrees(np.arccos(np.clip((np.trace(matrix[:3, :3]) - 1) / 2, -1, 1)))


def test_a_round_head_turns_about_its_centre(body):
    ct, structures = body
    points = structure_points(structures, ct.affine)
    centre = joint_centre("femur_left", points["femur_left"], points["pelvis"])
    assert np.linalg.norm(centre - HEAD_CENTRE) < 3


def test_a_vertebra_turns_about_the_gap_to_its_neighbour(body):
    ct, structures = body
    points = structure_points(structures, ct.affine)
    centre = joint_centre("vertebrae_L4", points["vertebrae_L4"], points["vertebrae_L5"])
    assert abs(centre[2] - 52) < 8 and np.linalg.norm(centre[:2]) < 5


def test_a_rib_turns_about_its_posterior_end():
    turn = np.linspace(0, np.pi, 200)
    rib = np.stack([90 * np.sin(turn), 60 * np.cos(turn), 0 * turn], axis=1)
    spine_and_sternum = np.array([[x, y, z] for x in (-5, 5) for y in (66, -64) for z in (-20, 0, 20)], float)
    assert joint_centre("rib_left_5", rib, spine_and_sternum)[1] > 55


@pytest.mark.parametrize("seed", range(6))
def test_postures_stay_in_their_ranges_and_bones_out_of_each_other(body, seed):
    ct, structures = body
    motions = draw_motions(structures, ct.affine, "pelvis", np.random.default_rng(seed), slide_mm=0.0)
    assert np.array_equal(motions["pelvis"].moving_to_fixed, np.eye(4))
    assert set(motions) == set(NAMES)
    for name, motion in motions.items():
        rotation = motion.moving_to_fixed[:3, :3]
        assert np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
        assert motion.overlap <= MAX_OVERLAP
        if name != "pelvis":
            low, high = ROTATION_RANGE_DEG[bone_kind(name)]
            assert angle_deg(motion.moving_to_fixed) <= high + 0.5
            assert angle_deg(motion.moving_to_fixed) >= 0.5 * low
    assert motions["vertebrae_L4"].parent == "vertebrae_L5"
    assert motions["vertebrae_L5"].parent == "pelvis"


def test_without_slide_the_joint_stays_where_the_parent_puts_it(body):
    ct, structures = body
    motions = draw_motions(structures, ct.affine, "pelvis", np.random.default_rng(3), slide_mm=0.0)
    for motion in motions.values():
        parent = motions[motion.parent].moving_to_fixed
        joint = np.append(motion.joint, 1)
        assert np.allclose(motion.moving_to_fixed @ joint, parent @ joint, atol=1e-9)


def test_the_seed_decides_and_scale_zero_is_rest(body):
    ct, structures = body
    first, second, other = (
        draw_motions(structures, ct.affine, "pelvis", np.random.default_rng(seed)) for seed in (1, 1, 2)
    )
    for name in NAMES[1:]:
        assert np.array_equal(first[name].moving_to_fixed, second[name].moving_to_fixed)
        assert not np.allclose(first[name].moving_to_fixed, other[name].moving_to_fixed)
    still = draw_motions(structures, ct.affine, "pelvis", np.random.default_rng(1), scale=0.0)
    assert all(np.allclose(motion.moving_to_fixed, np.eye(4), atol=1e-12) for motion in still.values())


def test_an_unknown_anchor_is_refused(body):
    ct, structures = body
    with pytest.raises(InputError, match="skull"):
        draw_motions(structures, ct.affine, "skull", np.random.default_rng(0))


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("femur_left", "limb"),
        ("lower_leg_right", "limb"),
        ("scapula_left", "girdle"),
        ("clavicula_right", "girdle"),
        ("ribs_left", "rib"),
        ("rib_left_4", "rib"),
        ("vertebrae_L5", "spine"),
        ("lumbar_spine", "spine"),
        ("pelvis", "other"),
    ],
)
def test_names_say_what_kind_of_bone_it_is(name, kind):
    assert bone_kind(name) == kind
