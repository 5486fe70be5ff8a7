"""Joint motions: signs that anatomy gives, formulas of the papers, invariances, and intervals against random draws."""

import numpy as np
import pytest
from joint_case import MIRROR, random_rigid, rigid, sequence_of, track_of
from scipy.spatial.transform import Rotation
from test_bone_axes import STANDING, named

from PolyPoseLib.data.tracking.joints import CONVENTIONS, Joint
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.rigid import about, perturbation, rigid_inverse
from PolyPoseLib.kinematics.conventions import CONVENTION_TABLE
from PolyPoseLib.kinematics.joint_motions import joint_motions

AXIS = {"front": (0, -1, 0), "head": (0, 0, 1), "right": (-1, 0, 0)}
"""Of a standing patient, LPS."""

ANATOMY = [
    # (convention, quantity, axis of the world about which the distal bone of the RIGHT side turns, sign)
    (
        "grood_suntay",
        "flexion",
        "right",
        -1,
    ),  # the foot goes back: a left-hand turn about the axis to the right
    ("grood_suntay", "adduction", "front", 1),  # the foot goes toward the midline, to the patient's left
    ("grood_suntay", "external_rotation", "head", -1),  # toes go to the right
    ("isb_hip", "flexion", "right", 1),
    ("isb_hip", "adduction", "front", 1),
    ("isb_hip", "internal_rotation", "head", 1),
    ("isb_ankle", "dorsiflexion", "right", 1),
    ("isb_ankle", "inversion", "front", 1),
    ("isb_ankle", "internal_rotation", "head", 1),
    ("isb_spine", "extension", "right", 1),
    ("isb_spine", "lateral_bending", "front", 1),
    ("isb_spine", "axial_rotation", "head", 1),
    ("isb_elbow", "flexion", "right", 1),
    ("isb_elbow", "carrying_angle", "front", 1),
    ("isb_elbow", "pronation", "head", 1),
    ("isb_wrist", "flexion", "right", 1),
    ("isb_wrist", "ulnar_deviation", "front", 1),
    ("isb_wrist", "pronation", "head", 1),
    ("generic", "about_z", "right", 1),
    ("generic", "about_x", "front", 1),
    ("generic", "about_y", "head", 1),
]


def mirrored_case(convention):
    """Landmarks of a left joint, the mirror image of the right one's."""
    points = {name: point * (-1, 1, 1) for name, point in named(*STANDING[convention]).items()}
    if convention in ("isb_hip", "isb_spine"):
        swap = {"left": "right", "right": "left"}

        def other(name):
            bone, short = name.split(".")
            first, _, rest = short.partition("_")
            return f"{bone}.{swap.get(first, first)}_{rest}"

        points = {other(name): point for name, point in points.items()}
    return points


def moved(turn, shift=(0, 0, 0), centre=(0, 0, 0)):
    """fixed_to_moving of a bone that the patient moved by a turn about a centre and a shift (from the CT)."""
    motion = rigid(turn, (0, 0, 0))
    motion = about(motion, np.asarray(centre, float))
    motion[:3, 3] += shift
    return rigid_inverse(motion)


def motion_of(convention, side, poses, landmarks=None, mirrored=False, **track):
    """The one joint's motion; poses: (F, 2, 4, 4)."""
    joint = Joint("j", "upper", "lower", convention, side)
    if landmarks is None:
        landmarks = mirrored_case(convention) if mirrored else named(*STANDING[convention])
    sequence = sequence_of([joint], landmarks, mirrored)
    (found,) = joint_motions(track_of(sequence, poses, **track), sequence)
    return found


@pytest.mark.parametrize("convention, quantity, axis, sign", ANATOMY)
def test_a_turn_in_anatomical_position_has_the_papers_sign_on_both_sides(convention, quantity, axis, sign):
    turn = Rotation.from_rotvec(np.radians(sign * 20) * np.array(AXIS[axis]))
    place = [each.name for each in CONVENTION_TABLE[convention].angles].index(quantity)
    expected = np.zeros(3)
    expected[place] = 20.0
    right = motion_of(convention, "right", [[np.eye(4), moved(turn)]])
    np.testing.assert_allclose(right.angles_deg[0], expected, atol=1e-9)
    mirror_turn = MIRROR @ moved(turn) @ MIRROR
    left = motion_of(convention, "left", [[np.eye(4), mirror_turn]], mirrored=True)
    np.testing.assert_allclose(left.angles_deg[0], expected, atol=1e-9)


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize(
    "axis, plane", [("front", 0.0), ("right", 90.0)], ids=["abduction", "flexion to the front"]
)
def test_the_arm_is_elevated_in_the_plane_that_the_isb_names(side, axis, plane):
    """Abduction moves the elbow away from the midline, flexion to the front; elevation is negative."""
    sign = -1 if axis == "front" else 1
    turn = Rotation.from_rotvec(np.radians(sign * 60) * np.array(AXIS[axis]))
    pose = moved(turn, centre=STANDING["isb_shoulder"][1]["head_center"])
    if side == "left":
        pose = MIRROR @ pose @ MIRROR
    found = motion_of("isb_shoulder", side, [[np.eye(4), pose]], mirrored=side == "left")
    np.testing.assert_allclose(found.angles_deg[0], (plane, -60, -plane), atol=1e-9)


@pytest.mark.parametrize(
    "convention, direction, quantity, sign",
    [
        ("grood_suntay", "right", "lateral", 1),
        ("grood_suntay", "front", "anterior", 1),
        ("grood_suntay", "head", "distraction", -1),
        ("isb_ankle", "head", "compression", 1),
        ("isb_hip", "head", "proximal", 1),
        ("isb_wrist", "right", "radial", 1),
        ("isb_wrist", "front", "volar", 1),
        ("isb_shoulder", "right", "lateral", 1),
        ("isb_shoulder", "front", "anterior", 1),
        ("isb_shoulder", "head", "superior", 1),
        ("generic", "front", "x", 1),
    ],
)
def test_a_shift_has_its_sign_on_both_sides(convention, direction, quantity, sign):
    tilt = Rotation.from_rotvec([0.0, 1e-9, 0.0])  # the arm hangs down: elevation 0 is gimbal lock
    poses = [[np.eye(4), moved(tilt)], [np.eye(4), moved(tilt, 5.0 * np.array(AXIS[direction]))]]
    place = [each.name for each in CONVENTION_TABLE[convention].translations].index(quantity)
    expected = np.zeros(3)
    expected[place] = 5.0 * sign
    for side, frames in (("right", poses), ("left", MIRROR @ np.array(poses) @ MIRROR)):
        found = motion_of(convention, side, frames, mirrored=side == "left")
        np.testing.assert_allclose(np.diff(found.translations_mm, axis=0)[0], expected, atol=1e-5)


def anywhere(seed, count=12, degrees=50.0):
    rng = np.random.default_rng(seed)
    return np.array([[random_rigid(rng, degrees), random_rigid(rng, degrees)] for _ in range(count)])


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize("seed", range(3))
def test_the_knee_follows_grood_and_suntays_formulas(side, seed):
    """Their dot products of unit vectors in the world; i, j, k to the right, front and head in their letters."""
    poses = anywhere(seed)
    found = motion_of("grood_suntay", side, poses, mirrored=side == "left")
    sign = 1.0 if side == "right" else -1.0
    for n, (femur, tibia) in enumerate(poses):
        # With landmarks that lie straight, the bones' axes in the CT are the patient's: only poses turn them.
        capital = [rigid_inverse(femur)[:3, :3] @ AXIS[each] for each in ("right", "front", "head")]
        small = [rigid_inverse(tibia)[:3, :3] @ AXIS[each] for each in ("right", "front", "head")]
        floating = np.cross(small[2], capital[0])
        floating /= np.linalg.norm(floating)
        flexion = np.arctan2(-floating @ capital[2], floating @ capital[1])
        adduction = sign * (np.pi / 2 - np.arccos(capital[0] @ small[2]))
        external = np.arctan2(-sign * floating @ small[0], floating @ small[1])
        np.testing.assert_allclose(
            np.exp(1j * np.radians(found.angles_deg[n])),
            np.exp(1j * np.array([flexion, adduction, external])),
            atol=1e-9,
        )
        origins = [axes.matrix[:3, 3] for axes in (found.proximal_axes, found.distal_axes)]
        ends = [
            rigid_inverse(pose) @ np.r_[origin, 1]
            for pose, origin in zip((femur, tibia), origins, strict=True)
        ]
        between = (ends[1] - ends[0])[:3]
        expected = (sign * between @ capital[0], between @ floating, -between @ small[2])
        np.testing.assert_allclose(found.translations_mm[n], expected, atol=1e-9)  # fmt: skip


@pytest.mark.parametrize("convention", CONVENTIONS)
@pytest.mark.parametrize("side", ["right", "left", "none"])
def test_angles_and_translations_make_the_relative_pose_again(convention, side):
    poses = anywhere(3)
    found = motion_of(convention, side, poses)
    table = CONVENTION_TABLE[convention]
    raw = found.angles_deg * np.array(table.angle_signs)
    turns = Rotation.from_euler(table.sequence.upper(), raw, degrees=True).as_matrix()
    near, far = found.proximal_axes.matrix, found.distal_axes.matrix
    relative = np.linalg.inv(near) @ poses[:, 0] @ np.linalg.inv(poses[:, 1]) @ far
    np.testing.assert_allclose(turns, relative[:, :3, :3], atol=1e-9)
    shifts = found.translations_mm * np.array(table.translation_signs)
    origin = relative[:, :3, 3]
    if table.along_joint:
        first = Rotation.from_euler("Z", raw[:, :1], degrees=True)
        axes = np.stack([np.tile([0.0, 0, 1], (len(raw), 1)), first.apply([1, 0, 0]), turns[:, :, 1]], axis=1)
        origin = np.einsum("fij,fj->fi", axes, origin)
    np.testing.assert_allclose(shifts, origin, atol=1e-9)


@pytest.mark.parametrize("convention", CONVENTIONS)
@pytest.mark.parametrize("landmarks", [True, False], ids=["landmarks", "inertia"])
def test_a_motion_of_the_whole_patient_changes_nothing(convention, landmarks):
    rng = np.random.default_rng(5)
    poses = anywhere(6)
    walked = poses @ np.array([random_rigid(rng, 170, 300) for _ in poses])[:, None]
    points = None if landmarks else {}
    spread = np.diag([1e-4, 2e-4, 3e-4, 0.1, 0.2, 0.3])
    one, other = (
        motion_of(convention, "right", each, points, covariances=spread) for each in (poses, walked)
    )
    for field in ("angles_deg", "translations_mm", "angles_95_deg", "translations_95_mm"):
        np.testing.assert_allclose(getattr(one, field), getattr(other, field), rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(one.since_first.points_mm, other.since_first.points_mm, atol=1e-6)
    assert np.isfinite(one.since_first.angles_95_deg).all()


@pytest.mark.parametrize("convention", CONVENTIONS)
@pytest.mark.parametrize("landmarks", [True, False], ids=["landmarks", "inertia"])
def test_a_mirrored_patient_has_the_same_angles_on_the_other_side(convention, landmarks):
    poses = anywhere(8)
    spread = np.diag([1e-4, 2e-4, 3e-4, 0.1, 0.2, 0.3])
    flip = np.diag([1, -1, -1, -1, 1, 1.0])  # rotation vectors and shifts, mirrored in the sagittal plane
    right = motion_of(convention, "right", poses, None if landmarks else {}, covariances=spread)
    left = motion_of(
        convention,
        "left",
        MIRROR @ poses @ MIRROR,
        None if landmarks else {},
        True,
        covariances=flip @ spread @ flip,
    )
    for field in ("angles_deg", "translations_mm", "angles_95_deg", "translations_95_mm"):
        np.testing.assert_allclose(getattr(left, field), getattr(right, field), rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(left.since_first.angles_deg, right.since_first.angles_deg, atol=1e-7)
    np.testing.assert_allclose(left.since_first.points_mm, right.since_first.points_mm, atol=1e-6)


@pytest.mark.parametrize("convention", CONVENTIONS)
@pytest.mark.parametrize("side", ["right", "left"])
def test_intervals_are_those_of_random_draws(convention, side):
    """Draws of both bones' errors, far from gimbal lock, spread as the intervals say and lie in 95 % of them."""
    rng = np.random.default_rng(11)
    turn = Rotation.from_rotvec(np.radians([25.0, 35.0, -20.0]))
    truth = np.array([random_rigid(rng), moved(turn) @ random_rigid(rng, 15)])
    scale = np.array([0.002] * 3 + [0.15] * 3)[:, None]
    roots = [scale * rng.normal(size=(6, 6)) for _ in range(2)]
    covariances = np.array([root @ root.T for root in roots])
    sequence = sequence_of([Joint("j", "upper", "lower", convention, side)], named(*STANDING[convention]))
    centroids = sequence.structures.centroids(sequence.ct.affine)
    draws = 4000
    poses = np.empty((draws + 1, 2, 4, 4))
    poses[0] = truth
    for bone in range(2):
        errors = rng.multivariate_normal(np.zeros(6), covariances[bone], draws)
        for n, error in enumerate(errors, start=1):
            poses[n, bone] = about(perturbation(error), centroids[bone]) @ truth[bone]
    (found,) = joint_motions(track_of(sequence, poses, covariances[None]), sequence)
    for values, halves in (
        (found.angles_deg, found.angles_95_deg),
        (found.translations_mm, found.translations_95_mm),
    ):
        errors = values[1:] - values[0]
        np.testing.assert_allclose(1.96 * errors.std(axis=0), halves[0], rtol=0.06)
        inside = (np.abs(errors) <= halves[0]).mean(axis=0)
        assert (inside > 0.93).all() and (inside < 0.97).all(), inside


def test_at_gimbal_lock_the_outer_angles_have_no_interval_worth_the_name_and_their_sum_still_holds():
    up = Rotation.from_rotvec(np.radians(89.9) * np.array(AXIS["front"]))
    spread = np.diag([1e-6] * 3 + [0.01] * 3)
    found = motion_of(
        "isb_hip", "right", [[np.eye(4), np.eye(4)], [np.eye(4), moved(up)]], covariances=spread
    )
    assert found.locked.tolist() == [False, True]
    assert found.angles_deg[1, 1] == pytest.approx(89.9)
    assert (
        found.angles_95_deg[0].max() < 0.3
        and found.angles_95_deg[1, [0, 2]].min() > 90 > found.angles_95_deg[1, 1]
    )
    exact = Rotation.from_rotvec(np.radians(90) * np.array(AXIS["front"]))
    locked = motion_of("isb_hip", "right", [[np.eye(4), moved(exact)]], covariances=spread)
    assert locked.locked[0] and (locked.angles_95_deg[0, [0, 2]] == 180).all()


def test_angles_are_counted_on_over_several_turns():
    turns = np.linspace(0, 800, 81)
    poses = [
        [np.eye(4), moved(Rotation.from_rotvec(np.radians(angle) * np.array(AXIS["right"])))]
        for angle in turns
    ]
    found = motion_of("isb_hip", "right", poses)
    np.testing.assert_allclose(found.angles_deg[:, 0], turns, atol=1e-8)


def test_lost_and_doubtful_frames():
    poses = anywhere(2, 4)
    doubts = [((), ()), (("blurred",), ()), ((), ("lost", "jump")), ((), ())]
    sources = [("forward", "forward")] * 3 + [("forward", "none")]
    found = motion_of("generic", "none", poses, doubts=doubts, sources=sources)
    assert found.doubtful.tolist() == [False, True, True, False]
    assert np.isnan(found.angles_deg).all(axis=1).tolist() == [False] * 3 + [True]
    assert np.isnan(found.translations_95_mm).all(axis=1).tolist() == [False] * 3 + [True]
    assert np.isnan(found.since_first.angles_deg).tolist() == [False] * 3 + [True]
    assert not found.locked[3]
    nothing = motion_of("generic", "none", poses, sources=[("none", "none")] * 4)
    assert np.isnan(nothing.angles_deg).all() and np.isnan(nothing.since_first.angles_deg).all()


def test_without_joints_every_structure_is_described_relative_to_the_reference():
    sequence = sequence_of(names=("pelvis", "femur_left"))
    (found,) = joint_motions(track_of(sequence, anywhere(1, 5)), sequence)
    joint = found.joint
    assert (joint.name, joint.proximal, joint.convention, joint.side) == (
        "femur_left",
        "pelvis",
        "generic",
        "left",
    )
    assert found.proximal_axes.source == found.distal_axes.source == "inertia"
    np.testing.assert_allclose(found.seconds, np.arange(5) / 50.0)


@pytest.mark.parametrize(
    "fields, sentence",
    [
        ({"name": " "}, '"name" of 1 to 100'),
        ({"convention": "isb_knee"}, 'convention "isb_knee" is not known'),
        ({"side": "lef"}, 'did you mean "left"'),
        ({"distal": "upper"}, 'are both "upper"'),
    ],
)
def test_wrong_joints_are_refused(fields, sentence):
    with pytest.raises(InputError, match=sentence):
        Joint(**{"name": "j", "proximal": "upper", "distal": "lower", **fields})


def test_joints_of_other_bones_or_with_one_name_are_refused():
    with pytest.raises(InputError, match='no structure "femur"'):
        sequence_of([Joint("j", "upper", "femur")])
    with pytest.raises(InputError, match='Two joints have the name "j"'):
        sequence_of([Joint("j", "upper", "lower"), Joint("j", "lower", "upper")])
