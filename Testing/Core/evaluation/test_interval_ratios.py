"""Errors over stated intervals: what is inside must be inside, in every direction."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from PolyPoseLib.evaluation.calibration import interval_ratios
from PolyPoseLib.geometry.camera import Camera, look_at
from PolyPoseLib.registration.uncertainty.covariance import PoseUncertainty

CENTRE = np.array([30.0, -20.0, 110.0])


def cameras() -> list[Camera]:
    """Two views of the origin, 30 degrees apart."""
    intrinsics = np.array([[1000.0, 0, 100], [0, 1000.0, 100], [0, 0, 1]])
    sources = np.array([[0.0, -800, 0], [400.0, -690, 0]])
    return [Camera(intrinsics, look_at(source, np.zeros(3)), 201, 201) for source in sources]


def random_pose(rng: np.random.Generator) -> np.ndarray:
    """A motion of some degrees and millimetres."""
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_rotvec(rng.normal(0, 0.2, 3)).as_matrix()
    pose[:3, 3] = rng.normal(0, 10, 3)
    return pose


def disturbed(pose: np.ndarray, delta: np.ndarray) -> np.ndarray:
    """A perturbation (6,) on the left, about the centroid."""
    change = np.eye(4)
    change[:3, :3] = Rotation.from_rotvec(delta[:3]).as_matrix()
    change[:3, 3] = CENTRE + delta[3:] - change[:3, :3] @ CENTRE
    return change @ pose


def random_covariance(rng: np.random.Generator) -> np.ndarray:
    """Of some degrees and millimetres, all correlated."""
    root = rng.normal(size=(6, 6)) * np.array([[0.01] * 3 + [1.0] * 3]).T
    return root @ root.T + np.diag([1e-5] * 3 + [1e-2] * 3)


@pytest.mark.parametrize("seed", range(3))
def test_errors_drawn_from_the_covariance_lie_inside_95_of_100_times(seed: int) -> None:
    rng = np.random.default_rng(seed)
    found, covariance = random_pose(rng), random_covariance(rng)
    stated = PoseUncertainty(covariance).to_dict(cameras(), found, CENTRE)
    root = np.linalg.cholesky(covariance)
    count = 600
    inside: dict[str, int] = {}
    for _ in range(count):
        true = np.linalg.inv(disturbed(np.eye(4), root @ rng.normal(size=6))) @ found
        for name, ratio in interval_ratios(true, found, CENTRE, stated).items():
            inside[name] = inside.get(name, 0) + (ratio <= 1)
    for name, hits in inside.items():
        assert 0.92 < hits / count < 0.98, name


def test_no_error_is_inside_and_a_large_one_is_not() -> None:
    rng = np.random.default_rng(7)
    found, covariance = random_pose(rng), random_covariance(rng)
    stated = PoseUncertainty(covariance).to_dict(cameras(), found, CENTRE)
    assert max(interval_ratios(found, found, CENTRE, stated).values()) < 1e-9
    along = np.array(stated["directions"]["along"])
    far = disturbed(found, np.r_[np.zeros(3), 3 * stated["along_mm"] * along])
    ratios = interval_ratios(found, far, CENTRE, stated)
    assert ratios["along"] == pytest.approx(3.0, rel=1e-6)
    assert ratios["across_1"] < 1e-6
    assert ratios["pose"] > 1
