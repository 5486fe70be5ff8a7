"""Refining one camera by the anchor: its distance is found as well as its direction."""

import numpy as np
import pytest
from phantom_study import case

from PolyPoseLib.registration.cameras import find_camera
from PolyPoseLib.registration.levels import Level, Measured
from PolyPoseLib.registration.monitor import Monitor
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.backend import select_backend

LEVELS = (Level(4.0, 24.0, 10),)


@pytest.fixture(scope="module")
def simulated():
    return case()


@pytest.mark.parametrize("seed", range(6))
def test_a_camera_too_near_or_too_far_finds_its_distance(simulated, seed):
    rng = np.random.default_rng(seed)
    scene = Scene(simulated.ct, simulated.structures, simulated.anchor)
    n = seed % 2
    true, image = simulated.cameras[n], simulated.images[n]
    off = rng.choice([-1, 1]) * rng.uniform(20, 45)
    extrinsic = true.extrinsic.copy()
    centre = extrinsic[:3, :3] @ scene.anchor_centre + extrinsic[:3, 3]
    extrinsic[:3, 3] += off * centre / np.linalg.norm(centre)
    measured = Measured(image, np.ones(image.shape, bool), true.with_extrinsic(extrinsic))
    found = find_camera(scene, measured, LEVELS, select_backend(), Monitor(None, None), "camera")
    left = (found.extrinsic - true.extrinsic) @ np.r_[scene.anchor_centre, 1.0]
    assert abs(left[2]) < 0.6 * abs(off)
