"""A bone that lies elsewhere in a second scan is found there, whatever the grids."""

import numpy as np
import pytest
from two_postures import moved, rigid

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.simulation.anchor_alignment import align_anchor


def _bone(points):
    """A body of a vertebra with a process at its back and one at its side."""
    solids = [((0, 0, 0), (20, 15, 12)), ((2, 22, -5), (5, 14, 7)), ((-22, 6, 3), (12, 5, 5))]
    return np.any(
        [(((points - centre) / np.array(radii)) ** 2).sum(-1) < 1 for centre, radii in solids], axis=0
    )


def _mask(affine, shape, motion=None):
    k, j, i = np.indices(shape)
    points = moved(affine, np.stack([i, j, k], axis=-1).astype(float))
    return Volume(_bone(points if motion is None else moved(np.linalg.inv(motion), points)), affine)


def _grid(spacing, centre, shape, signs=(1, 1, 1)):
    affine = np.diag([*np.multiply(spacing, signs), 1.0])
    affine[:3, 3] = centre - affine[:3, :3] @ (np.array(shape[::-1]) - 1) / 2
    return affine


@pytest.mark.parametrize("seed", range(2))
def test_the_motion_between_the_scans_is_found(seed):
    rng = np.random.default_rng(seed)
    motion = rigid(rng.normal(size=3), rng.uniform(3, 25), rng.uniform(-30, 30, 3))
    shape = (40, 44, 46)
    first = _mask(_grid((2.1, 1.8, 2.5), (0, 5, 0), shape), shape)
    there = moved(motion, np.array([0.0, 5.0, 0.0]))
    second = _mask(_grid((1.9, 2.2, 2.4), there, shape, (-1, 1, 1)), shape, motion)
    found = align_anchor(first, second)
    points = np.random.default_rng(9).uniform(-20, 20, (50, 3))
    assert np.linalg.norm(moved(found.to_first @ motion, points) - points, axis=1).max() < 1.0
    assert found.residual_mm < 0.7
    cosine = (np.trace(motion[:3, :3]) - 1) / 2
    assert found.moved_deg == pytest.approx(np.degrees(np.arccos(cosine)), abs=2)


@pytest.mark.long
def test_another_bone_leaves_a_residual():
    shape = (40, 44, 46)
    affine = _grid((2.0, 2.0, 2.0), (0, 5, 0), shape)
    first = _mask(affine, shape)
    k, j, i = np.indices(shape)
    points = moved(affine, np.stack([i, j, k], axis=-1).astype(float))
    rod = Volume((np.abs(points - [0, 5, 0]) < [6, 6, 36]).all(axis=-1), affine)
    assert align_anchor(first, rod).residual_mm > 2.5


def test_an_empty_mask_is_refused():
    empty = Volume(np.zeros((9, 9, 9), bool), np.eye(4))
    with pytest.raises(InputError, match="fewer than"):
        align_anchor(empty, empty)
