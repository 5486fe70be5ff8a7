"""Walking, bending and opening the mouth turn bones by the angle that was asked, the way joints go."""

import numpy as np
import pytest
from simulation_phantom import HEAD_CENTRE, phantom

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.errors import InputError
from PolyPoseLib.simulation.limb_motions import condyles
from PolyPoseLib.simulation.motion import apply
from PolyPoseLib.simulation.named_motions import Anatomy, named_posture


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
    with pytest.raises(InputError, match="not known"):
        named_posture("sneezing", None, skull(), np.random.default_rng(0))
