"""The truth's grid grows as far as bones move: none of them is cut off at the CT's ends."""

from dataclasses import replace

import numpy as np
import pytest
from simulation_phantom import HEAD_CENTRE, phantom

from PolyPoseLib.evaluation.score import score_motion
from PolyPoseLib.io.cases import write_case
from PolyPoseLib.io.truths import load_truth
from PolyPoseLib.simulation import fixed_grid
from PolyPoseLib.simulation.fixed_grid import FixedGrid, room_for
from PolyPoseLib.simulation.motion import rigid_about
from PolyPoseLib.simulation.simulate import SimulationOptions, simulate_case, view_cameras
from PolyPoseLib.simulation.truth import truth_of

QUICK = SimulationOptions(projector="sum", node_mm=6.0, pad_mm=10.0)


def far(degrees=90.0):
    """The femur bent until it points forwards, clear of the pelvis and out of the CT."""
    return {"femur_left": rigid_about(HEAD_CENTRE, np.radians([-degrees, 0, 0]), np.array([0.0, -60.0, 0.0]))}


@pytest.fixture(scope="module", params=[1, -1])
def case(request):
    ct, structures, source = phantom(handedness=request.param)
    cameras = view_cameras(ct, pixels=32, detector_mm=350)
    return simulate_case(ct, structures, far(), cameras, 0, QUICK, "pelvis", source)


def test_no_voxel_of_a_bone_is_lost(case):
    before, after = (case.structures.labels == 2).sum(), (case.fixed_labels.voxels == 2).sum()
    assert after == pytest.approx(before, rel=0.05)
    assert (case.fixed_source_labels.voxels == 20).sum() == after
    assert case.statistics["structures"]["femur_left"]["outside_grid"] == 0


def test_the_grid_holds_the_cts_own(case):
    assert case.fixed_labels.shape != case.ct.shape
    offset = case.fixed_ct.to_index(case.ct.affine[:3, 3])
    assert np.allclose(offset, np.rint(offset), atol=1e-9) and (offset > -1e-9).all()
    pelvis = case.ct.to_world(np.argwhere(case.structures.labels == 1)[:, ::-1])
    index = np.rint(case.fixed_labels.to_index(pelvis)).astype(int)[:, ::-1]
    assert (case.fixed_labels.voxels[tuple(index.T)] == 1).all()


def test_a_truth_on_a_wider_grid_is_read_and_scored(case, tmp_path):
    write_case(case, tmp_path, image_format="nifti")
    truth = load_truth(tmp_path / "truth")
    assert truth.moving_labels.same_grid(truth.fixed_labels)
    scores = score_motion(truth.fixed_to_moving, truth.field, truth)
    assert scores["summary"]["mean_tre_mm"] < 1.5 and scores["summary"]["mean_pose_tre_mm"] < 1e-9


def test_without_far_motion_the_grid_is_the_cts():
    ct, structures, source = phantom(spacing=(6.0, 6.0, 6.0))
    cameras = view_cameras(ct, pixels=16, detector_mm=350)
    case = simulate_case(ct, structures, {}, cameras, 0, QUICK, "pelvis", source)
    truth = truth_of(case)
    for volume in (case.fixed_ct, case.fixed_labels, truth.moving_labels, truth.moving_organs):
        assert volume.shape == ct.shape and np.array_equal(volume.affine, ct.affine)


def test_room_is_given_as_far_as_memory_goes(monkeypatch):
    ct, structures, _ = phantom()
    away = np.eye(4)
    away[0, 3] = 1000.0
    poses = [np.eye(4), away, np.eye(4), np.eye(4)]
    room = room_for(structures, ct.affine, poses)
    assert room[0, 2] > 200 and not room[1].any() and not room[:, :2].any()
    whole = FixedGrid.around(ct, 8.0, 4.0, room)
    assert whole.pad[2] == room[0, 2]
    monkeypatch.setattr(fixed_grid, "MOST_VOXELS", 2 * ct.voxels.size)
    some = FixedGrid.around(ct, 8.0, 4.0, room)
    assert np.prod(some.shape) <= 2 * ct.voxels.size and 2 <= some.pad[2] < room[0, 2]
    assert some.core(np.zeros(some.shape)).shape == ct.shape


def test_what_leaves_even_this_grid_is_told(monkeypatch):
    ct, structures, source = phantom(spacing=(6.0, 6.0, 6.0))
    monkeypatch.setattr(fixed_grid, "MOST_VOXELS", 1)
    cameras = view_cameras(ct, pixels=16, detector_mm=350)
    case = simulate_case(ct, structures, far(), cameras, 0, replace(QUICK, pad_mm=0.0), "pelvis", source)
    assert case.statistics["structures"]["femur_left"]["outside_grid"] > 0.2
