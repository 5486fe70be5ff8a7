"""Axes of bones, from landmarks and from inertia."""

import numpy as np
import pytest
from joint_case import MIRROR, sequence_of
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.tracking.joints import CONVENTIONS, Joint
from PolyPoseLib.errors import InputError
from PolyPoseLib.kinematics.bone_axes import joint_axes, landmarks_of
from PolyPoseLib.kinematics.inertia_axes import inertia_axes, patient_axes
from PolyPoseLib.kinematics.joint_motions import axes_of_joints
from PolyPoseLib.kinematics.landmark_axes import RECIPES

STANDING = {
    # A right leg and arm in anatomical position, LPS: x to the patient's left, y to the back, z to the head.
    "grood_suntay": (
        {
            "hip_center": (-90, 0, 900),
            "medial_epicondyle": (-50, 0, 500),
            "lateral_epicondyle": (-130, 0, 500),
        },
        {"medial_plateau": (-65, 0, 480), "lateral_plateau": (-115, 0, 480), "ankle_center": (-90, 0, 80)},
    ),
    "isb_hip": (
        {
            "left_asis": (120, -60, 990),
            "right_asis": (-120, -60, 990),
            "left_psis": (50, 80, 990),
            "right_psis": (-50, 80, 990),
        },
        {
            "hip_center": (-90, 0, 900),
            "medial_epicondyle": (-50, 0, 500),
            "lateral_epicondyle": (-130, 0, 500),
        },
    ),
    "isb_ankle": (
        {
            "medial_malleolus": (-60, 0, 80),
            "lateral_malleolus": (-120, 0, 80),
            "medial_plateau": (-65, 0, 480),
            "lateral_plateau": (-115, 0, 480),
        },
        {},
    ),
    "isb_spine": (
        {
            "superior_endplate": (0, 0, 30),
            "inferior_endplate": (0, 0, 0),
            "left_pedicle": (15, 20, 20),
            "right_pedicle": (-15, 20, 20),
        },
        {
            "superior_endplate": (0, 0, 70),
            "inferior_endplate": (0, 0, 40),
            "left_pedicle": (15, 20, 60),
            "right_pedicle": (-15, 20, 60),
        },
    ),
    "isb_shoulder": (
        {
            "acromial_angle": (-190, 60, 1400),
            "trigonum_spinae": (-80, 60, 1400),
            "inferior_angle": (-90, 60, 1270),
        },
        {
            "head_center": (-180, 20, 1380),
            "medial_epicondyle": (-150, 20, 1080),
            "lateral_epicondyle": (-210, 20, 1080),
        },
    ),
    "isb_elbow": (
        {
            "head_center": (-180, 20, 1380),
            "medial_epicondyle": (-150, 20, 1080),
            "lateral_epicondyle": (-210, 20, 1080),
        },
        {
            "ulnar_styloid": (-150, 20, 820),
            "radial_styloid": (-210, 20, 820),
            "elbow_center": (-150, 20, 1080),
        },
    ),
    "isb_wrist": (
        {
            "articular_ridge": (-190, 20, 830),
            "shaft_proximal": (-190, 20, 1000),
            "radial_styloid": (-210, 20, 822),
            "sigmoid_notch": (-175, 20, 830),
        },
        {"base_center": (-185, 20, 780), "head_center": (-185, 20, 720), "palmar_side": (-185, 0, 750)},
    ),
    "generic": (
        {"origin": (0, 0, 10), "y_axis": (0, 0, 30), "z_side": (-20, 0, 12)},
        {"origin": (0, 0, -10), "y_axis": (0, 0, 5), "x_side": (0, -20, -12)},
    ),
}


def named(upper, lower):
    points = {f"upper.{name}": np.array(point, float) for name, point in upper.items()}
    return points | {f"lower.{name}": np.array(point, float) for name, point in lower.items()}


def axes_of(convention, side, landmarks, mirrored=False):
    joint = Joint("j", "upper", "lower", convention, side)
    return joint_axes(sequence_of([joint], landmarks, mirrored), joint)


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_axes_of_a_standing_patient_are_the_patients_own(convention):
    """With landmarks that lie straight, x points to the front, y to the head and z to the side on either side."""
    side = "none" if convention == "isb_spine" else "right"
    landmarks = named(*STANDING[convention])
    right = axes_of(convention, side, landmarks)
    expected = np.array([[0, 0, -1], [-1, 0, 0], [0, 1, 0]])
    for axes in (right.proximal, right.distal):
        assert axes.source in ("landmarks", "neutral")
        np.testing.assert_allclose(axes.matrix[:3, :3], expected, atol=1e-9)
    if side == "none":
        return
    mirrored = {name: point * (-1, 1, 1) for name, point in landmarks.items()}
    if convention == "isb_hip":
        for stem in ("asis", "psis"):
            left, other = f"upper.left_{stem}", f"upper.right_{stem}"
            mirrored[left], mirrored[other] = mirrored[other], mirrored[left]
    left = axes_of(convention, "left", mirrored, mirrored=True)
    for one, other in ((right.proximal, left.proximal), (right.distal, left.distal)):
        np.testing.assert_allclose(other.matrix, MIRROR @ one.matrix, atol=1e-9)


@pytest.mark.parametrize("convention", CONVENTIONS)
@pytest.mark.parametrize("seed", range(3))
def test_axes_turn_with_the_landmarks_and_stay_orthonormal(convention, seed):
    rng = np.random.default_rng(seed)
    landmarks = {name: point + rng.normal(0, 4, 3) for name, point in named(*STANDING[convention]).items()}
    turn = Rotation.random(random_state=seed)
    turned = {name: turn.apply(point) for name, point in landmarks.items()}
    for side, hand in (("right", 1.0), ("left", -1.0), ("none", 1.0)):
        before, after = (axes_of(convention, side, points) for points in (landmarks, turned))
        for one, other in ((before.proximal, after.proximal), (before.distal, after.distal)):
            rotation = other.matrix[:3, :3]
            np.testing.assert_allclose(rotation, turn.as_matrix() @ one.matrix[:3, :3], atol=1e-9)
            np.testing.assert_allclose(rotation.T @ rotation, np.eye(3), atol=1e-12)
            assert np.linalg.det(rotation) == pytest.approx(hand)


def test_definitions_that_the_papers_state():
    """Planes and lines as worded in the papers, from landmarks that lie anywhere."""
    rng = np.random.default_rng(7)
    upper = {name: rng.normal(0, 100, 3) for name in ("left_asis", "right_asis", "left_psis", "right_psis")}
    lower = {name: rng.normal(0, 100, 3) for name in STANDING["isb_hip"][1]}
    hip = axes_of("isb_hip", "right", named(upper, lower))
    x, y, z = hip.distal.matrix[:3, :3].T
    middle = (lower["medial_epicondyle"] + lower["lateral_epicondyle"]) / 2
    np.testing.assert_allclose(np.cross(y, lower["hip_center"] - middle), 0, atol=1e-9)
    np.testing.assert_allclose(x @ (lower["medial_epicondyle"] - lower["hip_center"]), 0, atol=1e-9)
    assert z @ (lower["lateral_epicondyle"] - lower["medial_epicondyle"]) > 0
    np.testing.assert_allclose(hip.distal.matrix[:3, 3], lower["hip_center"])
    x, y, z = hip.proximal.matrix[:3, :3].T
    np.testing.assert_allclose(np.cross(z, upper["right_asis"] - upper["left_asis"]), 0, atol=1e-9)
    back = (upper["left_psis"] + upper["right_psis"]) / 2
    np.testing.assert_allclose(
        [y @ (upper["right_asis"] - back), y @ (upper["left_asis"] - back)], 0, atol=1e-9
    )
    np.testing.assert_allclose(
        hip.proximal.matrix[:3, 3], lower["hip_center"]
    )  # coincide in the neutral posture
    wrist = {name: rng.normal(0, 100, 3) for name in STANDING["isb_wrist"][0]}
    axes = axes_of("isb_wrist", "right", named(wrist, {}))
    _, y, z = axes.proximal.matrix[:3, :3].T
    np.testing.assert_allclose(np.cross(y, wrist["shaft_proximal"] - wrist["articular_ridge"]), 0, atol=1e-9)
    plane = np.cross(
        wrist["radial_styloid"] - wrist["articular_ridge"], wrist["sigmoid_notch"] - wrist["articular_ridge"]
    )
    assert abs(z @ plane) < 1e-9 * np.linalg.norm(plane)
    assert axes.distal.source == "neutral"
    np.testing.assert_allclose(axes.distal.matrix[:3, :3], axes.proximal.matrix[:3, :3])


def test_the_knee_takes_the_landmarks_that_are_there():
    upper, lower = STANDING["grood_suntay"]
    base = axes_of("grood_suntay", "right", named(upper, lower))
    moved = axes_of("grood_suntay", "right", named(upper | {"knee_center": (-90, 5, 490)}, lower))
    np.testing.assert_allclose(moved.proximal.matrix[:3, 3], (-90, 5, 490))
    condyles = {"medial_posterior_condyle": (-60, 30, 500), "lateral_posterior_condyle": (-120, 40, 500)}
    turned = axes_of("grood_suntay", "right", named(upper | condyles, lower))
    assert turned.proximal.matrix[:3, 2] @ base.proximal.matrix[:3, 2] < 0.995
    cut = {name: point for name, point in upper.items() if name != "hip_center"} | {
        "shaft_proximal": (-90, 0, 700)
    }
    short = {name: point for name, point in lower.items() if name != "ankle_center"} | {
        "shaft_distal": (-90, 0, 300)
    }
    axes = axes_of("grood_suntay", "right", named(cut, short))
    for one, other in ((axes.proximal, base.proximal), (axes.distal, base.distal)):
        np.testing.assert_allclose(one.matrix, other.matrix, atol=1e-12)


def test_missing_landmarks_are_told_and_inertia_stands_in():
    upper, lower = STANDING["grood_suntay"]
    del_one = {name: point for name, point in upper.items() if name != "medial_epicondyle"}
    axes = axes_of("grood_suntay", "right", named(del_one, lower))
    assert (axes.proximal.source, axes.distal.source) == ("inertia", "landmarks")
    first, second = axes.warnings
    assert (
        '"upper.medial_epicondyle" is missing' in first
        and 'the axes of "upper" are those of inertia' in second
    )
    none = axes_of("generic", "none", {})
    assert none.warnings == () and none.proximal.source == none.distal.source == "inertia"


@pytest.mark.parametrize(
    "landmarks, sentence",
    [
        ({"upper.hip_centre": (0, 0, 0)}, 'did you mean "hip_center"'),
        ({"uper.hip_center": (0, 0, 0)}, 'did you mean "upper"'),
        ({"hip_center": (0, 0, 0)}, "has no bone"),
        (
            named({"origin": (1, 2, 3), "y_axis": (1, 2, 3), "x_side": (4, 4, 4)}, {}),
            "coincide or lie on a line",
        ),
        (
            named({"origin": (1, 2, 3), "y_axis": (1, 2, 9), "x_side": (1, 2, 40)}, {}),
            "coincide or lie on a line",
        ),
        (
            named({"origin": (1, 2, 3), "y_axis": (1, np.nan, 9), "x_side": (1, 8, 4)}, {}),
            "coincide or lie on a line",
        ),
    ],
)
def test_wrong_landmarks_are_refused(landmarks, sentence):
    with pytest.raises(InputError, match=sentence):
        axes_of_joints(sequence_of(landmarks=landmarks))


def test_landmarks_are_found_by_the_whole_name_of_their_bone():
    points = {"femur.origin": 1, "femur_left.origin": 2, "femur.left.origin": 3}
    assert landmarks_of(points, "femur") == {"origin": 1}
    assert landmarks_of(points, "femur.left") == {"origin": 3}


def test_every_convention_has_its_recipes():
    assert tuple(RECIPES) == CONVENTIONS


def block(size, turn, spacing=1.0):
    """Points of a box of whole mm, turned."""
    grid = np.stack(np.meshgrid(*[np.arange(n) - (n - 1) / 2 for n in size], indexing="ij"), -1).reshape(
        -1, 3
    )
    return turn.apply(grid * spacing) + np.array([10, 20, 30])


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("side", ["left", "right", "none"])
def test_principal_axes_are_a_turned_boxs_edges_nearest_to_the_patients(seed, side):
    turn = Rotation.from_rotvec(np.random.default_rng(seed).uniform(-0.35, 0.35, 3))
    axes = inertia_axes(block((9, 15, 30), turn), side)
    edges = turn.as_matrix() @ patient_axes(side)
    np.testing.assert_allclose(axes.matrix[:3, :3], edges, atol=1e-9)
    np.testing.assert_allclose(axes.matrix[:3, 3], (10, 20, 30), atol=1e-9)
    assert axes.source == "inertia" and axes.note == ""


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_round_shaft_keeps_its_long_axis_and_takes_the_rest_from_the_patient(side):
    tilt = Rotation.from_rotvec([0.2, -0.1, 0.0])
    axes = inertia_axes(block((10, 10, 30), tilt), side)
    np.testing.assert_allclose(axes.matrix[:3, 1], tilt.apply([0, 0, 1]), atol=1e-9)
    spun = inertia_axes(block((10, 10, 30), tilt * Rotation.from_rotvec([0, 0, 0.7])), side)
    np.testing.assert_allclose(spun.matrix, axes.matrix, atol=1e-9)
    assert np.linalg.det(axes.matrix[:3, :3]) == pytest.approx(-1.0 if side == "left" else 1.0)
    assert np.abs(axes.matrix[:3, :3] - patient_axes(side)).max() < 0.25 and "alike" in axes.note
    flat = inertia_axes(block((20, 20, 4), tilt), side)
    np.testing.assert_allclose(flat.matrix[:3, 1], tilt.apply([0, 0, 1]), atol=1e-9)


def test_a_cube_has_the_patients_axes():
    axes = inertia_axes(block((9, 9, 9), Rotation.from_rotvec([0.3, 0.2, 0.4])), "none")
    np.testing.assert_allclose(axes.matrix[:3, :3], patient_axes("none"))
    assert "no axes of its own" in axes.note


def test_mirrored_bones_have_mirrored_axes_of_inertia():
    right, left = axes_of("generic", "right", {}), axes_of("generic", "left", {}, mirrored=True)
    for one, other in ((right.proximal, left.proximal), (right.distal, left.distal)):
        assert one.note == ""
        np.testing.assert_allclose(other.matrix[:3, :3], MIRROR[:3, :3] @ one.matrix[:3, :3], atol=1e-9)


@pytest.mark.parametrize("convention", ["grood_suntay", "isb_hip", "isb_ankle"])
@pytest.mark.parametrize("side", ["left", "none"])
def test_landmarks_of_the_other_side_are_warned_about(convention, side):
    """Of a right leg; signs would be those of its mirror image."""
    landmarks = named(*STANDING[convention])
    assert axes_of(convention, "right", landmarks).warnings == ()
    wrong = {name: point * (-1, 1, 1) for name, point in landmarks.items()} if side == "none" else landmarks
    if convention == "isb_hip":  # the pelvis has both sides; the femur's landmarks tell
        wrong = {name: point for name, point in wrong.items() if name.startswith("lower")}
    lines = [line for line in axes_of(convention, side, wrong).warnings if "patient's back" in line]
    assert len(lines) == 1 and f'"{side}"' in lines[0]


def test_a_side_that_is_not_the_names_is_warned_about():
    names = "femur_left", "tibia_left"
    for side, count in (("left", 0), ("none", 0), ("right", 2)):
        joint = Joint("knee", *names, "generic", side)
        warnings = joint_axes(sequence_of([joint], names=names), joint).warnings
        assert sum("named after the other" in line for line in warnings) == count
