"""A bone behind metal: found where its outline shows, held near its neighbour and doubted where it does not."""

from dataclasses import replace

import numpy as np
import pytest
from phantom_study import case, study
from scipy.ndimage import binary_dilation

from PolyPoseLib.evaluation.metrics import mask_points, structure_errors
from PolyPoseLib.pipeline import register
from PolyPoseLib.registration import run

FEMUR, NAME = 1, "femur_left"

SEEDS = [0, *(pytest.param(seed, marks=pytest.mark.long) for seed in (1, 2))]


def femur_points(simulated):
    """(N, 3) LPS mm of the femur's voxels in the X-rays' posture."""
    points = mask_points(simulated.structures.labels == FEMUR + 1, simulated.ct.affine)
    back = np.linalg.inv(simulated.fixed_to_moving[NAME])
    return points @ back[:3, :3].T + back[:3, 3]


def covered(simulated, chosen):
    """The case with metal over the projections of chosen points (N, 3)."""
    images = []
    for image, camera in zip(simulated.images, simulated.cameras, strict=True):
        column, row = np.rint(camera.project(chosen)).astype(int).T
        inside = (row >= 0) & (row < image.shape[0]) & (column >= 0) & (column < image.shape[1])
        metal = np.zeros(image.shape, bool)
        metal[row[inside], column[inside]] = True
        images.append((image + 6.0 * binary_dilation(metal)).astype(np.float32))
    return replace(simulated, images=images)


def error_and_doubts(simulated):
    """Mean error of the femur in mm and at rest, and what speaks against its pose."""
    result = register(study(simulated, camera="known"))
    names = simulated.structures.names
    true = np.stack([simulated.fixed_to_moving[name] for name in names])
    found = np.stack([result.structures[name].fixed_to_moving for name in names])
    sizes = simulated.structures.labels, simulated.ct.affine, names, true
    rest = np.tile(np.eye(4), (len(names), 1, 1))
    errors, at_rest = (structure_errors(*sizes, poses)[NAME]["mean"] for poses in (found, rest))
    return errors, at_rest, result.structures[NAME].doubts


@pytest.mark.long
@pytest.mark.parametrize("seed", range(3))
def test_a_bone_behind_metal_is_held_and_doubted(seed, monkeypatch):
    simulated = case(seed=seed)
    hidden = covered(simulated, femur_points(simulated))
    error, rest, doubts = error_and_doubts(hidden)
    assert any("hides" in doubt or "shows in no X-ray" in doubt for doubt in doubts)
    monkeypatch.setattr(run, "HELD", 0.0)
    error_when_free, _rest, _doubts = error_and_doubts(hidden)
    assert error < min(1.5 * rest, 0.8 * error_when_free)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_bone_with_a_wire_is_found(seed):
    simulated = case(seed=seed)
    points = femur_points(simulated)
    middle, axis = points.mean(0), np.linalg.svd(points - points.mean(0), full_matrices=False)[2][0]
    wire = middle + np.linspace(-40, 40, 400)[:, None] * axis
    error, rest, _doubts = error_and_doubts(covered(simulated, wire))
    assert error < min(1.5, rest / 2)
