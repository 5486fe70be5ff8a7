"""The truth's grid grows as far as bones move: none of them is cut off at the CT's ends."""

from dataclasses import replace

import numpy as np
import pytest
from simulation_phantom import HEAD_CENTRE, phantom

from PolyPoseLib.cli.simulate import _bytes_of
from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.evaluation.score import score_motion
from PolyPoseLib.io.cases import write_case
from PolyPoseLib.io.truths import load_truth
from PolyPoseLib.simulation import fixed_grid
from PolyPoseLib.simulation.degradations.anatomy import bone_points
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


def test_a_field_on_the_cts_own_grid_is_scored_against_a_wider_truth(case):
    """Bones in the CT score as with the truth's own field; of the one that leaves, only the border's value is known."""
    ct = case.ct
    index = np.stack(np.meshgrid(*map(np.arange, ct.shape), indexing="ij"), -1)[..., ::-1]
    field = DisplacementField(
        case.field.sample(ct.to_world(index.reshape(-1, 3))).reshape(*ct.shape, 3), ct.affine
    )
    truth = truth_of(case)
    assert field.shape != truth.fixed_labels.shape
    scores, best = (
        score_motion(truth.fixed_to_moving, each, truth)["structures"] for each in (field, case.field)
    )
    for name in ("pelvis", "vertebrae_L5", "vertebrae_L4"):
        assert scores[name]["tre_mean_mm"] == pytest.approx(best[name]["tre_mean_mm"], abs=0.05)
        assert scores[name]["dice"] == pytest.approx(best[name]["dice"], abs=0.03)
    femur = scores["femur_left"]
    assert 10 < femur["tre_mean_mm"] < femur["rest_tre_mean_mm"] and femur["pose_tre_mean_mm"] < 1e-9


def test_bones_that_left_the_grid_are_where_the_ct_has_them(case):
    """Wires and implants are placed there, in the CT's world and not in that of the wider grid."""
    gone = case.fixed_labels.with_voxels(np.where(case.fixed_labels.voxels == 2, 0, case.fixed_labels.voxels))
    points = bone_points(replace(case, fixed_labels=gone), "femur_left")
    assert np.allclose(points, case.ct.to_world(np.argwhere(case.structures.labels == 2)[:, ::-1]))


def test_the_disk_space_asked_for_grows_with_the_grid(case):
    small = replace(case, fixed_ct=case.ct)
    assert _bytes_of(case) > _bytes_of(small)


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
