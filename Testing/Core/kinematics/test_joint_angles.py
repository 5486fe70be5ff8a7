"""Angles of rotations: scipy's, put together again, unwrapped, and at gimbal lock."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from PolyPoseLib.kinematics.angles import LOCK_DEG, taken_apart, unwrapped_deg

SEQUENCES = ("zxy", "yxy")


def random_rotations(seed, count=200):
    return Rotation.random(count, random_state=seed)


@pytest.mark.parametrize("seed", range(3))
def test_cardan_angles_are_those_of_scipy(seed):
    rotations = random_rotations(seed)
    found = taken_apart(rotations.as_matrix(), "zxy").angles
    np.testing.assert_allclose(found, rotations.as_euler("ZXY"), atol=1e-10)


@pytest.mark.parametrize("seed", range(3))
def test_euler_angles_are_those_of_scipy_with_a_falling_second_one(seed):
    rotations = random_rotations(seed)
    found = taken_apart(rotations.as_matrix(), "yxy").angles
    first, second, third = rotations.as_euler("YXY").T
    other = np.stack([first + np.pi, -second, third + np.pi], axis=-1)
    np.testing.assert_allclose(np.exp(1j * found), np.exp(1j * other), atol=1e-9)
    assert (found[:, 1] <= 0).all() and (found[:, 1] >= -np.pi).all()


@pytest.mark.parametrize("sequence", SEQUENCES)
@pytest.mark.parametrize("seed", range(3))
def test_the_angles_make_the_rotation_again(sequence, seed):
    rotations = random_rotations(seed).as_matrix()
    angles = taken_apart(rotations, sequence).angles
    again = Rotation.from_euler(sequence.upper(), angles).as_matrix()
    np.testing.assert_allclose(again, rotations, atol=1e-12)


@pytest.mark.parametrize("sequence", SEQUENCES)
def test_a_small_change_of_one_angle_turns_about_its_axis(sequence):
    rng = np.random.default_rng(4)
    angles = rng.uniform((-3, -1.3, -3), (3, -0.2, 3), (50, 3))
    before = Rotation.from_euler(sequence.upper(), angles)
    axes = taken_apart(before.as_matrix(), sequence).axes
    for n in range(3):
        more = angles.copy()
        more[:, n] += 1e-6
        turn = (Rotation.from_euler(sequence.upper(), more) * before.inv()).as_rotvec() / 1e-6
        np.testing.assert_allclose(turn, axes[:, n], atol=1e-6)


@pytest.mark.parametrize("sequence, second", [("zxy", 90.0), ("zxy", -90.0), ("yxy", 0.0), ("yxy", -180.0)])
def test_gimbal_lock_is_said_and_still_gives_angles_of_the_rotation(sequence, second):
    angles = np.array([[20.0, -40.0, 35.0], [30.0, second, 50.0], [40.0, second + 0.5 * LOCK_DEG, 10.0]])
    rotations = Rotation.from_euler(sequence.upper(), angles, degrees=True).as_matrix()
    found = taken_apart(rotations, sequence)
    assert found.locked.tolist() == [False, True, True]
    again = Rotation.from_euler(sequence.upper(), found.angles).as_matrix()
    np.testing.assert_allclose(again, rotations, atol=1e-7)
    kept = 2 if sequence == "zxy" else 0
    assert found.angles[1, kept] == found.angles[0, kept]


@pytest.mark.parametrize("sequence, second", [("zxy", 90.0), ("yxy", 0.0)])
def test_lock_ends_at_its_limit(sequence, second):
    for margin, locked in ((LOCK_DEG - 0.01, True), (LOCK_DEG + 0.01, False)):
        rotation = Rotation.from_euler(sequence.upper(), [10, second - margin, 20], degrees=True).as_matrix()
        assert taken_apart(rotation[None], sequence).locked.tolist() == [locked]


def test_what_is_lost_stays_lost():
    rotations = random_rotations(0, 4).as_matrix()
    rotations[[0, 2]] = np.nan
    for sequence in SEQUENCES:
        found = taken_apart(rotations, sequence)
        assert np.isnan(found.angles).all(axis=1).tolist() == [True, False, True, False]
        assert np.isnan(found.axes).all(axis=(1, 2)).tolist() == [True, False, True, False]
        assert not found.locked[[0, 2]].any()


def test_other_sequences_are_refused():
    with pytest.raises(ValueError, match='"xyz"'):
        taken_apart(np.eye(3)[None], "xyz")


def test_angles_are_unwrapped_across_lost_frames():
    truth = np.linspace(-500, 700, 61)
    wrapped = (truth + 180) % 360 - 180
    wrapped[[5, 6, 30]] = np.nan
    found = unwrapped_deg(wrapped)
    assert np.isnan(found[[5, 6, 30]]).all()
    known = np.isfinite(found)
    np.testing.assert_allclose(np.diff(found[known]), np.diff(truth[known]), atol=1e-9)
    assert np.isnan(unwrapped_deg(np.full(3, np.nan))).all()
