"""Walking, bending and opening the mouth turn bones by the angle that was asked, the way joints go."""

import numpy as np
import pytest
from simulation_phantom import HEAD_CENTRE, phantom

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.errors import InputError
from PolyPoseLib.simulation.limb_motions import GLIDE_MM, condyles
from PolyPoseLib.simulation.motion import apply, joint_order
from PolyPoseLib.simulation.named_motions import Anatomy, named_posture
from PolyPoseLib.simulation.simulate import SimulationOptions


def walker():
    """The phantom with a second femur, its mirror image."""
    ct, structures, _ = phantom()
    labels = structures.labels.copy()
    labels[(structures.labels[:, :, ::-1] == 2) & (labels == 0)] = 5
    mirrored = labels[:, :, ::-1] == 1
    labels[mirrored & (labels == 0)] = 1
    return Anatomy(Structures((*structures.names, "femur_right"), labels), ct.affine, "pelvis")


def skull():
    """A skull over a U-shaped jaw with two rising ends."""
    labels = np.zeros((30, 40, 40), np.int16)
    labels[20:, 5:35, 8:32] = 1
    labels[2:6, 5:30, 8:11] = labels[2:6, 5:30, 29:32] = labels[2:6, 3:6, 8:32] = 2
    labels[2:19, 27:31, 8:11] = labels[2:19, 27:31, 29:32] = 2
    affine = np.diag([3.0, 3.0, 3.0, 1.0])
    return Anatomy(Structures(("skull", "mandible"), labels), affine, "skull")


def angle_deg(matrix):
    return np.degrees(np.arccos(np.clip((np.trace(matrix[:3, :3]) - 1) / 2, -1, 1)))


def shift_of_lower_end(anatomy, posture, name):
    points = anatomy.points[name]
    end = points[points[:, 2] < points[:, 2].min() + 8].mean(0)
    return apply(posture.joints[name].moving_to_fixed, end) - end


@pytest.mark.parametrize("amplitude", [10.0, 45.0, 90.0])
def test_a_bent_hip_turns_about_the_head_and_lifts_the_knee(amplitude):
    ct, structures, _ = phantom()
    anatomy = Anatomy(structures, ct.affine, "pelvis")
    posture = named_posture("flexion", amplitude, anatomy, np.random.default_rng(0))
    motion = posture.joints["femur_left"].moving_to_fixed
    assert angle_deg(motion) == pytest.approx(amplitude, rel=0.03)
    assert np.linalg.norm(apply(motion, HEAD_CENTRE) - HEAD_CENTRE) < 3
    assert shift_of_lower_end(anatomy, posture, "femur_left")[1] < 0
    assert np.allclose(posture.joints["vertebrae_L5"].moving_to_fixed, np.eye(4))


def test_in_a_step_one_leg_goes_forwards_and_the_other_back():
    anatomy = walker()
    leading = set()
    for seed in range(6):
        posture = named_posture("gait", 30.0, anatomy, np.random.default_rng(seed))
        shifts = {s: shift_of_lower_end(anatomy, posture, f"femur_{s}")[1] for s in ("left", "right")}
        ahead = min(shifts, key=lambda side: shifts[side])
        behind = {"left": "right", "right": "left"}[ahead]
        assert shifts[ahead] < 0 < shifts[behind]
        assert posture.joints[f"femur_{ahead}"].rotation_deg == pytest.approx(30, rel=0.05)
        assert posture.joints[f"femur_{behind}"].rotation_deg == pytest.approx(10, rel=0.3)
        assert angle_deg(posture.joints["vertebrae_L4"].moving_to_fixed) == pytest.approx(5, rel=0.05)
        leading.add(ahead)
    assert leading == {"left", "right"}


def test_the_mouth_opens_downwards_about_the_condyles():
    anatomy = skull()
    posture = named_posture("jaw", 15.0, anatomy, np.random.default_rng(0))
    motion = posture.joints["mandible"].moving_to_fixed
    assert angle_deg(motion) == pytest.approx(15)
    points = anatomy.points["mandible"]
    chin = points[points[:, 1] < 12].mean(0)
    assert (apply(motion, chin) - chin)[2] < -10
    for condyle in condyles(points):
        assert 2 < np.linalg.norm(apply(motion, condyle) - condyle) < 11


def renamed(anatomy, **others):
    """The anatomy with other names for some of its structures."""
    structures = anatomy.structures
    names = tuple(others.get(name, name) for name in structures.names)
    anchor = others.get(anatomy.anchor, anatomy.anchor)
    return Anatomy(Structures(names, structures.labels), anatomy.affine, anchor)


@pytest.mark.parametrize("lower", ["mandible", "lower_jaw"])
def test_the_upper_jaw_stays(lower):
    anatomy = renamed(skull(), skull="upper_jaw", mandible=lower)
    labels = anatomy.structures.labels.copy()
    labels[25:] = 3
    names = (*anatomy.structures.names, "skull")
    whole = Anatomy(Structures(names, labels), anatomy.affine, "skull")
    assert list(named_posture("jaw", 15.0, whole, np.random.default_rng(0)).joints) == [lower]


def test_a_jaw_without_two_halves_is_refused():
    thin = skull().structures.labels.copy()
    thin[:20] = 0
    thin[2:6, 5:30, 20] = 2
    anatomy = Anatomy(Structures(("skull", "mandible"), thin), np.diag([3.0, 3.0, 3.0, 1.0]), "skull")
    with pytest.raises(InputError, match="mandible is one voxel wide"):
        named_posture("jaw", 15.0, anatomy, np.random.default_rng(0))


def test_condyles_glide_no_farther_than_at_the_widest():
    anatomy = skull()
    for seed in range(8):
        posture = named_posture("jaw", 40.0, anatomy, np.random.default_rng(seed)).joints["mandible"]
        glide = np.linalg.norm(apply(posture.moving_to_fixed, posture.joint) - posture.joint)
        assert 0.6 * GLIDE_MM < glide <= GLIDE_MM + 1e-9


def leg(anchor):
    """A femur under a pelvis, a tibia under it with a fibula beside."""
    labels = np.zeros((60, 20, 20), np.int16)
    labels[50:, 5:15, 5:15] = 1
    labels[30:49, 8:12, 8:12] = 2
    labels[2:29, 7:11, 10:15] = 3
    labels[4:32, 7:9, 6:8] = 4
    names = ("pelvis", "femur_left", "tibia_left", "fibula_left")
    return Anatomy(Structures(names, labels), np.diag([5.0, 5.0, 5.0, 1.0]), anchor)


def test_the_knee_bends_where_the_femur_is_the_anchor():
    posture = named_posture("flexion", 40.0, leg("femur_left"), np.random.default_rng(0))
    assert posture.joints["tibia_left"].rotation_deg == pytest.approx(40, rel=0.05)
    assert posture.joints["pelvis"].rotation_deg == 0


def test_the_fibula_goes_with_the_tibia_even_where_it_is_nearer():
    anatomy = leg("femur_left")
    assert dict(joint_order(anatomy.points, "femur_left"))["fibula_left"] == "tibia_left"
    joints = named_posture("flexion", 40.0, anatomy, np.random.default_rng(0)).joints
    assert np.allclose(joints["fibula_left"].moving_to_fixed, joints["tibia_left"].moving_to_fixed)


def test_femurs_are_found_with_the_side_before_or_behind():
    anatomy = renamed(walker(), femur_left="left femur", femur_right="Right femur")
    posture = named_posture("gait", 30.0, anatomy, np.random.default_rng(0))
    assert posture.joints["left femur"].rotation_deg > 5 and posture.joints["Right femur"].rotation_deg > 5


def test_ribs_turn_with_the_spine_and_the_sacrum_does_not():
    """Two bones beside the upper vertebra, of which one belongs to the pelvis."""
    anatomy = walker()
    labels = anatomy.structures.labels.copy()
    upper = np.argwhere(labels == 4)
    k, j = upper.mean(0).astype(int)[:2]
    labels[k, j, upper[:, 2].max() + 1 : upper[:, 2].max() + 6] = 6
    labels[k, j, upper[:, 2].min() - 5 : upper[:, 2].min()] = 7
    whole = Anatomy(
        Structures((*anatomy.structures.names, "ribs_left", "sacrum"), labels), anatomy.affine, "pelvis"
    )
    joints = named_posture("gait", 30.0, whole, np.random.default_rng(0)).joints
    assert joints["ribs_left"].parent == "vertebrae_L4"
    assert np.allclose(joints["ribs_left"].moving_to_fixed, joints["vertebrae_L4"].moving_to_fixed)
    assert np.allclose(joints["sacrum"].moving_to_fixed, np.eye(4))


@pytest.mark.parametrize(("motion", "anatomy"), [("flexion", walker), ("gait", walker), ("jaw", skull)])
def test_an_amplitude_of_zero_is_rest_and_the_generator_decides(motion, anatomy):
    anatomy = anatomy()
    still = named_posture(motion, 0.0, anatomy, np.random.default_rng(0))
    assert all(np.allclose(j.moving_to_fixed, np.eye(4), atol=1e-12) for j in still.joints.values())
    first, again = (named_posture(motion, None, anatomy, np.random.default_rng(4)) for _ in range(2))
    for name, joint in first.joints.items():
        assert np.array_equal(joint.moving_to_fixed, again.joints[name].moving_to_fixed)
        assert np.allclose(joint.moving_to_fixed[:3, :3] @ joint.moving_to_fixed[:3, :3].T, np.eye(3))
    assert first.soft is None
    assert all(joint.overlap is None for joint in first.joints.values())


@pytest.mark.parametrize(
    ("motion", "needs"),
    [("gait", "both femurs"), ("jaw", "the mandible"), ("breathing", "every rib"), ("flexion", "a femur")],
)
def test_an_anatomy_without_the_bones_is_refused_with_its_structures(motion, needs):
    labels = np.zeros((4, 4, 4), np.int16)
    labels[0], labels[2] = 1, 2
    anatomy = Anatomy(Structures(("skull", "clavicle_left"), labels), np.eye(4), "skull")
    with pytest.raises(
        InputError, match=f'"{motion}" needs .*{needs}.*: the structures are skull, clavicle_left'
    ):
        named_posture(motion, None, anatomy, np.random.default_rng(0))


@pytest.mark.parametrize(
    ("motion", "amplitude"), [("jaw", -1.0), ("jaw", 41.0), ("gait", float("nan")), ("breathing", 1e300)]
)
def test_amplitudes_of_no_body_are_refused(motion, amplitude):
    with pytest.raises(InputError, match=r"amplitude is .*: give a number of (mm|degrees) from 0 to"):
        named_posture(motion, amplitude, skull(), np.random.default_rng(0))
    with pytest.raises(
        InputError, match=r"^The simulation's amplitude is .*: give its motion as well, or leave it out"
    ):
        SimulationOptions(amplitude=amplitude)
    with pytest.raises(InputError, match="not known"):
        named_posture("sneezing", None, skull(), np.random.default_rng(0))
