"""Motions over time: rigid, smooth, as far as was asked for, and back where they repeat."""

import numpy as np
import pytest
from chest_phantom import LABELS, chest
from knee_case import knee
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation
from simulation_phantom import phantom

from PolyPoseLib.errors import InputError
from PolyPoseLib.simulation.hinges import hinge_centre
from PolyPoseLib.simulation.motion import apply, rigid_about
from PolyPoseLib.simulation.motion_laws import MOTIONS, motion_over_time
from PolyPoseLib.simulation.motions_in_time import GivenMotion, Joint, JointedMotion, there_and_back
from PolyPoseLib.simulation.named_motions import Anatomy, named_posture


def knee_anatomy():
    return Anatomy(knee().structures, knee().ct.affine, "femur")


def moved(motion, amplitude=None, anatomy=None, seconds=None, times=(None, 4.0), seed=0):
    law = motion_over_time(motion, amplitude, anatomy or knee_anatomy(), times, np.random.default_rng(seed))
    return law.bones.at(np.linspace(0, 4, 41) if seconds is None else seconds)


def angles_deg(motions):
    return np.degrees(Rotation.from_matrix(motions.reshape(-1, 4, 4)[:, :3, :3]).magnitude()).reshape(
        motions.shape[:-2]
    )


@pytest.mark.parametrize("motion", ["flexion", "gait", "drawn", "still"])
@pytest.mark.parametrize("seed", range(3))
def test_every_motion_is_rigid_and_smooth(motion, seed):
    seconds = np.linspace(0, 4, 4001)
    motions = moved(motion, seconds=seconds, seed=seed)
    rotations = motions[..., :3, :3]
    assert np.allclose(rotations @ np.swapaxes(rotations, -1, -2), np.eye(3), atol=1e-9)
    assert np.allclose(np.linalg.det(rotations), 1)
    # Halving the step quarters second differences of what has two derivatives, and halves them at a kink.
    fine, coarse = (np.abs(np.diff(motions[::step], 2, axis=0)).max() for step in (2, 4))
    assert fine <= 0.3 * coarse + 1e-9


@pytest.mark.parametrize("degrees", [10.0, 60.0, 90.0])
@pytest.mark.parametrize("seed", range(3))
def test_a_knee_bends_as_far_as_was_asked_for(degrees, seed):
    motions = moved("flexion", degrees, seed=seed)
    bend = np.degrees(Rotation.from_matrix(motions[:, 1, :3, :3]).as_rotvec()[:, 0])
    assert bend[20] == pytest.approx(degrees, rel=0.05)
    assert np.allclose(motions[0], np.eye(4)) and np.allclose(motions[-1], np.eye(4), atol=1e-9)
    assert np.allclose(motions[:, 0], np.eye(4))
    patella = angles_deg(motions[:, 2])
    assert 0.4 * degrees < patella[20] < 0.9 * degrees


@pytest.mark.parametrize("seed", range(4))
def test_a_bending_knee_is_more_than_a_hinge(seed):
    motions = moved("flexion", 60.0, seed=seed)[:, 1]
    steps = np.linalg.inv(motions[:-1]) @ motions[1:]
    turns = Rotation.from_matrix(steps[:20, :3, :3]).as_rotvec()
    axes = turns / np.linalg.norm(turns, axis=1, keepdims=True)
    wander = np.degrees(np.arccos(np.clip(axes @ axes[10], -1, 1))).max()
    assert wander > 2  # a pure hinge has one axis
    along = np.einsum("fi,fi->f", axes, steps[:20, :3, 3])
    assert np.abs(along).max() > 0.01  # and no slide along it


@pytest.mark.parametrize("seed", range(3))
def test_bones_of_a_bending_knee_do_not_run_into_each_other(seed):
    anatomy = knee_anatomy()
    motions = moved("flexion", 60.0, seed=seed)
    tree = KDTree(anatomy.points["femur"])
    for frame in range(0, 21, 5):
        for bone, name in ((1, "tibia"), (2, "patella")):
            distance, _ = tree.query(apply(motions[frame, bone], anatomy.points[name]))
            assert (distance < 2.0).mean() < 0.01


def test_the_hinge_is_in_the_middle_of_a_round_end():
    rng = np.random.default_rng(0)
    for _ in range(5):
        centre, radius = rng.uniform(-20, 20, 3), rng.uniform(12, 25)
        box = np.stack(np.meshgrid(*[np.arange(-40, 41, 1.0)] * 3, indexing="ij"), -1).reshape(-1, 3)
        box[:, 2] += 15
        cylinder = (np.hypot(box[:, 1], box[:, 2]) < radius) & (np.abs(box[:, 0]) < 25)
        shaft = (np.hypot(box[:, 0], box[:, 1]) < radius / 2) & (box[:, 2] > 0)
        parent = box[cylinder | shaft] + centre
        below = (np.abs(box[:, 0]) < 20) & (np.abs(box[:, 1]) < 20) & (box[:, 2] < -radius - 3)
        bone = box[below] + centre
        found = hinge_centre(bone, parent, centre - [0, 0, radius])
        assert np.linalg.norm((found - centre)[1:]) < 1.5


def test_walking_repeats_after_a_stride_and_bends_the_knee_twice():
    seconds = np.linspace(0, 1.1, 111)
    motions = moved("gait", seconds=seconds)
    again = moved("gait", seconds=seconds + 2.2)
    assert np.allclose(motions, again, atol=1e-9)
    bend = np.degrees(Rotation.from_matrix(motions[:, 1, :3, :3]).as_rotvec()[:, 0])
    peaks = [n for n in range(1, 110) if bend[n] >= bend[n - 1] and bend[n] > bend[n + 1]]
    assert len(peaks) == 2 and bend[peaks[1]] > 50 > 25 > bend[peaks[0]] > 10


def test_legs_walk_half_a_stride_apart():
    ct, structures, _ = phantom()
    labels = structures.labels.copy()
    left = labels == 2
    mirrored = left[:, :, ::-1] & (labels == 0)
    labels[mirrored] = 5
    both = type(structures)((*structures.names, "femur_right"), labels)
    anatomy = Anatomy(both, ct.affine, "pelvis")
    seconds = np.linspace(0, 1.1, 23)[:-1]
    motions = moved("gait", anatomy=anatomy, seconds=seconds)
    first, second = (Rotation.from_matrix(motions[:, n, :3, :3]).as_rotvec()[:, 0] for n in (1, 4))
    assert np.allclose(np.roll(first, 11), second, atol=np.radians(4))
    assert np.ptp(np.degrees(first)) > 35


def test_breathing_goes_to_the_posture_of_that_breath_and_back():
    ct, structures, source = chest()
    anatomy = Anatomy(structures, ct.affine, structures.names[0], source.voxels, LABELS)
    posture = named_posture("breathing", 15.0, anatomy, np.random.default_rng(3))
    law = motion_over_time("breathing", 15.0, anatomy, (None, 9.0), np.random.default_rng(3))
    deep, rest = law.bones.at(np.array([2.0, 4.0]))
    for number, name in enumerate(structures.names):
        expected = posture.joints[name].moving_to_fixed if name in posture.joints else np.eye(4)
        assert np.allclose(deep[number], expected, atol=1e-9)
    assert np.allclose(rest, np.eye(4), atol=1e-9)
    assert np.allclose(law.soft_at(2.0).displacements, posture.soft.displacements)
    assert np.abs(law.soft_at(4.0).displacements).max() < 1e-9


def test_children_follow_their_parents():
    rng = np.random.default_rng(5)
    course = there_and_back(2.0)
    turns, slides, centres = rng.normal(0, 0.3, (2, 3)), rng.normal(0, 5, (2, 3)), rng.normal(0, 30, (2, 3))
    joints = {
        "a": Joint("base", centres[0], [(turns[0], course)], [(slides[0], course)]),
        "b": Joint("a", centres[1], [(turns[1], course)], [(slides[1], course)]),
    }
    motions = JointedMotion(("base", "a", "b"), joints).at(np.array([0.7]))[0]
    share = float(course(np.array([0.7]))[0])
    first, second = (
        rigid_about(c, share * t, share * s) for c, t, s in zip(centres, turns, slides, strict=True)
    )
    assert np.allclose(motions, [np.eye(4), first, first @ second])


def test_a_table_is_met_at_its_rows_and_even_between_them():
    rng = np.random.default_rng(1)
    rows = np.array(
        [[rigid_about(rng.normal(0, 20, 3), rng.normal(0, 0.4, 3), rng.normal(0, 9, 3))] for _ in range(5)]
    )
    centre = rng.normal(0, 40, (1, 3))
    motion = GivenMotion(("bone",), np.arange(5) / 10, rows, centre)
    assert np.allclose(motion.at(np.arange(5) / 10), rows)
    middle = motion.at(np.array([0.05]))[0, 0]
    ends = apply(rows[0, 0], centre[0]), apply(rows[1, 0], centre[0])
    assert np.allclose(apply(middle, centre[0]), np.mean(ends, axis=0))
    back, forth = (Rotation.from_matrix(each.T @ middle[:3, :3]).magnitude() for each in rows[:2, 0, :3, :3])
    assert back == pytest.approx(forth)
    assert np.allclose(motion.at(np.array([-1.0, 9.0])), rows[[0, -1]])


def test_what_the_anatomy_lacks_is_refused():
    with pytest.raises(InputError, match="rib"):
        moved("breathing")
    with pytest.raises(InputError, match="mandible"):
        moved("jaw")
    with pytest.raises(InputError, match="motion"):
        moved("dancing")
    with pytest.raises(InputError, match="amplitude"):
        moved("flexion", 500.0)
    assert "flexion" in MOTIONS
