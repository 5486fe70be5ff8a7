"""A sequence is known again by digests: not by the last bit of a place, but by every voxel and every visible shift."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.tracking.track_inputs import PLACE_MM, inputs_of


def digest(affine, voxels=None):
    voxels = np.arange(24, dtype=np.int16).reshape(2, 3, 4) if voxels is None else voxels
    return inputs_of(
        SimpleNamespace(
            options=SimpleNamespace(first=0, last=None),
            views=(),
            frames=range(3),
            ct=SimpleNamespace(affine=affine, voxels=voxels),
            structures=SimpleNamespace(labels=np.ones((2, 3, 4), np.uint8)),
        )
    ).ct


def oblique(rng):
    affine = np.eye(4)
    spacing = rng.choice([0.48828125, 0.5, 0.6, 0.625, 1.25, 0.9765625], 3)
    affine[:3, :3] = Rotation.random(random_state=rng.integers(1 << 31)).as_matrix() * spacing
    affine[:3, 3] = rng.choice([-125.0, -249.51171875, 37.3, 1024.25], 3)
    return affine


def opened_again(affine):
    """As applications keep an affine: directions of length 1, and spacings."""
    out = affine.copy()
    for _time in range(2):
        spacing = np.linalg.norm(out[:3, :3], axis=0)
        out[:3, :3] = out[:3, :3] / spacing * spacing
    return out


@pytest.mark.parametrize("seed", range(20))
def test_a_ct_that_was_saved_and_opened_is_the_same(seed):
    affine = oblique(np.random.default_rng(seed))
    again = opened_again(affine)
    assert digest(again) == digest(affine)
    straight = np.diag([0.48828125, 0.6, 1.25, 1.0])
    assert digest(np.nextafter(straight, 2)) == digest(np.nextafter(straight, 0)) == digest(straight)


def test_another_place_and_other_voxels_are_others():
    affine = oblique(np.random.default_rng(0))
    moved = affine.copy()
    moved[0, 3] += 2 * PLACE_MM
    voxels = np.arange(24, dtype=np.int16).reshape(2, 3, 4)
    voxels[1, 2, 3] += 1
    assert len({digest(affine), digest(moved), digest(affine, voxels)}) == 3


def test_the_last_bit_does_change_when_a_ct_is_opened_again():
    """Else the first property would say nothing."""
    affines = [oblique(np.random.default_rng(seed)) for seed in range(20)]
    assert any((opened_again(each) != each).any() for each in affines)
