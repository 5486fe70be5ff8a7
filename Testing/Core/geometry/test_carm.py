"""C-arm and linear accelerator angles: directions that a radiographer would name, and round trips."""

import numpy as np
import pytest

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.carm import (
    PATIENT_POSITIONS,
    carm_angles,
    carm_extrinsic,
    equipment_to_patient,
    iec_axes,
    receptor_axes,
    view_from_axes,
    with_isocenter,
)

LEFT, BACK, HEAD = np.eye(3)


def source(extrinsic):
    return -extrinsic[:3, :3].T @ extrinsic[:3, 3]


def linac_view(gantry, distance, position="HFS", couch=0.0):
    """The extrinsic of a linear accelerator's image about the isocentre at the origin."""
    axes = (equipment_to_patient(position) @ axis for axis in iec_axes(gantry, couch))
    return view_from_axes(*axes, distance)[0]


def random_angles(seed, count=50):
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield rng.uniform(-179, 179), rng.uniform(-89, 89), rng.uniform(-179, 179), rng.normal(0, 200, 3)


def test_at_zero_the_beam_runs_from_the_back_to_the_chest():
    extrinsic = carm_extrinsic(0, 0, 700, (10, 20, 30))
    np.testing.assert_allclose(extrinsic[2, :3], -BACK, atol=1e-12)
    np.testing.assert_allclose(source(extrinsic), (10, 20 + 700, 30), atol=1e-9)


@pytest.mark.parametrize(
    ("primary", "secondary", "toward"),
    [(90, 0, LEFT), (-90, 0, -LEFT), (180, 0, BACK), (0, 90, HEAD), (0, -90, -HEAD)],
    ids=["LAO90", "RAO90", "under the table", "CRA90", "CAU90"],
)
def test_the_receptor_moves_to_the_side_that_the_angle_names(primary, secondary, toward):
    extrinsic = carm_extrinsic(primary, secondary, 700)
    np.testing.assert_allclose(extrinsic[2, :3], toward, atol=1e-12)


@pytest.mark.parametrize("sign", [1, -1])
def test_lao_moves_the_receptor_left_and_cra_toward_the_head(sign):
    assert sign * carm_extrinsic(sign * 30, 0, 700)[2, 0] > 0
    assert sign * carm_extrinsic(0, sign * 20, 700)[2, 2] > 0


def test_the_display_faces_the_patient_heads_up():
    columns, rows, beam = receptor_axes(0, 0)
    np.testing.assert_allclose(columns, LEFT)
    np.testing.assert_allclose(rows, -HEAD, atol=1e-15)
    extrinsic, mirrored = view_from_axes(columns, rows, beam, 700)
    assert mirrored
    np.testing.assert_allclose(extrinsic, carm_extrinsic(0, 0, 700), atol=1e-12)


def test_displayed_axes_are_perpendicular_units_seen_from_behind_the_receptor():
    for primary, secondary, _, _ in random_angles(0):
        axes = np.stack(receptor_axes(primary, secondary))
        np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(axes) == pytest.approx(-1)


def test_the_source_is_at_its_distance_and_the_isocenter_on_the_axis():
    for primary, secondary, turn, isocenter in random_angles(1):
        extrinsic = carm_extrinsic(primary, secondary, 742.5, isocenter, detector_rotation_deg=turn)
        assert np.linalg.norm(source(extrinsic) - isocenter) == pytest.approx(742.5)
        np.testing.assert_allclose(extrinsic @ [*isocenter, 1], [0, 0, 742.5, 1], atol=1e-9)
        assert np.linalg.det(extrinsic[:3, :3]) == pytest.approx(1)


@pytest.mark.parametrize("position", PATIENT_POSITIONS)
def test_angles_return_from_the_extrinsic(position):
    for primary, secondary, turn, isocenter in random_angles(2):
        extrinsic = carm_extrinsic(primary, secondary, 700, isocenter, position, detector_rotation_deg=turn)
        angles = carm_angles(extrinsic, position)
        got = (angles.primary_deg, angles.secondary_deg, angles.detector_rotation_deg)
        np.testing.assert_allclose(got, (primary, secondary, turn), atol=1e-6)


@pytest.mark.parametrize("secondary", [90, -90])
def test_straight_above_the_head_the_extrinsic_still_returns(secondary):
    extrinsic = carm_extrinsic(25, secondary, 700, detector_rotation_deg=-40)
    angles = carm_angles(extrinsic)
    again = carm_extrinsic(
        angles.primary_deg,
        angles.secondary_deg,
        700,
        detector_rotation_deg=angles.detector_rotation_deg,
    )
    np.testing.assert_allclose(again, extrinsic, atol=1e-7)


@pytest.mark.parametrize(
    ("position", "down", "head_end"),
    [
        ("HFS", BACK, HEAD),
        ("HFP", -BACK, HEAD),
        ("FFS", BACK, -HEAD),
        ("FFP", -BACK, -HEAD),
        ("HFDR", -LEFT, HEAD),
        ("HFDL", LEFT, HEAD),
        ("FFDR", -LEFT, -HEAD),
        ("FFDL", LEFT, -HEAD),
    ],
)
def test_patient_positions_turn_the_equipment_properly(position, down, head_end):
    rotation = equipment_to_patient(position)
    np.testing.assert_allclose(rotation @ (0, 1, 0), down)
    np.testing.assert_allclose(rotation @ (0, 0, 1), head_end)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3))
    assert np.linalg.det(rotation) == pytest.approx(1)


def test_a_tube_under_the_table_is_in_front_of_a_prone_patient():
    assert source(carm_extrinsic(0, 0, 700, patient_position="HFP"))[1] == pytest.approx(-700)
    assert source(carm_extrinsic(0, 0, 700, patient_position="HFDL"))[0] == pytest.approx(700)


def test_a_linear_accelerator_at_zero_shoots_down_and_shows_the_patient_as_seen_from_above():
    extrinsic = linac_view(0, 1000)
    np.testing.assert_allclose(source(extrinsic), (0, -1000, 0), atol=1e-9)
    np.testing.assert_allclose(extrinsic[:3, :3], [LEFT, -HEAD, BACK], atol=1e-12)


def test_a_gantry_at_90_stands_at_the_left_of_a_supine_patient_who_lies_head_first():
    np.testing.assert_allclose(source(linac_view(90, 1000)), (1000, 0, 0), atol=1e-9)
    np.testing.assert_allclose(source(linac_view(90, 1000, position="FFS")), (-1000, 0, 0), atol=1e-9)
    np.testing.assert_allclose(source(linac_view(90, 1000, position="HFP")), (-1000, 0, 0), atol=1e-9)


def test_turning_the_couch_counter_clockwise_brings_the_feet_to_the_right():
    # Couch at 90: the head, which was at the gantry, points to a viewer's left; the source at 90 sees the
    # feet.
    np.testing.assert_allclose(source(linac_view(90, 1000, couch=90)), (0, 0, -1000), atol=1e-9)


def test_rt_axes_are_right_handed_and_the_receptor_turns_counter_clockwise_from_the_source():
    rng = np.random.default_rng(3)
    for gantry, couch, receptor in rng.uniform(-180, 180, (30, 3)):
        axes = np.stack(iec_axes(gantry, couch, receptor))
        np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(axes) == pytest.approx(1)
    columns, rows, _ = iec_axes(0)
    turned, _, _ = iec_axes(0, receptor_deg=90)
    np.testing.assert_allclose(turned, -rows, atol=1e-12)
    assert columns @ turned == pytest.approx(0)


def test_moving_the_isocenter_keeps_the_view():
    for primary, secondary, _, isocenter in random_angles(4, 10):
        first = carm_extrinsic(primary, secondary, 650)
        np.testing.assert_allclose(
            with_isocenter(first, (0, 0, 0), isocenter),
            carm_extrinsic(primary, secondary, 650, isocenter),
            atol=1e-9,
        )


@pytest.mark.parametrize(
    "call",
    [
        lambda: carm_extrinsic(np.nan, 0, 700),
        lambda: carm_extrinsic(0, 400, 700),
        lambda: carm_extrinsic(0, 0, 0),
        lambda: carm_extrinsic(0, 0, 700, (0, np.inf, 0)),
        lambda: carm_extrinsic(0, 0, 700, patient_position="LFS"),
        lambda: carm_extrinsic(0, 0, 700, detector_rotation_deg=np.nan),
        lambda: iec_axes(np.inf),
        lambda: carm_angles(np.zeros((4, 4))),
    ],
)
def test_nonsense_is_refused_in_one_sentence(call):
    with pytest.raises(InputError) as error:
        call()
    assert "\n" not in str(error.value)
