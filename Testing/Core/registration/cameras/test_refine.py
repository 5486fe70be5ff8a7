"""Refining one camera by the anchor: its distance is found as well as its direction."""

import numpy as np
import pytest
from phantom_study import case
from quiet_run import quiet_run

from PolyPoseLib.registration.cameras import refine as cameras
from PolyPoseLib.registration.cameras.refine import anchor_region, find_camera
from PolyPoseLib.registration.fit.levels import Level, Observation
from PolyPoseLib.registration.fit.problem import State
from PolyPoseLib.registration.fit.views import LevelViews
from PolyPoseLib.registration.fit.weighting import dilated, projection_mask
from PolyPoseLib.registration.scene import Scene

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
    observation = Observation(image, np.ones(image.shape, bool), true.with_extrinsic(extrinsic))
    found = find_camera(quiet_run(scene), observation, LEVELS)
    left = (found.extrinsic - true.extrinsic) @ np.r_[scene.anchor_centre, 1.0]
    assert abs(left[2]) < 0.6 * abs(off)


@pytest.mark.parametrize("view", [0, 1])
def test_at_fine_levels_moving_bones_are_masked_and_their_surroundings_where_enough_remains(
    simulated, monkeypatch, view
):
    scene = Scene(simulated.ct, simulated.structures, simulated.anchor)
    image = simulated.images[view]
    observation = Observation(image, np.ones(image.shape, bool), simulated.cameras[view])
    state = State(np.stack([np.eye(4)] * 3), np.eye(4)[None])

    def regions(level):
        bones = LevelViews(quiet_run(scene), [observation], level).structures()
        moving, anchor = (projection_mask(bones, state, 0, which) for which in ([1, 2], [0]))
        return anchor_region(scene, bones, state, 0), moving, anchor

    fine, moving, anchor = regions(Level(2.0, 14.0, 10))
    monkeypatch.setattr(cameras, "LEAST_ANCHOR", 1.1)
    wider, *_ = regions(Level(2.0, 14.0, 10))
    assert not (wider & moving).any() and not (fine & dilated(moving, 1)).any()
    assert (fine & wider == fine).all() and fine.sum() < wider.sum()
    assert (fine & anchor).sum() >= 0.4 * anchor.sum()
    coarse, _moving, anchor = regions(Level(6.0, 40.0, 10))
    assert (coarse | ~anchor).all()
