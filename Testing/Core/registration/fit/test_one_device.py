"""A GPU that is pretended by the CPU finds what is on two devices at once; many poses of a bone are on one."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from phantom_study import case
from pretended_gpu import PretendedGpu

from PolyPoseLib.data.progress import Monitor
from PolyPoseLib.registration.fit.levels import Level, Observation
from PolyPoseLib.registration.fit.many_poses import at_many_poses
from PolyPoseLib.registration.fit.problem import State
from PolyPoseLib.registration.fit.soft_tissue import SoftTissue
from PolyPoseLib.registration.fit.views import LevelViews, problem_of_one_bone
from PolyPoseLib.registration.run import Run
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.select import torch_device_of
from PolyPoseLib.rendering.torch_backend import TorchBackend

LEVEL = Level(8.0, 48.0, 2, 0.01)


@pytest.fixture(scope="module")
def simulated():
    return case(seed=2)


@pytest.fixture(scope="module")
def scene(simulated):
    return Scene(simulated.ct, simulated.structures, simulated.anchor)


@pytest.fixture
def observations(simulated):
    return [
        Observation(image, np.ones(image.shape, bool), camera)
        for image, camera in zip(simulated.images, simulated.cameras, strict=True)
    ]


def run_on(scene: Scene, device: str) -> Run:
    backend = TorchBackend(device)
    soft = SoftTissue(scene, rotation_reach_mm=40.0, device=torch_device_of(backend))
    return Run(soft, backend, Monitor(None, None), "test")


def test_what_only_a_gpu_would_find_is_found():
    with PretendedGpu():
        there, here = torch.zeros(3, device="cuda"), torch.ones(3)
        assert there.device.type == "cuda" and here.device.type == "cpu"
        for result in (there + 1, there[1:], there.double(), here.to("cuda"), here.to(there), there * 2.0):
            assert result.device.type == "cuda"
        assert here.device.type == "cpu" and there.cpu().device.type == "cpu"
        for mixed in (
            lambda: there + here,
            lambda: torch.cat([there, here]),
            lambda: here[:2].add_(there[0:2]),
        ):
            with pytest.raises(RuntimeError, match="on the CPU and on the GPU"):
                mixed()
        with pytest.raises(TypeError, match="copy it"):
            there.numpy()
        assert there.cpu().numpy().sum() == 0


def test_many_poses_of_a_bone_are_compared(scene, observations):
    with PretendedGpu():
        views = LevelViews(run_on(scene, "cuda"), observations, LEVEL)
        problem, state = views.posed_structures(scene.rest_poses, [1, 2])
        views.weigh_structures(problem, state)
        shown = [
            replace(view, static=problem.render_without(1, state, n)) for n, view in enumerate(problem.views)
        ]
        alone = problem_of_one_bone(problem, state, 1, shown)
        assert alone is not None
        many = at_many_poses(alone)
        normals = many.normal_equations(scene.rest_poses[:2])
        one = alone.cost(State.of_poses(scene.rest_poses[:1], len(alone.views)))
    assert normals.costs == pytest.approx([one, one], rel=1e-4)
