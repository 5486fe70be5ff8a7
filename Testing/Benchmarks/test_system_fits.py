"""Systems without bones are scored as registrations are, and are given the true cameras."""

import json
from argparse import Namespace

import ablation_cases
import numpy as np
import pytest
from ablation_cases import Settings, prepare
from benchmark_case import write_benchmark_data
from system_fits import fit_and_score

from PolyPoseLib.io.studies import load_study
from PolyPoseLib.io.truths import load_truth


@pytest.fixture
def case(tmp_path):
    return next(write_benchmark_data(tmp_path / "cases").iterdir())


def test_fits_have_the_true_cameras_and_the_numbers_of_other_rows(case, monkeypatch, tmp_path):
    monkeypatch.setattr(ablation_cases, "case_folder", lambda *_: case)
    truth = load_truth(case / "truth")
    study, stands_for, kept = prepare(Settings("chest", 0, 400, system="rest"), tmp_path)
    for xray, camera in zip(load_study(study).xrays, truth.cameras, strict=True):
        assert xray.camera == "known"
        np.testing.assert_allclose(xray.extrinsic, camera.extrinsic)
    assert set(stands_for) == set(truth.names) and kept == 100
    given = json.loads((case / "study.json").read_text())
    assert all(xray["camera"] != "known" for xray in given["xrays"])

    arguments = Namespace(device="cpu", threads=1, limit=300)
    rest = fit_and_score(study, truth, "rest", None, arguments)
    moving = [row for name, row in rest["structures"].items() if name != truth.anchor]
    assert min(row["rest_tre_mean_mm"] for row in moving) > 1
    for row in moving:
        assert row["tre_mean_mm"] == pytest.approx(row["rest_tre_mean_mm"], abs=1e-6)
        assert row["pose_tre_mean_mm"] == pytest.approx(row["rest_tre_mean_mm"], abs=1e-6)
    assert all(camera["projection_mean_mm"] < 1e-6 for camera in rest["cameras"])

    dense = fit_and_score(study, truth, "dense-r3", 2, arguments)
    assert any("2 iterations" in note for note in dense["notes"])
    assert dense["summary"].keys() == rest["summary"].keys()
    assert dense["summary"]["mean_pose_tre_mm"] is None
    # In two iterations of Adam no node moves farther than a fiftieth of a voxel of the CT.
    assert 0 < abs(dense["summary"]["mean_tre_mm"] - rest["summary"]["mean_tre_mm"]) < 0.5
    assert dense["peak_memory_mib"] > 0 and dense["cpu_seconds"] > 0


def test_a_system_that_fails_is_a_row_that_says_why(case, tmp_path):
    truth = load_truth(case / "truth")
    arguments = Namespace(device="cpu", threads=1, limit=300)
    row = fit_and_score(case / "study.json", truth, "polypose", 3, arguments)
    assert row["exit_status"] == 2
    assert "--iterations is of dense-r3 and dense-se3 only" in row["failed"]
