"""The compiled resampling against SimpleITK's and against the vote of numpy."""

import numpy as np
import pytest

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.geometry.grid import covering_grid
from PolyPoseLib.warp import dense
from PolyPoseLib.warp.dense import warp_labels, warp_volume

pytest.importorskip("numba")
SHAPE = (17, 14, 19)


def rough_field(affine, shape, seed, amplitude_mm=5.0) -> DisplacementField:
    vectors = np.random.default_rng(seed).normal(0, amplitude_mm, (*shape, 3))
    return DisplacementField(vectors.astype(np.float32), affine)


def blobs(affine, seed, dtype=np.int16) -> Volume:
    rng = np.random.default_rng(seed)
    coarse = rng.integers(0, 4, [-(-n // 3) for n in SHAPE])
    return Volume(np.kron(coarse, np.ones((3, 3, 3)))[tuple(map(slice, SHAPE))].astype(dtype), affine)


def without_kernel(monkeypatch, function, *arguments, **options):
    with monkeypatch.context() as patch:
        patch.setattr(dense, "_compiled", lambda: None)
        return function(*arguments, **options).voxels


def fields(affine_of, seed):
    """A field on a coarser parallel grid, one on the volume's own grid, and one whose axes are turned."""
    affine = affine_of(seed)
    own = rough_field(affine, SHAPE, seed)
    coarse = rough_field(*covering_grid(affine, SHAPE, 6.0, 4.0), seed)
    turned_grid = affine_of(seed + 2, (5.0, 6.0, 4.0))
    middle = affine[:3, :3] @ ((np.array(SHAPE[::-1]) - 1) / 2) + affine[:3, 3]
    turned_grid[:3, 3] = middle - turned_grid[:3, :3] @ np.array([5, 5, 5])
    return affine, (own, coarse, rough_field(turned_grid, (11, 11, 11), seed))


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_volumes_equal_simpleitk(affine_of, monkeypatch, seed):
    affine, candidates = fields(affine_of, seed)
    volume = Volume(np.random.default_rng(seed).normal(0, 300, SHAPE).astype(np.float32), affine)
    for field in candidates:
        compiled = warp_volume(volume, field).voxels
        plain = without_kernel(monkeypatch, warp_volume, volume, field)
        assert ((compiled == -1000) != (plain == -1000)).mean() < 1e-3
        both = (compiled != -1000) & (plain != -1000)
        assert both.mean() > 0.3
        assert np.abs(compiled - plain)[both].max() < 0.5


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.int32])
def test_labels_equal_the_vote(affine_of, monkeypatch, dtype):
    for seed in range(3):
        affine, candidates = fields(affine_of, seed)
        labels = blobs(affine, seed, dtype)
        for field in candidates:
            compiled = warp_labels(labels, field)
            assert compiled.voxels.dtype == dtype
            # Shares that are equal up to rounding may be decided either way.
            assert (compiled.voxels != without_kernel(monkeypatch, warp_labels, labels, field)).mean() < 1e-3


def test_warps_themselves_and_other_grids(bones, monkeypatch):
    warp, labels = bones.warp(), Volume(bones.structures.labels, bones.affine)
    grid, shape = covering_grid(bones.affine, bones.ct.shape, 3.0)
    reference = Volume(np.zeros(shape, np.int16), grid)
    monkeypatch.setattr(dense, "VOXELS_PER_SLAB", 5 * shape[1] * shape[2])
    for function, volume in ((warp_volume, bones.ct), (warp_labels, labels)):
        compiled = function(volume, warp, reference).voxels
        plain = without_kernel(monkeypatch, function, volume, warp, reference)
        assert compiled.shape == shape
        assert (np.abs(compiled - plain) < 0.5).mean() > 0.999


def test_rest_changes_nothing(affine_of):
    affine = affine_of(1)
    still = DisplacementField(np.zeros((*SHAPE, 3), np.float32), affine)
    labels = blobs(affine, 5)
    assert np.array_equal(warp_labels(labels, still).voxels, labels.voxels)
    volume = Volume(np.random.default_rng(5).normal(0, 300, SHAPE).astype(np.float32), affine)
    assert np.allclose(warp_volume(volume, still).voxels, volume.voxels, atol=0.01)


def test_a_volume_of_one_slice(affine_of):
    affine = affine_of(0)
    flat = Volume(np.arange(12, dtype=np.float32).reshape(1, 3, 4), affine)
    still = DisplacementField(np.zeros((1, 3, 4, 3), np.float32), affine)
    assert np.allclose(warp_volume(flat, still).voxels, flat.voxels)
