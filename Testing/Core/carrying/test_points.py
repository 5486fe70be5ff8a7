"""Points carried between the CT and the patient as X-rayed."""

import numpy as np
import pytest
from carried_case import COVARIANCE, carried_result
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from PolyPoseLib.carrying.soft_tissue_error import OWN_SHARE
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError


def points_in(result, label, rng, count=200) -> np.ndarray:
    """Random points (N, 3) within the voxels of a label."""
    labels = result.structure_labels
    index = np.argwhere(labels.voxels == label)[:, ::-1]
    chosen = index[rng.integers(len(index), size=count)]
    return labels.to_world(chosen + rng.uniform(-0.49, 0.49, (count, 3)))


@pytest.mark.parametrize("seed", range(3))
def test_points_inside_a_bone_take_its_own_motion(seed):
    result, rng = carried_result(seed), np.random.default_rng(seed)
    pose = result.structures["femur"].fixed_to_moving
    points = points_in(result, 2, rng)
    carried = result.transform_points(points)
    assert carried.moved_by == ("femur",) * len(points)
    back = np.linalg.inv(pose)
    np.testing.assert_allclose(carried.points, points @ back[:3, :3].T + back[:3, 3], atol=1e-9)
    returned = result.transform_points(carried.points, to="ct")
    assert returned.moved_by == carried.moved_by
    np.testing.assert_allclose(returned.points, points, atol=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_points_of_soft_tissue_take_the_field_and_its_inverse(seed):
    result, rng = carried_result(seed), np.random.default_rng(seed)
    points = points_in(result, 0, rng)
    there = result.transform_points(points, to="xray")
    assert set(there.moved_by) == {"displacement field"} and there.inside.mean() > 0.9
    warped = there.points + result.transform.sample(there.points)
    np.testing.assert_allclose(warped, points, atol=2e-3)
    fixed = points[rng.permutation(len(points))]
    back = result.transform_points(fixed, to="ct")
    soft = np.array([name == "displacement field" for name in back.moved_by])
    assert soft.sum() > 50
    np.testing.assert_allclose(
        back.points[soft], fixed[soft] + result.transform.sample(fixed[soft]), atol=1e-9
    )


def test_a_bones_covariance_is_that_of_poses_drawn_from_it():
    result, rng = carried_result(), np.random.default_rng(5)
    point = points_in(result, 2, rng, 1)
    femur = result.structures["femur"]
    draws = []
    for error in rng.multivariate_normal(np.zeros(6), COVARIANCE, 4000):
        delta = np.eye(4)
        delta[:3, :3] = Rotation.from_rotvec(error[:3]).as_matrix()
        delta[:3, 3] = femur.centroid + error[3:] - delta[:3, :3] @ femur.centroid
        back = np.linalg.inv(delta @ femur.fixed_to_moving)
        draws.append(point[0] @ back[:3, :3].T + back[:3, 3])
    carried = result.transform_points(point)
    assert np.abs(carried.covariances[0] - np.cov(np.array(draws).T)).max() < 0.06 * COVARIANCE.max()
    assert (np.diff(carried.semi_axes_mm[0]) >= 0).all() and carried.semi_axes_mm[0, 0] > 1


def test_a_point_of_the_anchor_is_exact_and_soft_tissue_never_is():
    result, rng = carried_result(), np.random.default_rng(3)
    anchor = result.transform_points(points_in(result, 1, rng))
    assert np.sqrt(np.trace(anchor.covariances, axis1=1, axis2=2)).max() < 0.02
    soft = result.transform_points(points_in(result, 0, rng))
    assert np.linalg.eigvalsh(soft.covariances)[:, 0].min() > 0.01


def test_without_stated_uncertainty_covariances_are_unknown():
    result, rng = carried_result(), np.random.default_rng(3)
    femur = result.structures["femur"]
    result.structures["femur"] = type(femur).from_pose(femur.fixed_to_moving, femur.centroid)
    carried = result.transform_points(points_in(result, 2, rng))
    assert np.isnan(carried.covariances).all() and np.isnan(carried.semi_axes_mm).all()
    assert np.isfinite(carried.points).all()


def test_points_beyond_the_grid_are_told():
    result = carried_result()
    carried = result.transform_points(np.array([[0.0, 0, 0], [5000, 0, 0]]))
    assert carried.inside.tolist() == [True, False] and np.isfinite(carried.points).all()


def test_no_points_make_no_points():
    carried = carried_result().transform_points(np.empty((0, 3)))
    assert carried.points.shape == (0, 3) and carried.covariances.shape == (0, 3, 3)


@pytest.mark.parametrize(
    "points", [np.zeros((2, 2)), [[np.nan, 0, 0]], [["a", "b", "c"]], np.zeros((1, 2, 3))]
)
def test_other_points_are_refused(points):
    with pytest.raises(InputError, match="Points"):
        carried_result().transform_points(points)


def test_an_unknown_frame_and_an_earlier_result_are_refused():
    result = carried_result()
    with pytest.raises(InputError, match='"xray" or "ct"'):
        result.transform_points(np.zeros((1, 3)), to="mri")
    result = carried_result()
    result.structure_labels = None
    with pytest.raises(InputError, match=r"structures\.nii\.gz.*register again"):
        result.transform_points(np.zeros((1, 3)))


def test_a_left_handed_ct_makes_no_difference():
    result, rng = carried_result(), np.random.default_rng(1)
    points = np.concatenate([points_in(result, label, rng, 40) for label in (0, 1, 2)])
    labels = result.structure_labels
    flipped = labels.affine.copy()
    flipped[:3, 0] *= -1
    flipped[:3, 3] = labels.to_world(np.array([labels.shape[2] - 1, 0, 0]))
    other = carried_result()
    other.structure_labels = Volume(labels.voxels[:, :, ::-1], flipped)
    np.testing.assert_allclose(
        other.transform_points(points).points, result.transform_points(points).points, atol=1e-9
    )


@pytest.mark.parametrize("deviation", [[0.0, 0.0, 0.0], [1.0, 0.5, 6.0]])
def test_soft_tissue_that_moves_by_itself_is_less_certain_along_its_motion_and_away_from_bones(deviation):
    still, moving = carried_result(1), carried_result(1)
    moving.soft_tissue_deviation_mm = np.array(deviation)
    rng = np.random.default_rng(1)
    points = np.concatenate([points_in(still, label, rng) for label in (0, 2)])
    before, after = (each.transform_points(points) for each in (still, moving))
    more = after.covariances - before.covariances
    np.testing.assert_allclose(more - more * np.eye(3), 0, atol=1e-12)
    soft = np.array([name == "displacement field" for name in after.moved_by])
    assert not more[~soft].any()
    added = np.diagonal(more[soft], axis1=1, axis2=2)
    labels = still.structure_labels
    bones = labels.to_world(np.argwhere(labels.voxels > 0)[:, ::-1])
    distance = KDTree(bones).query(points[soft])[0]
    order = np.argsort(distance)
    near, far = added[order[:20]], added[order[-20:]]
    assert (near.mean(axis=0) <= far.mean(axis=0)).all()
    assert (added <= (OWN_SHARE * np.array(deviation)) ** 2 + 1e-12).all()
    if any(deviation):
        np.testing.assert_allclose(added / added[:, :1], np.broadcast_to(np.square(deviation), added.shape))
