"""Cases are told apart by all that makes them, made one at a time, and their studies written before they are read."""

import importlib
import json
from argparse import Namespace
from types import SimpleNamespace

import benchmark_cases
import breathing
import numpy as np
import pytest
from benchmark_store import MAKING


@pytest.fixture
def unsimulated(monkeypatch):
    """case_folder without a CT: it makes the folder only, and counts."""
    made = []

    def write_case(_case, folder, *_, **__):
        folder.mkdir()
        made.append(folder)

    monkeypatch.setattr(
        benchmark_cases, "load_anatomy", lambda *_: (SimpleNamespace(affine=None), None, None, {})
    )
    for name in ("structures_from_labels", "structures_centre", "view_cameras", "simulate_case"):
        monkeypatch.setattr(benchmark_cases, name, lambda *_, **__: None)
    monkeypatch.setattr(benchmark_cases, "write_case", write_case)
    return made


def test_a_case_of_other_structures_is_not_taken_for_this_one(unsimulated, tmp_path):
    def case(groups):
        return benchmark_cases.case_folder("chest", "2x30", 0, 64, tmp_path, groups=groups)

    folder = case({"spine": [32], "rib_left_4": [95]})
    assert case({"spine": [32], "rib_left_4": [95]}) == folder and unsimulated == [folder]
    for other in ({"spine": [32, 33], "rib_left_4": [95]}, None):
        with pytest.raises(SystemExit, match="holds a case of other settings"):
            case(other)


def test_range_makes_one_case_at_a_time(monkeypatch, tmp_path):
    benchmark = importlib.import_module("range")

    def case_folder(*_):
        assert MAKING.locked()
        raise StopIteration

    monkeypatch.setattr(benchmark, "case_folder", case_folder)
    key = {"anatomy": "pelvis", "views": "2x30", "seed": 0, "pixels": 64, "scale": 1.0}
    with pytest.raises(StopIteration):
        benchmark.run_row(key, Namespace(work=tmp_path))
    assert not MAKING.locked()


def test_registrations_of_one_case_write_no_study(monkeypatch, tmp_path):
    """Each has its own, or one that others only read."""
    study = {
        "structures": {"spine": [1], "rib_left_1": [2], "rib_left_2": [3], "rib_right_1": [4]},
        "xrays": [{"image": "xray_1.dcm"}],
    }
    (tmp_path / "study.json").write_text(json.dumps(study))
    truth = SimpleNamespace(cameras=[SimpleNamespace(extrinsic=np.eye(4))])
    keys = [
        {"bodies": b, "mode": m} for b in ("ribs", "sides") for m in ("default", "fast", "paper_true_cameras")
    ]
    written = [breathing.study_of(key, tmp_path, truth) for key in keys]
    before = {path: path.stat().st_mtime_ns for path in tmp_path.glob("*.json")}
    read = []

    def register_row(path, *_):
        read.append((path.name, json.loads(path.read_text())))
        return {"exit_status": 1}

    monkeypatch.setattr(breathing, "register_row", register_row)
    for key, each in zip(keys, written, strict=True):
        breathing.run_row((key, each), truth, Namespace())
    assert {path: path.stat().st_mtime_ns for path in tmp_path.glob("*.json")} == before
    names = ["study.json", "study_sides.json", "study_true_cameras.json", "study_true_cameras_sides.json"]
    assert sorted({name for name, _ in read}) == names
    assert read[3][1]["structures"] == {"spine": [1], "ribs_left": [2, 3], "ribs_right": [4]}
    assert read[5][1]["xrays"][0]["camera"] == "known" and written[5][1]["rib_left_2"] == "ribs_left"
