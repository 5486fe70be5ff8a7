"""Warps on grids: fields against points, inverses, Jacobians, resampling against SimpleITK."""

import sys

import numpy as np
import pytest
import SimpleITK as sitk
import torch
from scipy.ndimage import map_coordinates

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.grid import covering_grid
from PolyPoseLib.warp import dense
from PolyPoseLib.warp.dense import (
    displacement_field,
    jacobian_determinant,
    warp_labels,
    warp_volume,
)
from PolyPoseLib.warp.inverse import invert_field


def noise(shape, affine, seed=0) -> Volume:
    return Volume(np.random.default_rng(seed).normal(0, 300, shape).astype(np.float32), affine)


def bend(affine, shape, amplitude_mm=6.0) -> DisplacementField:
    """A smooth field without folds: sines of half a period along each axis."""
    index = np.stack(np.meshgrid(*(np.arange(n) for n in shape), indexing="ij"), axis=-1)
    phase = np.pi * index / (np.array(shape) - 1)
    waves = np.stack([np.sin(phase[..., 0]), np.cos(phase[..., 1]), np.sin(phase[..., 2] + 1)], axis=-1)
    return DisplacementField(amplitude_mm * waves, affine)


def linear_field(affine, shape, matrix, offset) -> DisplacementField:
    nodes = np.argwhere(np.ones(shape))[:, ::-1] @ affine[:3, :3].T + affine[:3, 3]
    center = nodes.mean(axis=0)
    moved = (nodes - center) @ matrix.T + center + offset
    return DisplacementField((moved - nodes).reshape(*shape, 3), affine)


def test_field_equals_the_warp_at_its_nodes(bones):
    grid, shape = covering_grid(bones.affine, bones.ct.shape, 4.0)
    warp = bones.warp()
    field = displacement_field(warp, grid, shape)
    nodes = np.argwhere(np.ones(shape))[:, ::-1] @ grid[:3, :3].T + grid[:3, 3]
    assert np.abs(field(nodes) - warp(torch.as_tensor(nodes)).numpy()).max() < 2e-3
    double = displacement_field(warp, grid, shape, single=False)
    assert np.abs(double(nodes) - warp(torch.as_tensor(nodes)).numpy()).max() < 1e-5


def test_finer_fields_come_closer_to_the_warp(straight_bones):
    warp, points = straight_bones.warp("fixed", "mass"), straight_bones.somewhere(3000)
    exact = warp(torch.as_tensor(points)).numpy()
    errors = []
    for spacing_mm in (8.0, 4.0, 2.0):
        field = displacement_field(
            warp, *covering_grid(straight_bones.affine, straight_bones.ct.shape, spacing_mm)
        )
        errors.append(np.linalg.norm(field(points) - exact, axis=1).mean())
    assert errors[2] < errors[1] < errors[0]
    assert errors[1] < 0.1


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_inverse_undoes_the_field(affine_of, seed):
    field = bend(affine_of(seed), (14, 17, 16))
    inverse = invert_field(field)
    assert inverse.largest_residual_mm < 1e-3
    nodes = np.argwhere(np.ones(field.shape))[:, ::-1] @ field.affine[:3, :3].T + field.affine[:3, 3]
    assert np.linalg.norm(field(inverse.field(nodes)) - nodes, axis=1).max() < 2e-3


def test_inverse_converges_where_the_field_stretches(affine_of):
    """Fixed points with a whole step diverge for stretches above 2; halved steps do not."""
    affine, shape = affine_of(0), (8, 9, 10)
    field = linear_field(affine, shape, np.diag([2.6, 0.5, 1.4]), np.array([1.0, -2, 3]))
    center = affine[:3, :3] @ ((np.array(shape[::-1]) - 1) / 2) + affine[:3, 3]
    small = affine.copy()
    small[:3, :3] *= 0.2
    small[:3, 3] = center - small[:3, :3] @ [2, 2, 2]
    inverse = invert_field(field, small, (5, 5, 5))
    assert inverse.largest_residual_mm < 1e-3


def test_inverse_of_the_polyrigid_warp(straight_bones):
    grid, shape = covering_grid(straight_bones.affine, straight_bones.ct.shape, 3.0)
    inverse = invert_field(displacement_field(straight_bones.warp("moving", "mass"), grid, shape))
    assert inverse.residual_mm.mean() < 1e-3
    assert (inverse.residual_mm < 2e-3).mean() > 0.999


def test_residual_tells_where_a_folded_field_has_no_inverse(affine_of):
    field = linear_field(affine_of(0), (8, 8, 8), np.diag([-1.0, 1, 1]), np.zeros(3))
    shifted = DisplacementField(field.vectors + 3.0, field.affine)
    assert invert_field(shifted, iterations=20).largest_residual_mm > 0.1


def test_inverse_needs_a_whole_grid(affine_of):
    with pytest.raises(InputError, match="both affine and shape"):
        invert_field(bend(affine_of(0), (5, 5, 5)), affine=np.eye(4))


@pytest.mark.parametrize("seed", [0, 1, 2, 3])
def test_determinant_of_a_linear_map(affine_of, seed):
    """Whatever the axes of the grid, left-handed ones included."""
    matrix = np.eye(3) + np.random.default_rng(seed).normal(0, 0.3, (3, 3))
    field = linear_field(affine_of(seed), (6, 7, 8), matrix, np.ones(3))
    assert np.abs(jacobian_determinant(field) - np.linalg.det(matrix)).max() < 1e-4


@pytest.mark.parametrize("seed", range(4))
def test_determinant_is_the_same_with_and_without_compiled_loops(affine_of, seed):
    pytest.importorskip("numba")
    rng = np.random.default_rng(seed)
    shape = tuple(int(n) for n in rng.integers(2, 12, 3))
    field = DisplacementField(rng.normal(0, 2, (*shape, 3)), affine_of(seed))
    axes = np.ascontiguousarray(field.affine[:3, :3])
    plain = dense._determinant_in_slabs(field, axes, np.empty(shape, np.float32))
    np.testing.assert_allclose(jacobian_determinant(field), plain, rtol=1e-4, atol=1e-4)


def test_determinant_agrees_with_the_warps_own(bones):
    warp = bones.warp("fixed", "epsilon")
    field = displacement_field(warp, bones.affine, bones.ct.shape)
    nodes = np.argwhere(np.ones(field.shape))[:, ::-1] @ field.affine[:3, :3].T + field.affine[:3, 3]
    exact = warp.jacobian_determinant(torch.as_tensor(nodes)).numpy().reshape(field.shape)
    error = np.abs(jacobian_determinant(field) - exact)[1:-1, 1:-1, 1:-1]
    assert error.mean() < 0.01
    assert np.percentile(error, 99) < 0.1


def test_slabs_do_not_show(affine_of, monkeypatch):
    field = bend(affine_of(2), (15, 12, 13))
    volume = noise((15, 12, 13), affine_of(2))
    labels = volume.with_voxels((volume.voxels > 0).astype(np.int16))
    whole = [
        jacobian_determinant(field),
        warp_volume(volume, field).voxels,
        warp_labels(labels, field).voxels,
    ]
    monkeypatch.setattr(dense, "VOXELS_PER_SLAB", 400)
    monkeypatch.setitem(sys.modules, "PolyPoseLib.warp.determinant_kernel", None)  # as without numba
    parts = [
        jacobian_determinant(field),
        warp_volume(volume, field).voxels,
        warp_labels(labels, field).voxels,
    ]
    for a, b in zip(whole, parts, strict=True):
        assert np.abs(a.astype(float) - b).max() < 1e-3


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_resampling_agrees_with_simpleitk(affine_of, seed):
    """One call of SimpleITK on the whole grid with the stored transform, against ours by slabs."""
    volume = noise((16, 18, 20), affine_of(seed))
    field = bend(*covering_grid(volume.affine, volume.shape, 5.0))
    expected = sitk.Resample(
        volume.to_sitk(), volume.to_sitk(), field.to_sitk_transform(), sitk.sitkLinear, -1000.0
    )
    found = warp_volume(volume, field).voxels
    difference = np.abs(found - sitk.GetArrayFromImage(expected))
    assert (difference > 0.1).mean() < 2e-3  # voxels that land on the outermost half voxel to within rounding
    labels = volume.with_voxels(np.random.default_rng(seed).integers(0, 5, volume.shape).astype(np.uint8))
    expected = sitk.Resample(
        labels.to_sitk(), labels.to_sitk(), field.to_sitk_transform(), sitk.sitkNearestNeighbor
    )
    found = warp_labels(labels, field, method="nearest")
    assert found.voxels.dtype == np.uint8
    assert (found.voxels != sitk.GetArrayFromImage(expected)).mean() < 2e-3


def test_onto_an_oblique_reference(affine_of):
    volume = noise((16, 18, 20), affine_of(1))
    reference = Volume(np.zeros((9, 10, 11)), affine_of(2))
    reference.affine[:3, 3] += volume.bounds_center - reference.bounds_center
    field = bend(*covering_grid(reference.affine, reference.shape, 4.0), amplitude_mm=3.0)
    other = bend(*covering_grid(volume.affine, volume.shape, 4.0), amplitude_mm=3.0)
    for used in (field, other):
        found = warp_volume(volume, used, reference)
        points = reference.to_world(np.argwhere(np.ones(reference.shape))[:, ::-1])
        moved = Volume(volume.voxels, volume.affine)
        index = moved.to_index(used(points))
        inside = ((index > 0) & (index < np.array(volume.shape[::-1]) - 1)).all(1).reshape(reference.shape)
        expected = map_coordinates(volume.voxels, index[:, ::-1].T, order=1).reshape(reference.shape)
        assert inside.mean() > 0.3
        assert np.abs(found.voxels - expected)[inside].max() < 0.1
        assert np.array_equal(found.affine, reference.affine)


def test_identity_and_outside(affine_of):
    volume = noise((8, 9, 10), affine_of(1))
    rest = DisplacementField(np.zeros((2, 2, 2, 3)), covering_grid(volume.affine, volume.shape, 50.0)[0])
    assert np.abs(warp_volume(volume, rest).voxels - volume.voxels).max() < 1e-2
    away = DisplacementField(np.full((2, 2, 2, 3), 500.0), rest.affine)
    assert (warp_volume(volume, away).voxels == -1000).all()
    labels = volume.with_voxels((volume.voxels > 0).astype(np.int32))
    assert np.array_equal(warp_labels(labels, rest).voxels, labels.voxels)
    assert not warp_labels(labels, away).voxels.any()


def test_a_warp_itself_can_be_given(straight_bones):
    """Evaluated at every voxel it leaves bones exact, where a coarse field blurs their borders."""
    warp = straight_bones.warp()
    field = displacement_field(warp, straight_bones.affine, straight_bones.ct.shape)
    by_warp, by_field = (warp_volume(straight_bones.ct, w).voxels for w in (warp, field))
    assert np.abs(by_warp - by_field).max() < 1.0


def test_labels_must_be_whole_numbers(affine_of):
    volume = noise((4, 4, 4), affine_of(0))
    field = bend(affine_of(0), (4, 4, 4))
    with pytest.raises(InputError, match="whole numbers"):
        warp_labels(volume, field)
    with pytest.raises(InputError, match="nearest"):
        warp_labels(volume.with_voxels(np.zeros((4, 4, 4), int)), field, method="cubic")
    with pytest.raises(InputError, match="Jacobian"):
        jacobian_determinant(DisplacementField(np.zeros((1, 4, 4, 3)), affine_of(0)))
