"""A displacement field fitted to the motions of bones."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.warp.dense import jacobian_determinant
from PolyPoseLib.warp.on_bones import fitted_to_bones
from PolyPoseLib.warp.unfold import LEAST_DETERMINANT


def joint(seed, slide=4.0):
    """A cup and a ball 2 mm apart, which slide past each other; the field knows each bone at its nodes alone."""
    rng = np.random.default_rng(seed)
    affine = np.diag([1.0, 1, 1, 1])
    affine[:3, 3] = -30
    k, j, i = np.meshgrid(*[np.arange(61) - 30] * 3, indexing="ij")
    radius = np.sqrt(i**2 + j**2 + k**2)
    labels = np.zeros(radius.shape, np.int16)
    labels[(radius > 16) & (radius < 24) & (k > -4)] = 1
    labels[radius < 14] = 2
    pose = np.eye(4)
    axis = rng.normal(size=3)
    pose[:3, :3] = Rotation.from_rotvec(axis / np.linalg.norm(axis) * slide / 15).as_matrix()
    poses = np.stack([np.eye(4), pose])
    spacing = 3.0
    grid = np.diag([spacing, spacing, spacing, 1])
    grid[:3, 3] = -36
    n = np.arange(25) * spacing - 36
    z, y, x = np.meshgrid(n, n, n, indexing="ij")
    points = np.stack([x, y, z], axis=-1)
    ball = np.linalg.norm(points, axis=-1)
    weight = np.clip((15.5 - ball) / 1.0 + 0.5, 0, 1)[..., None]
    moved = points @ pose[:3, :3].T - points
    return DisplacementField((weight * moved).astype(np.float32), grid), Volume(labels, affine), poses


def misses(field, labels, poses):
    """mm, at the bones' voxels, between the field and the bones' motions."""
    found = []
    for n, pose in enumerate(poses):
        moving = labels.to_world(np.argwhere(labels.voxels == n + 1)[:, ::-1])
        fixed = (moving - pose[:3, 3]) @ pose[:3, :3]
        found.append(np.linalg.norm(field(fixed) - moving, axis=1))
    return np.concatenate(found)


@pytest.mark.parametrize("seed", range(3))
def test_the_field_comes_nearer_to_the_bones_without_folding(seed):
    field, labels, poses = joint(seed)
    fitted = fitted_to_bones(field, labels, poses)
    before, after = misses(field, labels, poses), misses(fitted, labels, poses)
    assert (before > 0.5).mean() > 0.02
    assert np.sqrt((after**2).mean()) < 0.65 * np.sqrt((before**2).mean())
    assert jacobian_determinant(field).min() > 0.05 and jacobian_determinant(fitted).min() > 0.04
    far = np.abs(fitted.vectors - field.vectors).max(axis=-1) > 0
    nodes = np.argwhere(far)[:, ::-1] * 3.0 - 36
    assert np.linalg.norm(nodes, axis=1).max() < 24 + 3 * 3**0.5


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("slide", [9.0, 14.0, 20.0])
def test_nothing_folds_that_was_not_folded_before(seed, slide):
    field, labels, poses = joint(seed, slide)
    fitted = fitted_to_bones(field, labels, poses)
    before, after = (jacobian_determinant(each) for each in (field, fitted))
    assert not ((after <= LEAST_DETERMINANT) & (before > LEAST_DETERMINANT)).any()


def test_a_field_that_agrees_is_left_alone():
    field, labels, _poses = joint(0)
    still = DisplacementField(np.zeros_like(field.vectors), field.affine)
    assert fitted_to_bones(still, labels, np.stack([np.eye(4)] * 2)) is still


def test_places_that_two_bones_claim_pull_nowhere():
    field, labels, _poses = joint(0)
    blocks = np.zeros_like(labels.voxels)
    blocks[20:41, 20:41, 20:30] = 1
    blocks[20:41, 20:41, 30:40] = 2
    together = np.stack([np.eye(4)] * 2)
    together[1, 0, 3] = 10  # brings the second block into the place of the first
    still = DisplacementField(np.zeros_like(field.vectors), field.affine)
    assert fitted_to_bones(still, Volume(blocks, labels.affine), together) is still
    together[1, 0, 3] = 4  # and now a part of it, so that the rest does pull
    assert fitted_to_bones(still, Volume(blocks, labels.affine), together) is not still
