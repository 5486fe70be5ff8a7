"""The dense transform and the warped volumes of a study, by torch on a device as by the compiled loops."""

import numpy as np
import pytest
import torch
from phantom_study import case, study

from PolyPoseLib.registration import outputs
from PolyPoseLib.registration.fit.soft_tissue import SoftTissue
from PolyPoseLib.registration.outputs import warp_study
from PolyPoseLib.registration.scene import Scene

pytest.importorskip("numba")


@pytest.mark.parametrize("composed", [False, pytest.param(True, marks=pytest.mark.long)])
def test_a_study_is_warped_as_by_the_loops(composed, gpu):
    simulated = case(seed=3)
    whole, scene = study(simulated), Scene(simulated.ct, simulated.structures, simulated.anchor)
    poses = np.stack([simulated.fixed_to_moving[name] for name in scene.names])
    found = []
    for where in (None, gpu):
        soft = SoftTissue(scene, rotation_reach_mm=40.0, device=where)
        coefficients = 0.3 * np.sqrt(soft.modes.variances)[:, None] * np.ones(3)
        found.append(warp_study(whole, soft.with_motion(coefficients), poses, 9.0, composed))
    loops, torches = found
    off = np.abs(torches.transform.vectors - loops.transform.vectors)
    # The fit to the bones takes up cells that they miss by 0.02 mm, and rounding decides about some.
    assert off.max() < 0.05 and np.quantile(off, 0.99) < 1e-3
    assert np.abs(loops.transform.vectors).max() > 5
    assert (np.abs(torches.ct.voxels - loops.ct.voxels) > 0.5).mean() < 1e-3
    assert torches.labels.voxels.dtype == loops.labels.voxels.dtype
    assert (torches.labels.voxels != loops.labels.voxels).mean() < 1e-4
    assert np.abs(torches.inverse.vectors - loops.inverse.vectors).max() < 0.1


def test_a_cpu_leaves_resampling_to_simpleitk_or_the_loops():
    assert outputs._resampling_device(None) is None
    assert outputs._resampling_device(torch.device("cpu")) is None
    assert outputs._resampling_device(torch.device("cuda")) == torch.device("cuda")
