"""The warp by torch on a device: the fields, volumes and labels of the compiled loops, in bounded memory."""

import numpy as np
import pytest
import torch
from bones_case import Bones, motion
from pretended_gpu import CUDA

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.geometry.grid import covering_grid
from PolyPoseLib.warp import dense, torch_resample
from PolyPoseLib.warp.composition import compose_warped_ct, compose_warped_labels
from PolyPoseLib.warp.dense import displacement_field, warp_labels, warp_volume
from PolyPoseLib.warp.polyrigid import PolyrigidWarp
from PolyPoseLib.warp.torch_resample import TorchResampling

pytest.importorskip("numba")
SHAPE = (17, 14, 19)


@pytest.fixture(
    params=[
        "cpu",
        CUDA,
    ]
)
def device(request) -> torch.device:
    return torch.device(request.param)


def on(warp: PolyrigidWarp, device: torch.device) -> PolyrigidWarp:
    maps = warp.distances.to(device)
    return PolyrigidWarp(
        maps, warp.share, warp.poses, warp.frame, warp.form, warp.epsilon, None, warp.rotation_falloff
    )


def moved(bones: Bones, seed: int) -> np.ndarray:
    """Random motions of the three bones, up to some 30 degrees."""
    rng = np.random.default_rng(seed)
    return np.stack([motion(rng.normal(0, 12, 3), rng.normal(0, 4, 3), each) for each in bones.centroids])


def random_field(affine_of, seed: int) -> DisplacementField:
    """Rough displacements on the volume's grid, on a coarser parallel one, or on one whose axes are turned."""
    affine, rng = affine_of(seed), np.random.default_rng(seed)
    grid, shape = [
        (affine, SHAPE),
        covering_grid(affine, SHAPE, 6.0, 4.0),
        (affine_of(seed + 3), (11, 12, 13)),
    ][seed % 3]
    if seed % 3 == 2:
        middle = affine[:3, :3] @ ((np.array(SHAPE[::-1]) - 1) / 2) + affine[:3, 3]
        grid[:3, :3] *= 2
        grid[:3, 3] = middle - grid[:3, :3] @ np.array([6, 5.5, 5])
    return DisplacementField(rng.normal(0, 5, (*shape, 3)).astype(np.float32), grid)


def random_volume(affine: np.ndarray, seed: int) -> Volume:
    return Volume(np.random.default_rng(seed).normal(0, 500, SHAPE).astype(np.float32), affine)


def random_labels(affine: np.ndarray, seed: int, dtype=np.int16) -> Volume:
    coarse = np.random.default_rng(seed).integers(0, 2 if dtype is bool else 5, [-(-n // 3) for n in SHAPE])
    return Volume(np.kron(coarse, np.ones((3, 3, 3)))[tuple(map(slice, SHAPE))].astype(dtype), affine)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("form", ["rigid", "mass", "epsilon"])
@pytest.mark.parametrize("frame", ["moving", "fixed"])
def test_fields_are_those_of_the_compiled_loops(seed, form, frame, device):
    bones = Bones(seed % 3)
    warp = bones.warp(frame, form, moved(bones, seed), [None, 8.0, 40.0][seed // 2])
    grid, shape = covering_grid(bones.affine, bones.ct.shape, 5.0, 15.0)
    compiled = displacement_field(warp, grid, shape).vectors
    found = displacement_field(on(warp, device), grid, shape, device=device).vectors
    assert np.abs(found - compiled).max() < 1e-3
    assert np.abs(found).max() > 3


@pytest.mark.parametrize("seed", range(18))
def test_volumes_are_those_of_the_compiled_loops(affine_of, seed, device):
    volume, field = random_volume(affine_of(seed), seed), random_field(affine_of, seed)
    compiled, found = (warp_volume(volume, field, device=each).voxels for each in (None, device))
    assert found.dtype == np.float32
    outside = compiled == -1000
    assert 0.001 < outside.mean() < 0.7
    assert np.array_equal(found == -1000, outside)
    assert np.abs(found - compiled).max() < 1e-2


@pytest.mark.parametrize("seed", range(6))
def test_volumes_are_those_of_simpleitk(affine_of, seed, device, monkeypatch):
    volume, field = random_volume(affine_of(seed), seed), random_field(affine_of, seed)
    found = warp_volume(volume, field, device=device).voxels
    monkeypatch.setattr(dense, "_compiled", lambda: None)
    other = warp_volume(volume, field).voxels
    both = (found != -1000) & (other != -1000)
    assert ((found == -1000) != (other == -1000)).mean() < 1e-3
    assert np.abs(found - other)[both].max() < 1.0


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.uint16, np.int32, np.uint32, bool])
def test_labels_are_those_of_the_compiled_loops(affine_of, dtype, device):
    for seed in range(6):
        labels, field = random_labels(affine_of(seed), seed, dtype), random_field(affine_of, seed)
        compiled, found = (warp_labels(labels, field, device=each).voxels for each in (None, device))
        assert found.dtype == dtype
        assert len(np.unique(found)) == len(np.unique(labels.voxels))
        assert (found != compiled).mean() < 1e-4  # shares that are equal up to rounding may go either way


def test_of_equal_shares_the_smallest_label_wins(affine_of, device):
    affine = affine_of(0)
    labels = random_labels(affine, 1)
    halfway = np.broadcast_to(np.float32(affine[:3, 0] / 2), (*SHAPE, 3)).copy()
    field = DisplacementField(halfway, affine)
    found = warp_labels(labels, field, device=device).voxels
    assert np.array_equal(found[..., :-1], np.minimum(labels.voxels[..., :-1], labels.voxels[..., 1:]))
    assert np.array_equal(found, warp_labels(labels, field).voxels)


def test_warps_themselves_on_another_grid(bones, device, monkeypatch):
    """Point by point, by the warp as it is: the CT, its labels, and rigid bones laid over them."""
    poses = moved(bones, 1)
    warp = bones.warp(poses=poses)
    grid, shape = covering_grid(bones.affine, bones.ct.shape, 3.0)
    reference = Volume(np.zeros(shape, np.int16), grid)
    labels = Volume(bones.structures.labels, bones.affine)
    monkeypatch.setattr(dense, "VOXELS_PER_SLAB", 5 * shape[1] * shape[2])

    def everything(warp, device):
        yield warp_volume(bones.ct, warp, reference, device=device)
        yield compose_warped_ct(bones.ct, bones.structures, poses, warp, reference, device)
        yield warp_labels(labels, warp, reference, device=device)
        yield compose_warped_labels(labels, bones.structures, poses, warp, reference, device)

    pairs = zip(everything(warp, None), everything(on(warp, device), device), strict=True)
    for n, (compiled, found) in enumerate(pairs):
        off = np.abs(compiled.voxels.astype(float) - found.voxels)
        # The warps themselves differ by some 1e-5 mm, at edges from -1000 to 700 HU.
        assert (off > (0.05 if n < 2 else 0)).mean() < 1e-3


@pytest.mark.parametrize("seed", range(3))
def test_slabs_and_chunks_change_nothing(affine_of, seed, device, monkeypatch):
    affine, field = affine_of(seed), random_field(affine_of, seed)
    volume, labels = random_volume(affine, seed), random_labels(affine, seed)
    whole = [warp_volume(volume, field, device=device), warp_labels(labels, field, device=device)]
    monkeypatch.setattr(torch_resample, "VOXELS_PER_SLAB", 3 * SHAPE[1] * SHAPE[2])
    monkeypatch.setattr(torch_resample, "VOXELS_AT_ONCE", {device.type: 101})
    parts = [warp_volume(volume, field, device=device), warp_labels(labels, field, device=device)]
    for one, other in zip(whole, parts, strict=True):
        assert np.allclose(one.voxels, other.voxels, atol=1e-3, rtol=0)


@pytest.mark.parametrize("shift_mm", [0.0, 25.0, -1e4])
def test_a_slab_brings_only_the_layers_that_it_looks_at(affine_of, shift_mm, device, monkeypatch):
    affine = affine_of(0)
    tall = Volume(np.random.default_rng(0).normal(0, 500, (120, 6, 7)).astype(np.float32), affine)
    shift = np.float32(shift_mm * affine[:3, 2] / np.linalg.norm(affine[:3, 2]))
    field = DisplacementField(np.broadcast_to(shift, (120, 6, 7, 3)).copy(), affine)
    monkeypatch.setattr(torch_resample, "VOXELS_PER_SLAB", 10 * 6 * 7)
    layers, block = [], TorchResampling._block

    def noted(self, values, between):
        made = block(self, values, between)
        layers.append(made.shape[0])
        return made

    monkeypatch.setattr(TorchResampling, "_block", noted)
    found = warp_volume(tall, field, device=device).voxels
    assert np.abs(found - warp_volume(tall, field).voxels).max() < 1e-2
    assert len(layers) == 24 and max(layers) <= 15


def test_arrays_of_one_layer(affine_of, device):
    affine = affine_of(0)
    flat = Volume(np.arange(12, dtype=np.float32).reshape(1, 3, 4), affine)
    still = DisplacementField(np.zeros((1, 3, 4, 3), np.float32), affine)
    assert np.array_equal(warp_volume(flat, still, device=device).voxels, flat.voxels)
    labels = flat.with_voxels(flat.voxels.astype(np.int16))
    assert np.array_equal(warp_labels(labels, still, device=device).voxels, labels.voxels)
