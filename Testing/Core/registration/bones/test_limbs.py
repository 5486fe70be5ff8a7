"""An arm whose two bones lie in a wrong place together is moved back together."""

import numpy as np
import pytest
from quiet_run import quiet_run

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.volume import Volume, hounsfield_to_attenuation
from PolyPoseLib.errors import CancelledError
from PolyPoseLib.geometry.rigid import about, perturbation, rigid_inverse
from PolyPoseLib.registration.bones.limbs import limb_starts, limbs, restart_limbs
from PolyPoseLib.registration.fit.levels import Level, Observation
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.simulation.independent_projector import project
from PolyPoseLib.simulation.simulate import arc_angles, view_cameras

LEVEL = Level(4.0, 28.0, 10, 0.001)
SPINE, UPPER, LOWER = range(3)
SHOULDER = np.array([45.0, 0.0, 60.0])
SPACING = 4.0


def capsule(points, start, end, radius):
    """Which points (..., 3) are within a radius of a segment."""
    along = np.subtract(end, start)
    share = np.clip((points - start) @ along / (along @ along), 0, 1)
    return ((points - start - share[..., None] * along) ** 2).sum(-1) < radius**2


def labels_and_hounsfield(arm):
    """(k, j, i) of a trunk with a spine, and an arm of two bones in its flesh that moves as a whole; arm: (4, 4) fixed
    to moving."""
    axes = [np.arange(low, 160.0, SPACING) for low in (-110.0, -70.0, -100.0)]
    axes[1] = axes[1][axes[1] < 70]
    points = np.stack(np.meshgrid(*axes[::-1], indexing="ij"), -1)[..., ::-1]
    there = points @ arm[:3, :3].T + arm[:3, 3]
    hounsfield = np.full(points.shape[:-1], -1000.0, np.float32)
    labels = np.zeros(points.shape[:-1], np.uint8)
    hounsfield[capsule(points, [-30, 0, -60], [-30, 0, 90], 55)] = 20
    hounsfield[capsule(there, SHOULDER, [140, 0, 60], 24)] = 30
    for number, parts in (
        (SPINE, [(points, [-30, 20, -80], [-30, 20, 100], 12), (points, [-30, 0, 60], [38, 0, 60], 8)]),
        (UPPER, [(there, [50, 0, 60], [90, 0, 60], 9), (there, [60, 0, 72], [60, 8, 74], 6)]),
        (LOWER, [(there, [104, 0, 60], [140, 0, 60], 8), (there, [112, 8, 52], [112, 12, 50], 6)]),
    ):
        inside = np.any([capsule(*part) for part in parts], axis=0)
        labels[inside], hounsfield[inside] = number + 1, 900.0 - 150 * number
    affine = np.diag([SPACING, SPACING, SPACING, 1.0])
    affine[:3, 3] = [axis[0] for axis in axes]
    return Volume(hounsfield, affine), labels


def raised(degrees):
    """(4, 4) fixed to moving of an arm that is turned about the shoulder, forwards and upwards."""
    turn = np.radians(degrees) * np.array([0.0, 0.9, 0.44])
    return about(perturbation(np.r_[turn, np.zeros(3)]), SHOULDER)


@pytest.fixture(scope="module")
def scene():
    ct, labels = labels_and_hounsfield(np.eye(4))
    return Scene(ct, Structures(("spine", "upper", "lower"), labels), "spine")


def observed(arm):
    ct, _ = labels_and_hounsfield(arm)
    attenuation = ct.with_voxels(hounsfield_to_attenuation(ct.voxels).astype(np.float32))
    cameras = view_cameras(ct, arc_angles(2, 40.0), 110, detector_mm=430.0)
    images = [project(attenuation, camera, "sum") for camera in cameras]
    return [Observation(i, np.ones(i.shape, bool), c) for i, c in zip(images, cameras, strict=True)]


def posed(motion):
    return np.stack([np.eye(4), motion, motion])


def off_mm(scene, poses, motion):
    """Largest distance of an arm bone's centre from its true place."""
    centres = np.c_[scene.centres, np.ones(3)]
    errors = [(rigid_inverse(poses[k]) - rigid_inverse(motion)) @ centres[k] for k in (UPPER, LOWER)]
    return max(float(np.linalg.norm(error[:3])) for error in errors)


@pytest.mark.parametrize(("true", "found"), [(-35.0, 15.0), (30.0, -20.0)])
def test_an_arm_is_moved_back_as_a_whole(scene, true, found):
    run = quiet_run(scene, rotation_reach_mm=40.0)
    start = posed(raised(found))
    assert off_mm(scene, start, raised(true)) > 40
    poses = restart_limbs(run, observed(raised(true)), start, LEVEL, [UPPER, LOWER])
    assert off_mm(scene, poses, raised(true)) < 4
    np.testing.assert_array_equal(poses[SPINE], np.eye(4))


def test_an_arm_that_is_where_it_belongs_stays(scene):
    run = quiet_run(scene, rotation_reach_mm=40.0)
    true = posed(raised(-30))
    assert restart_limbs(run, observed(raised(-30)), true, LEVEL, [UPPER, LOWER]) is true


@pytest.mark.parametrize("asked", [1, 5])
def test_it_stops_between_two_starts_when_asked_to(scene, asked):
    calls = []
    run = quiet_run(scene, cancel=lambda: calls.append(1) or len(calls) > asked)
    with pytest.raises(CancelledError):
        restart_limbs(run, observed(raised(30)), posed(raised(-20)), LEVEL, [UPPER, LOWER])
    assert len(calls) == asked + 1


@pytest.mark.parametrize("bones", [[], [UPPER], [LOWER]])
def test_a_bone_alone_is_no_limb(scene, bones):
    assert limbs(scene, bones) == []
    poses = posed(raised(20))
    assert restart_limbs(quiet_run(scene), [], poses, LEVEL, bones) is poses


def test_limbs_reach_outwards_from_each_bone(scene):
    assert limbs(scene, [LOWER, UPPER]) == [[UPPER, LOWER]]


def test_a_limb_starts_at_its_joint_with_a_bone_outside_of_it(scene):
    poses = posed(raised(20))
    poses[SPINE] = perturbation(np.array([0.1, 0.0, 0.05, 3.0, 1.0, -2.0]))
    (joint,) = [each for each in scene.articulations if SPINE in (each.first, each.second)]
    shoulder = rigid_inverse(poses[SPINE]) @ [*joint.point, 1.0]
    starts = list(limb_starts(scene, poses, [UPPER, LOWER]))
    assert len(starts) == 27
    for start in starts:
        np.testing.assert_allclose(start @ shoulder, [*joint.point, 1.0], atol=1e-9)
