"""The subcommand train on a data set of the benchmark, and its weights in the benchmark."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import fluoro_replica
import numpy as np
import pytest
from benchmark_case import write_benchmark_data
from two_postures import grids, plain_rendering, scan, write_image

from PolyPoseLib.__main__ import main
from PolyPoseLib.baselines.liftreg import LiftReg
from PolyPoseLib.baselines.trained import training
from PolyPoseLib.baselines.trained.ct_digests import ct_digest
from PolyPoseLib.baselines.trained.trained_weights import read_weights
from PolyPoseLib.benchmark.training_overlap import trained_on
from PolyPoseLib.cli import _train_pairs
from PolyPoseLib.data.benchmark.system import SystemSetting
from PolyPoseLib.io.benchmark import headneck
from PolyPoseLib.io.benchmark.row_files import read_row

_ = plain_rendering
ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture
def small(monkeypatch):
    """Two steps, and two simulated motions held out."""
    plan = training.TrainingPlan
    monkeypatch.setattr(training, "TrainingPlan", lambda **given: plan(**{**given, "steps": 2, "batch": 1}))
    monkeypatch.setattr(_train_pairs, "HELD_OUT", 2)


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    """Three patients of Head&Neck, each with two scans of its own noise."""
    root = tmp_path_factory.mktemp("headneck") / "HNSCC-3DCT-RT"
    for patient in (1, 2, 3):
        for number, (is_second, affine) in enumerate(zip((False, True), grids(), strict=True), start=1):
            hu, labels = scan(is_second, affine, marker=False)
            noise = np.random.default_rng((patient, number)).integers(-20, 21, hu.shape, np.int16)
            folder = root / f"HN_P{patient:03d}"
            write_image(hu + noise, affine, folder / f"ct_{number}.nii.gz")
            write_image(labels, affine, folder / f"labels_{number}.nii.gz")
    return root


def run(*arguments):
    return main(["train", *map(str, arguments), "--device", "cpu", "--threads", "1", "--progress", "none"])


def train(root, output, *more):
    given = ("headneck", root, "--system", "liftreg", "--output", output, "--side", 16)
    return run(*given, *([] if "--views" in more else ["--views", "2x180"]), *more)


def case_of(root, subject):
    (case,) = headneck.cases(root, subject, ["2x180"])
    return case


def test_weights_fit_another_patient_and_know_those_of_the_training(root, tmp_path, small, capsys):
    path = tmp_path / "weights.pt"
    assert train(root, path, "--subjects", "HN_P002", "HN_P001") in (0, 3)
    assert "mean error" in capsys.readouterr().out
    weights = read_weights(path, "liftreg", "train")
    assert (weights.report["pairs"], weights.report["held_out_pairs"]) == (2, 2)  # of one patient each
    cases = {name: case_of(root, name) for name in headneck.subjects(root)}
    scans = [
        ct_digest(ct)
        for name in ("HN_P001", "HN_P002")
        for ct in (cases[name].study.ct, cases[name].truth.ct)
    ]
    assert sorted(weights.cts) == sorted(scans)
    other = cases["HN_P003"]
    motion = LiftReg().fit(other.study, SystemSetting(weights={"liftreg": path}))
    assert motion.field.vectors.any()
    said = {name: trained_on("liftreg", path, case) for name, case in cases.items()}
    assert said == {"HN_P001": "truth", "HN_P002": "truth", "HN_P003": ""}


def test_both_pairs_of_a_patient_of_thoraxcbct_are_on_one_side(tmp_path, small):
    """They have the planning CT in common, by which they are known to be of one patient."""
    data, table = tmp_path / "data", np.arange(256, dtype=np.uint8)
    table[[91, 46, 79, 16]] = 36, 95, 0, 5  # the neck's solids under names of a thorax
    for patient, later in ((3, (1, 2)), (4, (1,))):
        for which in (0, *later):
            affine = grids()[min(which, 1)]
            hu, labels = scan(which > 0, affine, marker=False)
            noise = np.random.default_rng((patient, which)).integers(-20, 21, hu.shape, np.int16)
            name = f"ThoraxCBCT_{patient:04d}_{which:04d}.nii.gz"
            write_image(hu + noise, affine, data / "imagesTr" / name)
            write_image(table[labels], affine, data / "labelsTr" / name)
    path = tmp_path / "weights.pt"
    given = ("--views", "1x0", "--system", "liftreg", "--side", 16, "--output", path)
    assert run("thoraxcbct", data, *given) in (0, 3)
    weights = read_weights(path, "liftreg", "train")
    assert (weights.report["pairs"], weights.report["held_out_pairs"]) == (4, 2)
    assert len(weights.cts) == 5


def test_motions_are_simulated_where_that_is_asked_for(root, tmp_path, small):
    path = tmp_path / "weights.pt"
    asked = ("--motions", "simulated", "--pairs", 2, "--subjects", "HN_P001")
    assert train(root, path, *asked) in (0, 3)
    weights = read_weights(path, "liftreg", "train")
    case = case_of(root, "HN_P001")
    assert weights.cts == (ct_digest(case.study.ct),) and weights.report["pairs"] == 2
    assert trained_on("liftreg", path, case) == "ct"
    assert LiftReg().fit(case.study, SystemSetting(weights={"liftreg": path})).notes


def test_a_training_on_a_data_set_goes_on_from_its_checkpoint(root, tmp_path, small, monkeypatch, caplog):
    path, chosen = tmp_path / "weights.pt", ("--subjects", "HN_P001", "HN_P002")

    def stop(self, *_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(training.Training, "_step", stop)
        assert train(root, path, *chosen) == 130
    assert sorted(each.name for each in tmp_path.iterdir()) == ["weights.pt.checkpoint"]
    assert train(root, path, *chosen, "--resume") in (0, 3)
    assert read_weights(path, "liftreg", "train").report["steps"] == 2
    assert train(root, tmp_path / "other.pt", "--resume") == 2  # it has no checkpoint


def test_progress_tells_of_every_subject(root, tmp_path, small, capsys):
    status = main([
        "train", "headneck", str(root), "--subjects", "HN_P001", "HN_P003", "--views", "1x0", "--system", "liftreg",
        "--output", str(tmp_path / "weights.pt"), "--side", "16", "--device", "cpu", "--threads", "1",
        "--progress", "json",
    ])  # fmt: skip
    steps = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert status in (0, 3)
    read = [(each["iteration"], each["of"]) for each in steps if each["stage"] == "reading subjects"]
    assert read == [(0, 2), (1, 2), (2, 2)]
    assert [each["iteration"] for each in steps if each["stage"] == "training pairs"] == [0, 1, 2, 3, 4]


def test_simulated_cases_and_real_fluoroscopy_are_trained_on_by_simulated_motions(tmp_path, small):
    data = write_benchmark_data(tmp_path / "data")
    common = ("--system", "liftreg", "--side", 16, "--pairs", 2)
    assert run("simulated", data, *common, "--output", tmp_path / "own.pt") in (0, 3)
    fluoro_replica.write_hdf5(tmp_path / "fluoro.h5")
    assert run("deepfluoro", tmp_path / "fluoro.h5", *common, "--output", tmp_path / "hips.pt") in (0, 3)
    for name in ("own", "hips"):
        assert len(read_weights(tmp_path / f"{name}.pt", "liftreg", "train").directions) == 2


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (("--subjects", "HN_P004"), '--subjects: The subject "HN_P004" is not known: did you mean "HN_P00'),
        (("--subjects", "Miller"), "give one of HN_P001, HN_P002, HN_P003"),
        (("--views", "own"), "--views: headneck: the views 'own' are none: give a number of views"),
        (
            ("--views", "2x180", "3x180"),
            "--views: a network is of one set of views: give the one that the benchmark",
        ),
        (("--other-cts", "later*"), "--other-cts goes with studies, not with a data set: leave it out"),
        (("--allow-outside",), "--allow-outside goes with studies"),
        (
            ("--subjects", "HN_P001"),
            "There are 2 pairs of CTs, each with each of a patient: give two --subjects",
        ),
        (("--resume",), "there is no checkpoint to continue from"),
    ],
)
def test_what_is_wrong_is_said_and_nothing_written(root, tmp_path, capsys, more, said):
    assert train(root, tmp_path / "weights.pt", *more) == 2
    out, err = capsys.readouterr()
    errors = [line for line in err.splitlines() if not line.startswith("INFO")]
    assert said in err and (out, len(errors)) == ("", 1)
    assert not list(tmp_path.iterdir())


def test_the_words_of_the_command_go_together(root, tmp_path, capsys):
    """Each refusal in one sentence."""
    output = ("--output", tmp_path / "weights.pt", "--system", "liftreg")
    data = write_benchmark_data(tmp_path / "data")
    for given, said in (
        (("headneck", root, *output), "--views: a network is of one set of views: give the one"),
        (("headneck", *output), "headneck: give one place of the data after the name of the data set"),
        (("headneck", root, root, "--views", "2x180", *output), "headneck: give one place of the data"),
        (("headneck", root, "--views", "2x180", *output[:2]), "Cameras are trained for one study"),
        (("simulated", data, "--motions", "real", *output), "no subject of simulated has a second scan"),
        (("simulated", tmp_path / "absent", *output), "there is no such folder"),
        (("simulated", data, "--output", data / "w.pt", *output[2:]), "it lies in the data, which are never"),
        (("study.json", "--views", "2x180", *output), "--views goes with a data set, as in headneck DATA"),
        (("study.json", "--motions", "real", *output), "--motions goes with a data set"),
        (("study.json", "--subjects", "HN_P001", *output), "--subjects goes with a data set"),
    ):
        assert run(*given) == 2, given
        err = capsys.readouterr().err
        assert said in err and err.count("\n") == 1, err
    assert not (tmp_path / "weights.pt").exists() and not (data / "w.pt").exists()


def test_missing_labels_of_the_last_subject_are_said_before_anything_is_written(root, tmp_path, capsys):
    data = tmp_path / "data"
    shutil.copytree(root, data)
    (data / "HN_P002" / "labels_2.nii.gz").unlink()
    assert train(data, tmp_path / "weights.pt", "--subjects", "HN_P001", "HN_P002") == 2
    said = capsys.readouterr().err
    assert "there is no labels_2.nii.gz" in said and "TotalSegmentator" in said
    assert [each.name for each in tmp_path.iterdir()] == ["data"]


def test_x_rays_of_other_directions_are_not_of_one_network(tmp_path, small, capsys):
    """The subject is named; X-rays in another order are brought into the first one's."""
    data = write_benchmark_data(tmp_path / "data")
    for name, angle in (("case-2", 40.0), ("case-3", None)):
        shutil.copytree(data / "case-1", data / name)
        study, truth = data / name / "study.json", data / name / "truth/truth.json"
        for path, kind in ((study, "xrays"), (truth, "cameras")):
            fields = json.loads(path.read_text())
            if angle is None:
                fields[kind] = fields[kind][::-1]
            elif kind == "cameras":
                for camera in fields[kind]:
                    camera["extrinsic"] = (np.array(camera["extrinsic"]) @ turned(angle)).tolist()
            path.write_text(json.dumps(fields))
    common = ("--system", "liftreg", "--side", 16, "--pairs", 2, "--output", tmp_path / "weights.pt")
    assert run("simulated", data, *common, "--subjects", "case-1", "case-2") == 2
    said = capsys.readouterr().err
    assert "case-2: its X-rays do not come from where those of case-1 do" in said
    assert "one X-ray is 40 degrees from the nearest" in said and "leave it out of --subjects" in said
    assert run("simulated", data, *common, "--subjects", "case-1", "case-3") in (0, 3)


def turned(degrees):
    """About the cranio-caudal axis, (4, 4)."""
    motion, angle = np.eye(4), np.radians(degrees)
    motion[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return motion


@pytest.mark.long
def test_from_the_data_to_a_table_by_commands_alone(root, tmp_path):
    """Train on two patients, run the benchmark on the third and on one of the training."""

    def command(*words):
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        told = [sys.executable, "-m", "PolyPoseLib", *map(str, words), "--progress", "none"]
        return subprocess.run(
            told, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=600
        )

    training_ = command(
        "train", "headneck", root, "--subjects", "HN_P001", "HN_P002", "--views", "2x180", "--system", "liftreg",
        "--side", 16, "--output", "liftreg.pt", "--minutes", 0.1, "--threads", 1, "--device", "cpu",
    )  # fmt: skip
    assert training_.returncode in (0, 3), training_.stderr
    run_ = command(
        "benchmark", "headneck", root, "--methods", "liftreg", "--subjects", "HN_P002", "HN_P003",
        "--views", "2x180", "--weights", "liftreg@2x180=liftreg.pt", "--output", "compared",
    )  # fmt: skip
    assert run_.returncode == 0, run_.stderr
    rows = [read_row(path) for path in sorted((tmp_path / "compared/rows").glob("*--liftreg.json"))]
    assert [(row["subject"], row["status"], row["trained_on"]) for row in rows] == [
        ("HN_P002", "done", "truth"),
        ("HN_P003", "done", ""),
    ]
    (table,) = (tmp_path / "compared/tables").glob("*.md")
    assert "\u2021" in table.read_text(encoding="utf-8")
