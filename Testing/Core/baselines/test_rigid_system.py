"""One motion of the whole CT: it finds a patient that was shifted, from a model's start when he was shifted far."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from moved_bones import moved_bones

from PolyPoseLib.baselines.rigid import Rigid, field_of, middle
from PolyPoseLib.data.benchmark.system import SystemSetting
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import CancelledError, InputError
from PolyPoseLib.geometry.camera import Camera


def shifted(seed, degrees=6.0, shift_mm=10.0):
    return moved_bones(seed, degrees, shift_mm, 0.3, pixels=40, spacing=7.0)


def fitted(seed):
    moved = shifted(seed)
    return moved, Rigid().fit(moved.study, SystemSetting())


@pytest.fixture(scope="module")
def found():
    return fitted(0)


@pytest.mark.parametrize("seed", [0, *(pytest.param(n, marks=pytest.mark.long) for n in (1, 2))])
def test_a_shifted_patient_is_found(seed, found):
    moved, motion = found if seed == 0 else fitted(seed)
    (error, overlap), (at_rest, overlap_at_rest) = moved.errors(motion), moved.errors()
    assert error < 0.2 * at_rest
    assert overlap > overlap_at_rest + 0.2
    # The anchor moved with the patient alone, so its motion is known exactly.
    true = np.linalg.inv(moved.shift)
    centre = moved.shift[:3, :3] @ middle(moved.study.ct) + moved.shift[:3, 3]
    off = motion.poses["pelvis"] - true
    assert np.linalg.norm(off[:3, :3] @ centre + off[:3, 3]) < 2.0


def test_the_field_is_the_motion_everywhere_in_the_ct(found):
    moved, motion = found
    assert set(motion.poses) == set(moved.study.structures.names)
    pose = motion.poses["femur_left"]
    assert motion.field.spacing.max() <= 4.0
    corners = np.array(np.meshgrid(*([-0.5, n - 0.5] for n in moved.study.ct.shape[::-1]))).reshape(3, -1).T
    index = (moved.study.ct.to_world(corners) - motion.field.affine[:3, 3]) @ np.linalg.inv(
        motion.field.affine[:3, :3]
    ).T
    assert (index >= -1e-6).all() and (index <= np.array(motion.field.shape[::-1]) - 1 + 1e-6).all()
    points = moved.study.ct.to_world(np.random.default_rng(0).uniform(0, 20, (50, 3)))
    expected = points @ pose[:3, :3].T + pose[:3, 3] - points
    np.testing.assert_allclose(motion.field.sample(points), expected, atol=1e-4)
    assert any("numba" in note or "torch" in note for note in motion.notes) and "from rest" in motion.notes


def test_a_field_on_an_oblique_left_handed_grid():
    affine = np.array([[0, -2.0, 0, 5], [2.0, 0, 0, -3], [0, 0, 3.0, 9], [0, 0, 0, 1]])
    pose = np.eye(4)
    pose[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    pose[:3, 3] = [1, 2, 3]
    ct = Volume(np.zeros((6, 7, 8), np.float32), affine @ np.diag([1, 1, -1, 1]))
    point = middle(ct)
    np.testing.assert_allclose(
        field_of(pose, ct).sample(point), pose[:3, :3] @ point + pose[:3, 3] - point, atol=1e-4
    )


class NearTheTruth:
    """Proposes for every X-ray the camera by which it sees the CT as it lies, a little off."""

    how, warnings = "made up", ()

    def __init__(self, moved, covered=True):
        self.cameras = {
            xray.name: Camera(xray.intrinsics, xray.extrinsic @ moved.shift @ self._off(), *xray.image.shape)
            for xray in moved.study.xrays
        }
        self.covered = covered

    def _off(self):
        off = np.eye(4)
        off[:3, 3] = [4.0, -3.0, 5.0]
        return off

    def covers(self, xray):
        return self.covered

    def starts(self, xray):
        return [self.cameras[xray.name]]


@pytest.mark.long
def test_a_patient_turned_far_is_found_from_a_models_cameras():
    moved = moved_bones(1, 75.0, 40.0, 0.3, pixels=40, spacing=7.0)
    setting = SystemSetting(weights={"rigid": Path("model.pt")})
    asked = []

    def load(study, path):
        asked.append(path)
        return NearTheTruth(moved)

    at_rest, _ = moved.errors()
    from_rest, _ = moved.errors(Rigid().fit(moved.study, SystemSetting()))
    learned = Rigid(load).fit(moved.study, setting)
    assert asked == [Path("model.pt")] and "from the camera model" in learned.notes
    assert moved.errors(learned)[0] < 0.1 * at_rest
    assert from_rest > 0.3 * at_rest


@pytest.mark.long
def test_a_model_of_other_directions_is_not_asked():
    moved = shifted(2)
    model = NearTheTruth(moved, covered=False)
    motion = Rigid(lambda study, path: model).fit(
        moved.study, SystemSetting(weights={"rigid": Path("model.pt")})
    )
    assert "from rest" in motion.notes


def test_every_iteration_is_told_and_may_be_the_last():
    steps = []
    setting = SystemSetting(
        progress=lambda iteration, of, similarity: steps.append((iteration, of, similarity)),
        cancelled=lambda: len(steps) >= 7,
    )
    with pytest.raises(CancelledError):
        Rigid().fit(shifted(0).study, setting)
    assert [step[0] for step in steps] == list(range(7))
    assert all(step[1] == 1500 and -1 <= step[2] <= 1 for step in steps)


def test_what_is_missing_is_one_sentence():
    moved = shifted(0)
    absent = replace(moved.study.xrays[0], extrinsic=None, camera="absent")
    study = replace(moved.study, xrays=(absent, *moved.study.xrays[1:]))
    with pytest.raises(InputError, match="has no camera"):
        Rigid().fit(study, SystemSetting())
    with pytest.raises(InputError, match="weights"):
        Rigid().fit(moved.study, SystemSetting(weights={"rigid": Path("model.pt")}))
