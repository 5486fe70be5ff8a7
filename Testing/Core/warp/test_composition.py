"""Composition: bones exactly rigid, soft tissue without ghosts of bone."""

import numpy as np
import pytest
import torch
from scipy.ndimage import gaussian_filter, map_coordinates

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.warp.composition import (
    compose_warped_ct,
    compose_warped_labels,
    fill_structures,
    grow_regions,
)
from PolyPoseLib.warp.dense import displacement_field, warp_volume


def at_rest(bones):
    return np.stack([np.eye(4)] * 3), DisplacementField(np.zeros((*bones.ct.shape, 3)), bones.affine)


def test_at_rest_the_ct_and_the_labels_stay_as_they_are(bones):
    rng = np.random.default_rng(0)
    ct = bones.ct.with_voxels(bones.ct.voxels + rng.normal(0, 30, bones.ct.shape).astype(np.float32))
    poses, field = at_rest(bones)
    assert np.abs(compose_warped_ct(ct, bones.structures, poses, field).voxels - ct.voxels).max() < 1e-2
    labels = Volume(bones.structures.labels, bones.affine)
    assert np.array_equal(compose_warped_labels(labels, bones.structures, poses, field).voxels, labels.voxels)


def test_moved_bones_are_the_rigidly_resampled_ct(bones):
    """Every voxel whose moving place is well inside a bone shows that place's value, whatever the field."""
    rng = np.random.default_rng(1)
    noisy = np.where(bones.structures.labels > 0, rng.normal(700, 80, bones.ct.shape), bones.ct.voxels)
    ct = bones.ct.with_voxels(noisy.astype(np.float32))
    field = displacement_field(bones.warp("fixed", "epsilon"), bones.affine, bones.ct.shape)
    composed = compose_warped_ct(ct, bones.structures, bones.poses, field)
    places = composed.to_world(np.argwhere(np.ones(composed.shape))[:, ::-1])
    distance = bones.distances.under(torch.as_tensor(places), torch.as_tensor(bones.poses)).numpy()
    for n in (1, 2):
        moved = places @ bones.poses[n, :3, :3].T + bones.poses[n, :3, 3]
        index = ct.to_index(moved)
        inside = (distance[n] == 0) & (np.delete(distance, n, axis=0) > 3).all(axis=0)
        assert inside.sum() > 50
        expected = map_coordinates(ct.voxels, index[inside][:, ::-1].T, order=1)
        assert np.abs(composed.voxels.ravel()[inside] - expected).max() < 0.1


def test_the_filled_ct_shows_no_trace_of_bone():
    """A bright bone with a blurred rim in uniform tissue: filled, the tissue is uniform again."""
    labels = np.zeros((24, 26, 28), dtype=np.int16)
    labels[8:16, 9:17, 9:19] = 1
    ct = 40 + 900 * gaussian_filter((labels > 0).astype(float), 0.6)
    filled = fill_structures(ct, labels, np.ones(3))
    assert filled.dtype == np.float32
    assert np.abs(filled - 40).max() < 12
    halo = fill_structures(ct, labels, np.ones(3), grow=False)
    assert np.abs(halo - 40).max() > 60


def test_a_cortex_that_the_label_missed_goes_with_the_bone():
    labels = np.zeros((20, 20, 20), dtype=np.int16)
    labels[8:12, 8:12, 8:12] = 1
    ct = np.full(labels.shape, 40.0)
    ct[6:14, 6:14, 6:14] = 900
    grown = grow_regions(ct, labels, np.ones(3))
    assert (grown[ct == 900] == 1).mean() > 0.98
    assert np.abs(fill_structures(ct, labels, np.ones(3))[10, 10, :] - 40).max() < 1
    far = ct.copy()
    far[10, 10, 14:20] = 900
    assert not grow_regions(far, labels, np.ones(3))[10, 10, 16:].any()


def test_regions_keep_labels_and_share_the_gap_by_distance():
    labels = np.zeros((9, 9, 14), dtype=np.int16)
    labels[3:6, 3:6, 2:5] = 1
    labels[3:6, 3:6, 7:10] = 2
    ct = np.full(labels.shape, 700.0)
    grown = grow_regions(ct, labels, np.ones(3))
    assert np.array_equal(grown[labels > 0], labels[labels > 0])
    assert (grown[3:6, 3:6, 5] == 1).all()
    assert (grown[3:6, 3:6, 6] == 2).all()
    assert grow_regions(ct, labels, np.ones(3), rim_voxels=0).max() == 2


def test_bones_that_part_leave_soft_tissue_between_them(motion_of):
    """Two blocks that touch and open like a jaw: the warp stretches bone over the gap, composition does not."""
    labels = np.zeros((30, 30, 44), dtype=np.int16)
    labels[8:22, 8:22, 6:20] = 1
    labels[8:22, 8:22, 20:34] = 2
    affine = np.diag([1.5, 1.5, 1.5, 1.0])
    ct = Volume(np.where(labels > 0, 900, 40).astype(np.float32), affine)
    structures = Structures(("skull", "jaw"), labels)
    poses = np.stack([np.eye(4), motion_of((0, 0, 0), (-9.0, 0, 0), np.zeros(3))])
    index = np.argwhere(np.ones(labels.shape))[:, 2].reshape(labels.shape) * 1.5
    share = np.clip((index - 29) / 12, 0, 1)[..., None]
    field = DisplacementField(share * np.array([-9.0, 0, 0]), affine)
    warped = warp_volume(ct, field).voxels
    composed = compose_warped_ct(ct, structures, poses, field).voxels
    gap = composed[12:18, 12:18, 22:24]
    assert warped[12:18, 12:18, 22:24].min() > 800
    assert np.abs(gap - 40).max() < 5
    assert np.abs(composed[9:21, 9:21, 27:39] - 900).max() < 1
    moved = compose_warped_labels(Volume(labels, affine), structures, poses, field)
    assert np.array_equal(moved.voxels == 2, np.roll(labels == 2, 6, axis=2))


def test_labels_beside_the_structures_follow_the_warp(bones):
    """A source segmentation keeps its own numbers; organs move by the field, bones by their poses."""
    source = np.where(bones.structures.labels > 0, bones.structures.labels + 40, 0).astype(np.uint8)
    source[20:26, 26:33, 12:20] = 7
    poses, field = at_rest(bones)
    shift = DisplacementField(
        field.vectors + (bones.affine[:3, :3] @ [2, 0, 0]).astype(np.float32), bones.affine
    )
    found = compose_warped_labels(Volume(source, bones.affine), bones.structures, poses, shift).voxels
    assert found.dtype == np.uint8
    assert np.array_equal(found > 40, source > 40)
    assert (found[20:26, 26:33, 10:18] == 7).all()
    assert not (found[20:26, 26:33, 18:20] == 7).any()


def test_onto_another_grid_and_out_of_it(bones, motion_of):
    reference = Volume(np.zeros((15, 18, 20)), bones.affine @ np.diag([2.0, 2, 2, 1]))
    poses, field = at_rest(bones)
    composed = compose_warped_ct(bones.ct, bones.structures, poses, field, reference)
    assert np.abs(composed.voxels - bones.ct.voxels[::2, ::2, ::2]).max() < 0.1
    gone = np.stack([motion_of((0, 0, 0), (5000, 0, 0), np.zeros(3))] * 3)
    assert compose_warped_ct(bones.ct, bones.structures, gone, field).voxels.max() < 100


def test_what_does_not_fit_is_refused(bones):
    poses, field = at_rest(bones)
    with pytest.raises(InputError, match="3 structures"):
        compose_warped_ct(bones.ct, bones.structures, poses[:2], field)
    with pytest.raises(InputError, match="motion of 'limb'"):
        compose_warped_ct(bones.ct, bones.structures, poses * np.array([1, 2, 1])[:, None, None], field)
    with pytest.raises(InputError, match="resample"):
        fill_structures(bones.ct.voxels, np.zeros((3, 3, 3), bool), np.ones(3))
