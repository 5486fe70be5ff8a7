"""Bones that the X-rays contradict are noticed and restarted; right ones and unseen ones are not."""

import numpy as np
import pytest
from phantom_study import case, study
from quiet_run import quiet_run

from PolyPoseLib.geometry.rigid import about, perturbation
from PolyPoseLib.pipeline import register
from PolyPoseLib.registration.bones.rejection import (
    inconsistency_warnings,
    inconsistent_structures,
    restart_inconsistent,
    structure_residuals,
)
from PolyPoseLib.registration.fit.levels import Level, Observation
from PolyPoseLib.registration.magnification import magnification_of
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.registration.uncertainty.covariance import UNSEEN_ROTATION_DEG, UNSEEN_TRANSLATION_MM

FEMUR = 1
LEVELS = (Level(4.0, 28.0, 10, 0.001), Level(3.0, 20.0, 10, 0.001))


class Known:
    """A case with its true cameras and poses."""

    def __init__(self):
        self.case = case()
        self.scene = Scene(self.case.ct, self.case.structures, self.case.anchor)
        self.run = quiet_run(self.scene, rotation_reach_mm=40.0)
        self.observations = [
            Observation(image, np.ones(image.shape, bool), camera)
            for image, camera in zip(self.case.images, self.case.cameras, strict=True)
        ]
        self.true = np.stack([self.case.fixed_to_moving[name] for name in self.scene.names])

    def turned(self, degrees, seed):
        """True poses, but the femur turned about its own middle."""
        axis = np.random.default_rng(seed).normal(size=3)
        turn = np.r_[np.radians(degrees) * axis / np.linalg.norm(axis), np.zeros(3)]
        poses = self.true.copy()
        poses[FEMUR] = about(perturbation(turn), self.scene.centres[FEMUR]) @ poses[FEMUR]
        return poses


@pytest.fixture(scope="module")
def known():
    return Known()


def test_right_poses_are_consistent(known):
    assert inconsistent_structures(known.run, known.observations, known.true) == []


@pytest.mark.parametrize("seed", range(4))
def test_a_wrong_pose_leaves_a_larger_residual(known, seed):
    right, wrong = (
        np.nanmax(structure_residuals(known.run, known.observations, poses)[FEMUR])
        for poses in (known.true, known.turned(35, seed))
    )
    assert wrong > 2 * right


def test_a_wrong_pose_is_inconsistent_and_found_by_restarting(known):
    wrong = known.turned(35, 0)
    which = inconsistent_structures(known.run, known.observations, wrong)
    assert FEMUR in which
    assert "femur_left" in inconsistency_warnings(known.scene, which)[0]
    restarted = restart_inconsistent(known.run, known.observations, wrong, LEVELS)
    bone = np.argwhere(known.scene.structures.labels == FEMUR + 1)[::20, ::-1]
    moving = bone @ known.scene.ct_affine[:3, :3].T + known.scene.ct_affine[:3, 3]
    fixed = np.c_[moving, np.ones(len(moving))] @ np.linalg.inv(known.true[FEMUR]).T

    def error(poses):
        return np.linalg.norm((fixed @ poses[FEMUR].T)[:, :3] - moving, axis=1).mean()

    assert error(restarted) < 3 < error(wrong)


def test_a_structure_outside_every_view_has_no_residual(known):
    poses = known.true.copy()
    poses[FEMUR, :3, 3] += 4000
    share = structure_residuals(known.run, known.observations, poses)
    assert np.isnan(share[FEMUR]).all()


def test_right_bones_are_not_restarted(known, monkeypatch):
    monkeypatch.setattr("PolyPoseLib.registration.bones.rejection.SUSPECT", 10.0)
    same = restart_inconsistent(known.run, known.observations, known.true, LEVELS)
    np.testing.assert_array_equal(same, known.true)


def test_an_inconsistent_structure_is_as_uncertain_as_an_unseen_one(known, monkeypatch):
    monkeypatch.setattr("PolyPoseLib.pipeline.inconsistent_structures", lambda *_: [FEMUR])
    small = study(known.case, {"preset": "fast"})
    result = register(small)
    stated = result.structures["femur_left"].uncertainty
    assert any("contradict" in warning and "femur_left" in warning for warning in result.warnings)
    assert stated["along_mm"] == pytest.approx(1.96 * UNSEEN_TRANSLATION_MM / magnification_of(small))
    assert stated["rotation_about_view_deg"] == pytest.approx(1.96 * UNSEEN_ROTATION_DEG)
    assert result.structures["vertebra_L5"].uncertainty["along_mm"] < 20
