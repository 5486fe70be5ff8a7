"""A phantom case and its scene, which several tests of cameras share."""

import pytest
from phantom_study import case

from PolyPoseLib.registration.scene import Scene, body_points


@pytest.fixture(scope="module")
def simulated():
    return case(seed=1)


@pytest.fixture(scope="module")
def scene(simulated):
    return Scene(simulated.ct, simulated.structures, simulated.anchor)


@pytest.fixture(scope="module")
def points(scene):
    return body_points(scene.bodies(6.0)[scene.anchor], 200)
