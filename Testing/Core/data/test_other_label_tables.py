"""Label tables of TotalSegmentator's other tasks with bones."""

import pytest

from PolyPoseLib.data.label_names import label_table, propose_structures, structure_of


def test_numbers_are_those_of_its_release():
    bones = label_table("totalsegmentator_appendicular_bones")
    assert bones == {
        1: "patella", 2: "tibia", 3: "fibula", 4: "tarsal", 5: "metatarsal", 6: "phalanges_feet",
        7: "ulna", 8: "radius", 9: "carpal", 10: "metacarpal", 11: "phalanges_hand",
    }  # fmt: skip
    teeth = label_table("totalsegmentator_teeth")
    assert (len(teeth), teeth[1], teeth[2]) == (77, "lower_jawbone", "upper_jawbone")
    assert all(f"fdi{number}" in teeth[number] for number in range(11, 19))
    spine = label_table("totalsegmentator_vertebrae_pp")
    assert (spine[1], spine[8], spine[24]) == ("vertebrae_C1", "vertebrae_T1", "vertebrae_L5")
    assert label_table("totalsegmentator_vertebrae_body")[1] == "vertebrae_body"


def test_every_bone_of_the_limbs_belongs_to_a_structure():
    table = "totalsegmentator_appendicular_bones"
    groups = propose_structures(label_table(table), table)
    assert sorted(label for labels in groups.values() for label in labels) == sorted(label_table(table))
    assert (groups["forearm"], groups["hand"], groups["foot"]) == ([7, 8], [9, 10, 11], [4, 5, 6])


@pytest.mark.parametrize(
    ("name", "structure"),
    [
        ("lower_left_canine_fdi33", "mandible"), ("upper_right_first_molar_pulp_fdi116", "skull"),
        ("teeth_lower", "mandible"), ("teeth_upper", "skull"), ("upper_jawbone", "skull"),
        ("lower jaw", "mandible"), ("upper_jaw", "skull"), ("left_maxillary_sinus", None),
        ("zygomatic_arch_right", "skull"), ("hyoid", "hyoid"), ("intervertebral_discs", None), ("crown", None),
        ("left_mandibular_incisive_canal_fdi103", None), ("head", None),
    ],
)  # fmt: skip
def test_teeth_move_with_their_jaw(name, structure):
    assert structure_of(name) == structure
