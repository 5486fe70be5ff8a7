"""A patient taken apart and put together again: nothing is lost at rest, and bones are rigid exactly."""

from dataclasses import replace

import numpy as np
import pytest
from chest_phantom import LABELS, chest
from knee_case import knee, knee_cameras
from scipy.spatial.transform import Rotation
from simulation_phantom import phantom

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.volume import Volume, hounsfield_to_attenuation
from PolyPoseLib.simulation.independent_projector import project, rtk_available
from PolyPoseLib.simulation.motion import apply, rigid_about
from PolyPoseLib.simulation.motion_laws import motion_over_time
from PolyPoseLib.simulation.moving_scene import MovingScene, bones_apart, coarser, relative_to, seen_from_ct
from PolyPoseLib.simulation.named_motions import Anatomy

REST = np.tile(np.eye(4), (1, 3, 1, 1))


def scene_of(poses=REST, reference="femur", soft_mm=5.0):
    return MovingScene.of(
        knee().ct, knee().structures, reference, np.asarray(poses), soft_mm, 15.0, projector="sum"
    )


def drawn_pose(rng, degrees=40.0, mm=30.0):
    turn = Rotation.from_rotvec(np.radians(degrees) * rng.normal(size=3) / 2).as_matrix()
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn, mm * rng.normal(size=3)
    return pose


def line_of(scene, poses, camera):
    return scene.project_soft(scene.soft_tissue(poses), poses, camera) + scene.project_bones(poses, camera)


def whole(camera):
    ct = knee().ct
    return project(Volume(hounsfield_to_attenuation(ct.voxels), ct.affine), camera, "sum")


def assert_same_picture(found, expected):
    """But for where along a ray it is sampled, which differs with the volume and shows at edges of large voxels."""
    difference = np.abs(found - expected)
    assert difference.mean() < 0.005 and np.quantile(difference, 0.98) < 0.05 and expected.max() > 2


def test_parts_add_up_to_the_ct_to_the_last_bit_of_rounding():
    for ct, structures in ((knee().ct, knee().structures), phantom()[:2]):
        bones, filled = bones_apart(ct, structures)
        total = hounsfield_to_attenuation(filled.voxels)
        for bone in bones:
            start = np.rint(ct.to_index(bone.affine[:3, 3])).astype(int)[::-1]
            total[tuple(slice(a, a + n) for a, n in zip(start, bone.shape, strict=True))] += bone.voxels
        assert np.allclose(total, hounsfield_to_attenuation(ct.voxels), atol=1e-7)
        assert filled.voxels[structures.labels > 0].max() <= 150  # no bone is left behind


def test_no_bone_holds_another():
    bones, _ = bones_apart(knee().ct, knee().structures)
    for number, bone in enumerate(bones, start=1):
        held = bone.to_world(np.argwhere(bone.voxels != 0)[:, ::-1])
        labels = Volume(knee().structures.labels, knee().ct.affine).voxels_at(knee().ct.to_index(held), 0)
        assert set(np.unique(labels)) <= {0, number}


@pytest.mark.parametrize("camera", knee_cameras((0.0, 55.0, 90.0)))
def test_at_rest_the_sum_is_the_cts_own_picture(camera):
    assert_same_picture(line_of(scene_of(), REST[0], camera), whole(camera))


@pytest.mark.parametrize("seed", range(3))
def test_a_patient_moved_as_a_whole_is_a_camera_moved_the_other_way(seed):
    rng = np.random.default_rng(seed)
    pose, camera = drawn_pose(rng, 20, 10), knee_cameras()[seed % 2]
    poses = np.tile(pose, (3, 1, 1))
    moved = camera.with_extrinsic(camera.extrinsic @ np.linalg.inv(pose))
    assert_same_picture(line_of(scene_of(poses[None]), poses, camera), whole(moved))


@pytest.mark.parametrize("seed", range(4))
def test_a_bones_picture_is_where_its_voxels_project_wherever_it_goes(seed):
    rng = np.random.default_rng(seed)
    camera, bone = knee_cameras(pixels=80)[seed % 2], 2
    centre = knee().structures.centroids(knee().ct.affine)[bone]
    motion = rigid_about(centre, rng.normal(0, 0.6, 3), rng.uniform(-25, 25, 3))
    poses = REST[0].copy()
    poses[bone] = np.linalg.inv(motion)
    scene = scene_of(poses[None])
    picture = scene.project_bones(poses, camera) - scene.project_bones(REST[0], camera)
    alone = project(scene.bones[bone], camera, "sum")
    picture += alone  # what is left is the moved bone's own
    part = scene.bones[bone]
    weight = part.voxels[part.voxels > 0]
    points = apply(motion, part.to_world(np.argwhere(part.voxels > 0)[:, ::-1]))
    # A line integral counts a voxel by its attenuation over the squared distance to the source, nearly evenly here.
    weight = weight / camera.depth(points) ** 2
    expected = weight @ camera.project(points) / weight.sum()
    rows, columns = np.indices(picture.shape)
    shown = np.maximum(picture, 0)
    found = np.array([(shown * axis).sum() for axis in (columns, rows)]) / shown.sum()
    assert np.abs(found - expected).max() < 0.5
    assert shown.sum() == pytest.approx(np.maximum(alone, 0).sum(), rel=0.35)


def test_soft_tissue_goes_with_the_only_bone_near_it_and_holds_its_volume():
    motion = rigid_about(np.array([0.0, 8.0, 23.0]), np.radians([60.0, 0, 0]), np.zeros(3))
    poses = np.stack([np.eye(4), np.linalg.inv(motion), np.eye(4)])
    scene = scene_of(poses[None])
    soft, rest = scene.soft_tissue(poses), scene.soft_tissue(REST[0])
    calf = np.array([[x, y, -100.0] for x in (-20.0, 0.0, 20.0) for y in (-10.0, 10.0, 25.0)])
    found = soft.voxels_at(soft.to_index(apply(motion, calf)), 0)
    expected = rest.voxels_at(rest.to_index(calf), 0)
    assert np.allclose(found, expected, atol=0.004)
    assert soft.voxels.sum() == pytest.approx(rest.voxels.sum(), rel=0.25)
    assert (soft.voxels >= 0).all()


def test_the_grid_has_room_for_every_posture():
    poses = np.tile(np.eye(4), (2, 3, 1, 1))
    poses[1, 1] = np.linalg.inv(
        rigid_about(np.array([0.0, 8.0, 23.0]), np.radians([100.0, 0, 0]), np.zeros(3))
    )
    scene = scene_of(poses)
    soft = scene.soft_tissue(poses[1]).voxels
    for side in (soft[:, 0], soft[:, -1], soft[:, :, 0], soft[:, :, -1]):
        assert (side > 0.01).mean() < 0.03
    assert scene.grid.shape[1] > scene_of().grid.shape[1]


def test_coarser_voxels_keep_places_and_means():
    rng = np.random.default_rng(2)
    affine = np.diag([1.0, 2.0, 1.5, 1.0])
    affine[:3, 3] = [5, -7, 3]
    fine = Volume(rng.normal(size=(12, 6, 12)).astype(np.float32), affine)
    coarse = coarser(fine, 3.0)
    assert coarse.shape == (6, 3, 4)
    assert coarse.voxels.mean() == pytest.approx(float(fine.voxels.mean()), abs=1e-6)
    assert np.allclose(coarse.bounds_center, fine.bounds_center)
    assert coarser(fine, 0.5).shape == fine.shape
    odd = coarser(Volume(np.ones((5, 5, 5), np.float32), np.eye(4)), 2.0)
    assert odd.shape == (3, 3, 3) and np.allclose(odd.voxels, 1)


def test_a_pose_moves_the_camera_into_the_cts_world():
    rng = np.random.default_rng(3)
    for _ in range(20):
        pose, camera = drawn_pose(rng), knee_cameras()[0]
        points = rng.normal(0, 30, (9, 3))
        in_rig = apply(np.linalg.inv(pose), points)
        assert np.allclose(seen_from_ct(camera, pose).project(points), camera.project(in_rig), atol=1e-6)
        poses = np.stack([drawn_pose(rng) for _ in range(3)])
        assert np.allclose(relative_to(poses, 1)[1], np.eye(4), atol=1e-9)


def test_one_bone_alone_takes_all_soft_tissue_along():
    labels = np.where(knee().structures.labels == 1, 1, 0).astype(np.int16)
    pose = np.linalg.inv(rigid_about(np.zeros(3), np.radians([0, 20.0, 0]), np.array([5.0, 0, 0])))[None]
    scene = MovingScene.of(knee().ct, Structures(("femur",), labels), "femur", pose[None], 5.0, 15.0, "sum")
    camera = knee_cameras()[0]
    assert_same_picture(line_of(scene, pose, camera), whole(seen_from_ct(camera, pose[0])))


def test_lungs_become_less_dense_as_they_grow():
    ct, structures, source = chest(spacing=5.0)
    anatomy = Anatomy(structures, ct.affine, structures.names[0], source.voxels, LABELS)
    law = motion_over_time("breathing", 40.0, anatomy, (None, 8.0), np.random.default_rng(0))
    moved = law.on_coarser_voxels(ct, 5.0).soft_at(2.0)
    poses = np.linalg.inv(law.bones.at(np.array([0.0, 2.0])))
    scene = MovingScene.of(ct, structures, structures.names[0], poses, 5.0, 10.0, "sum")
    rest = scene.soft_tissue(poses[0], law.on_coarser_voxels(ct, 5.0).soft_at(0.0))
    airy, dense = scene.soft_tissue(poses[1], moved), scene.soft_tissue(poses[1], replace(moved, lungs=None))
    places = rest.to_world(np.stack(np.indices(rest.shape)[::-1], axis=-1))
    inside = np.hypot(places[..., 0] / 100, places[..., 1] / 66) < 1  # away from the skin
    lungs = inside & (np.abs(places[..., 2]) < 110) & (dense.voxels < 0.0123)
    before = rest.voxels[inside & (np.abs(places[..., 2]) < 110) & (rest.voxels < 0.0123)]
    growth = lungs.sum() / len(before)
    assert growth > 1.05
    assert np.median(dense.voxels[lungs]) == pytest.approx(np.median(before), rel=0.01)
    assert airy.voxels[lungs].mean() / dense.voxels[lungs].mean() == pytest.approx(1 / growth, abs=0.04)
    flesh = dense.voxels > 0.98 * dense.voxels[~lungs].max()
    assert np.mean(airy.voxels[flesh] == dense.voxels[flesh]) > 0.98


@pytest.mark.slow
@pytest.mark.skipif(not rtk_available(), reason="ITK-RTK is not installed")
def test_at_rest_the_sum_is_the_cts_own_picture_to_rounding_by_the_faster_projector():
    ct = knee().ct
    attenuation = Volume(hounsfield_to_attenuation(ct.voxels), ct.affine)
    scene = MovingScene.of(ct, knee().structures, "femur", REST, 5.0, 15.0, projector="rtk")
    for camera in knee_cameras((0.0, 55.0, 90.0), 100):
        expected = project(attenuation, camera, "rtk")
        assert np.allclose(line_of(scene, REST[0], camera), expected, atol=1e-4) and expected.max() > 2
