"""Given cameras that cannot have taken their X-ray are refused, whatever the direction; sound ones pass."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.camera_checks import NARROW_DEG, check_camera, narrow_views, structure_points
from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.xray import Xray
from PolyPoseLib.errors import InputError

SHAPE = (40, 50)
BONES = np.random.default_rng(0).uniform(-30, 30, (200, 3)) + np.array([100, -200, 300])


def xray(seed=0, depth=700.0, aside=0.0, state="known", distance=1000.0):
    """A camera from a random direction whose axis passes the bones' centre at this depth, and so far aside."""
    extrinsic = np.eye(4)
    extrinsic[:3, :3] = Rotation.random(random_state=np.random.default_rng(seed)).as_matrix()
    extrinsic[:3, 3] = (aside, 0, depth) - extrinsic[:3, :3] @ (100, -200, 300)
    pitch = 4.0
    intrinsics = np.array([[distance / pitch, 0, 24.5], [0, distance / pitch, 19.5], [0, 0, 1]])
    blank = np.zeros(SHAPE, np.float32)
    return Xray(blank, blank == 0, intrinsics, extrinsic, state, (pitch, pitch), distance, name="one")


@pytest.mark.parametrize("state", ["known", "initial"])
def test_sound_cameras_pass(state):
    for seed in range(10):
        for depth in (200, 700, 960):
            assert check_camera(xray(seed, depth, state=state), BONES, BONES, True) is None


@pytest.mark.parametrize("state", ["known", "initial"])
@pytest.mark.parametrize(("depth", "sentence"), [(-700, "behind the X-ray"), (1100, "behind the detector")])
def test_a_patient_behind_source_or_detector_is_refused(state, depth, sentence):
    for seed in range(5):
        with pytest.raises(InputError, match=sentence):
            check_camera(xray(seed, depth, state=state), BONES, BONES, True)


def test_a_nominal_distance_refuses_nothing():
    assert check_camera(xray(depth=1500), BONES, BONES, False) is None


def test_an_image_at_the_isocentre_is_no_mistake():
    assert check_camera(xray(depth=1000), BONES, BONES, True) is None


def test_a_camera_that_looks_past_the_bones():
    for seed in range(5):
        with pytest.raises(InputError, match="looks past"):
            check_camera(xray(seed, aside=300), BONES, BONES, True)
        assert "looks past" in check_camera(xray(seed, aside=300, state="initial"), BONES, BONES, True)
        # The anchor may be out of sight where other bones are not.
        away = BONES + xray(seed).extrinsic[0, :3] * 300
        assert check_camera(xray(seed), away, BONES, True) is None


def turned(degrees):
    sound = xray()
    pose = sound.extrinsic.copy()
    pose[:3, :3] = Rotation.from_euler("y", degrees, degrees=True).as_matrix() @ pose[:3, :3]
    return Xray(
        sound.image, sound.mask, sound.intrinsics, pose, "known", sound.pixel_spacing_mm, 1000.0, name="two"
    )


def test_views_from_one_direction_are_flagged():
    for degrees in (0, 0.5 * NARROW_DEG, 2 * NARROW_DEG, 90):
        assert bool(narrow_views([xray(), turned(degrees)])) == (degrees < NARROW_DEG)
    assert not narrow_views([xray(), turned(0), turned(45)])
    assert not narrow_views([xray()])


def test_points_lie_in_their_structure_however_small_it_is():
    labels = np.zeros((90, 100, 130), np.int16)
    labels[10:70, 20:60, 30:90] = 1
    labels[80, 81, 121] = 2
    structures = Structures(("large", "small"), labels)
    affine = np.diag([-1.0, -1.0, 2.0, 1.0])
    affine[:3, 3] = (5, 6, 7)
    large = (structure_points(structures, affine, "large") - (5, 6, 7)) / (-1, -1, 2)
    assert len(large) > 500 and (large >= (30, 20, 10)).all() and (large <= (89, 59, 69)).all()
    np.testing.assert_allclose(structure_points(structures, affine, "small"), [[5 - 121, 6 - 81, 7 + 160]])
