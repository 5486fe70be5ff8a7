"""Scores: the truth scores perfectly, rest scores the motion itself, and folders keep everything."""

import numpy as np
import pytest
from simulation_phantom import HEAD_CENTRE, NAMES, phantom

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.errors import InputError
from PolyPoseLib.evaluation.score import camera_errors, rotation_between_deg, score_motion, score_result
from PolyPoseLib.geometry.grid import covering_grid
from PolyPoseLib.io.truths import load_truth, save_truth
from PolyPoseLib.simulation.motion import rigid_about
from PolyPoseLib.simulation.simulate import SimulationOptions, simulate_case, view_cameras
from PolyPoseLib.simulation.truth import truth_of

QUICK = SimulationOptions(projector="sum", node_mm=4.0, pad_mm=10.0)


@pytest.fixture(scope="module")
def truth():
    ct, structures, source = phantom(spacing=(4.0, 4.0, 4.0))
    motions = {
        "femur_left": rigid_about(HEAD_CENTRE, np.radians([8.0, 6.0, 0]), np.zeros(3)),
        "vertebrae_L4": rigid_about(np.array([0, 0, 50.0]), np.zeros(3), np.array([3.0, 4.0, 0])),
    }
    cameras = view_cameras(ct, pixels=16, detector_mm=350)
    case = simulate_case(ct, structures, motions, cameras, 1, QUICK, "pelvis", source)
    return truth_of(case, {5: "liver"})


def rest(truth):
    affine, shape = covering_grid(truth.fixed_ct.affine, truth.fixed_ct.shape, 4.0)
    return DisplacementField(np.zeros((*shape, 3), np.float32), affine)


def test_the_truth_scores_perfectly(truth):
    table = score_motion(truth.fixed_to_moving, truth.field, truth)
    for name in NAMES:
        row = table["structures"][name]
        assert row["pose_tre_max_mm"] < 1e-9 and row["pose_rotation_deg"] < 1e-6
        assert row["tre_mean_mm"] < 0.3
        assert row["dice"] > 0.93 and row["hd95_mm"] < 4.5
    assert table["organs"] == {"liver": pytest.approx(1.0, abs=0.05)}
    assert table["summary"]["soft_error_mean_mm"] < 1e-6
    assert table["summary"]["worst_tre_mm"] < 0.3


def test_rest_scores_the_motion(truth):
    table = score_motion(dict.fromkeys(NAMES, np.eye(4)), rest(truth), truth)
    assert table["structures"]["vertebrae_L4"]["tre_mean_mm"] == pytest.approx(5.0, abs=1e-6)
    assert table["structures"]["vertebrae_L4"]["pose_tre_max_mm"] == pytest.approx(5.0, abs=1e-6)
    assert table["structures"]["femur_left"]["pose_rotation_deg"] == pytest.approx(10.0, abs=1e-6)
    error = np.array(table["structures"]["vertebrae_L4"]["pose_error"])
    assert np.allclose(error, [0, 0, 0, -3, -4, 0], atol=1e-6)
    for row in table["structures"].values():
        assert row["tre_mean_mm"] == pytest.approx(row["rest_tre_mean_mm"], abs=1e-6)
    assert table["summary"]["folds_percent"] == 0 and table["summary"]["sd_log_jacobian"] == 0
    moving = [table["structures"][name]["tre_mean_mm"] for name in NAMES[1:]]
    assert table["summary"]["mean_tre_mm"] == pytest.approx(np.mean(moving))
    assert table["summary"]["worst_tre_mm"] == pytest.approx(max(moving))


def test_camera_errors_measure_what_moved(truth):
    true = truth.cameras[0]
    assert camera_errors(true, true, truth)["projection_max_mm"] < 1e-9
    shift = np.eye(4)
    shift[0, 3] = 2.5
    errors = camera_errors(true, true.with_extrinsic(true.extrinsic @ shift), truth)
    assert errors["projection_mean_mm"] == pytest.approx(2.5, abs=1e-6)
    assert errors["rotation_deg"] < 1e-6 and errors["source_mm"] == pytest.approx(2.5)


@pytest.mark.parametrize("degrees", [0.0, 1e-5, 12.0, 179.9, 180.0])
def test_the_angle_between_rotations_is_exact_everywhere(degrees):
    turned = rigid_about(np.ones(3), np.radians(degrees) * np.array([0.6, 0, 0.8]), np.ones(3))
    assert rotation_between_deg(np.eye(4), turned) == pytest.approx(degrees, abs=1e-6)


def test_a_truth_folder_keeps_everything(truth, tmp_path):
    again = load_truth(save_truth(truth, tmp_path / "truth"))
    assert again.names == truth.names and again.anchor == truth.anchor and again.seed == truth.seed
    assert again.organ_names == truth.organ_names and again.statistics == truth.statistics
    for name in NAMES:
        assert np.allclose(again.fixed_to_moving[name], truth.fixed_to_moving[name], atol=1e-12)
    for first, second in zip(again.cameras, truth.cameras, strict=True):
        assert np.allclose(first.extrinsic, second.extrinsic, atol=1e-12)
        assert (first.height, first.width) == (second.height, second.width)
    assert np.array_equal(again.fixed_labels.voxels, truth.fixed_labels.voxels)
    assert np.array_equal(again.moving_organs.voxels, truth.moving_organs.voxels)
    assert np.abs(again.fixed_ct.voxels - truth.fixed_ct.voxels).max() <= 0.51
    points = truth.fixed_ct.to_world(np.argwhere(truth.fixed_labels.voxels == 2)[:, ::-1])
    assert np.allclose(again.field(points), truth.field(points), atol=1e-3)


def test_what_is_no_truth_folder_is_refused(truth, tmp_path):
    with pytest.raises(InputError, match=r"truth\.json"):
        load_truth(tmp_path)
    folder = save_truth(truth, tmp_path / "truth")
    text = (folder / "truth.json").read_text()
    for wrong in (text.replace('"version": 1', '"version": 9'), text.replace('"anchor"', '"achor"'), "{"):
        (folder / "truth.json").write_text(wrong)
        with pytest.raises(InputError):
            load_truth(folder)


def test_a_result_of_another_study_is_refused(truth):
    from types import SimpleNamespace

    with pytest.raises(InputError, match="femur_left"):
        score_result(SimpleNamespace(structures={"pelvis": None}, cameras=[]), truth)
    with pytest.raises(InputError, match="cameras"):
        score_result(SimpleNamespace(structures=dict.fromkeys(NAMES), cameras=[]), truth)
