"""Renderings of a result, as fine as the X-rays or coarser."""

from dataclasses import replace

import numpy as np
import pytest
from phantom_study import case
from quiet_run import quiet_run

from PolyPoseLib.registration.outputs import render_views
from PolyPoseLib.registration.scene import Scene


@pytest.mark.parametrize("seed", range(3))
def test_coarse_renderings_are_the_fine_ones_blurred(seed):
    simulated = case(seed=seed)
    run = quiet_run(Scene(simulated.ct, simulated.structures, simulated.anchor))
    poses = np.stack([simulated.fixed_to_moving[name] for name in run.scene.names])
    cameras = [replace_pixels(camera, 4) for camera in simulated.cameras]
    fine, coarse = (render_views(run, cameras, poses, size) for size in (None, 4.0))
    for one, other in zip(fine, coarse, strict=True):
        assert one.shape == other.shape and one.max() > 1
        assert np.abs(one - other).max() > 0
        assert np.sqrt(((one - other) ** 2).mean()) < 0.04 * np.sqrt((one**2).mean())
        assert abs(one.mean() - other.mean()) < 0.01 * one.mean()


def test_an_image_of_a_few_pixels_is_not_binned_away():
    simulated = case(seed=0)
    run = quiet_run(Scene(simulated.ct, simulated.structures, simulated.anchor))
    (image,) = render_views(run, simulated.cameras[:1], run.scene.rest_poses, 500.0)
    assert image.shape == (simulated.cameras[0].height, simulated.cameras[0].width) and image.any()


def replace_pixels(camera, times):
    """The camera with so many times as many pixels along each side."""
    intrinsics = camera.intrinsics * [[times], [times], [1]]
    intrinsics[:2, 2] += (times - 1) / 2
    return replace(camera, intrinsics=intrinsics, height=times * camera.height, width=times * camera.width)
