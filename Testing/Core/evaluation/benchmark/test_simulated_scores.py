"""A simulated case, whose bones move each by itself and whose labels were posed by another program than the warp."""

import numpy as np
import pytest
from simulation_phantom import HEAD_CENTRE, phantom

from PolyPoseLib.data.benchmark.case import BenchmarkCase, CaseTruth
from PolyPoseLib.data.benchmark.system import Motion
from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.evaluation.benchmark.scores import score_case
from PolyPoseLib.simulation.case_study import case_to_study
from PolyPoseLib.simulation.motion import rigid_about
from PolyPoseLib.simulation.simulate import SimulationOptions, simulate_case, view_cameras

LABELS = {"pelvis": (10,), "femur_left": (20,), "vertebrae_L4": (40,), "liver": (5,)}


@pytest.mark.parametrize("handedness", [pytest.param(1, marks=pytest.mark.long), -1])
def test_the_true_field_of_a_simulation_scores_one_within_a_voxel(handedness):
    ct, structures, source = phantom(spacing=(4.0, 4.0, 5.0), handedness=handedness)
    motions = {
        "femur_left": rigid_about(HEAD_CENTRE, np.radians([8.0, 6.0, 0]), np.zeros(3)),
        "vertebrae_L4": rigid_about(np.array([0, 0, 50.0]), np.zeros(3), np.array([3.0, 4.0, 0])),
    }
    options = SimulationOptions(projector="sum", node_mm=4.0, pad_mm=10.0)
    cameras = view_cameras(ct, pixels=16, detector_mm=350)
    made = simulate_case(ct, structures, motions, cameras, 1, options, "pelvis", source)
    truth = CaseTruth(
        tuple(made.cameras), made.fixed_source_labels, made.fixed_ct, made.field, made.fixed_to_moving
    )
    groups = {"bones": ("pelvis", "femur_left", "vertebrae_L4"), "soft organs": ("liver",)}
    case = BenchmarkCase(
        "phantom-2x30",
        "simulated",
        "phantom",
        "2x30",
        case_to_study(made, camera="known"),
        LABELS,
        groups,
        truth,
    )
    table = score_case(case, Motion(made.field, made.fixed_to_moving))
    for row in table["structures"].values():
        assert row["dice"] > 0.93 and row["hd95_mm"] <= 5.0
        assert row["tre_mean_mm"] < 0.3
    assert table["groups"]["bones"]["pose_tre_mean_mm"] < 1e-9
    still = DisplacementField(np.zeros((2, 2, 2, 3)), np.diag([400.0, 400.0, 400.0, 1.0]))
    at_rest = score_case(case, Motion(still))["structures"]
    assert at_rest["vertebrae_L4"]["tre_mean_mm"] == pytest.approx(5.0, abs=1e-6)
    assert at_rest["femur_left"]["dice"] < table["structures"]["femur_left"]["dice"] - 0.05
