"""Targets: studies, their results, and what is kept between runs."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import SimpleITK as sitk
from fuzz_subject import Subject, in_archive, whole_file
from fuzz_xrays import GEOMETRY
from result_case import make_result

from PolyPoseLib.data.cohort.outcome import FileStamp, Outcome
from PolyPoseLib.data.study import Study
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.io.camera_models import load_model, read_tensors, write_tensors
from PolyPoseLib.io.cohort.entries import read_entries
from PolyPoseLib.io.cohort.outcome_files import read_outcome, write_outcome
from PolyPoseLib.io.results import load_result
from PolyPoseLib.io.transforms import read_transform
from PolyPoseLib.io.volumes import write_volume


def study(folder: Path) -> list[Subject]:
    rng = np.random.default_rng(0)
    affine = np.diag([2.0, 2.0, 2.0, 1.0])
    labels = np.zeros((10, 11, 12), np.uint8)
    labels[:4], labels[4:6], labels[6:9] = 1, 2, 3
    write_volume(
        Volume(rng.integers(-1000, 1500, labels.shape).astype(np.int16), affine), folder / "ct.nii.gz"
    )
    write_volume(Volume(labels, affine), folder / "labels.nii.gz")
    for name in ("ap", "oblique"):
        image = sitk.GetImageFromArray(rng.random((40, 50)).astype(np.float32))
        sitk.WriteImage(image, str(folder / f"{name}.nii.gz"))
    rigid = [[1, 0, 0, 0], [0, 0, -1, 5], [0, 1, 0, 800], [0, 0, 0, 1]]
    view = {"image": "ap.nii.gz", **GEOMETRY, "extrinsic": rigid}
    fields = {
        "version": 1, "ct": "ct.nii.gz", "segmentation": "labels.nii.gz",
        "structures": {"pelvis": [1, 2], "femur_left": [3]}, "anchor": "pelvis",
        "xrays": [view, {**view, "image": "oblique.nii.gz", "camera": "known"}],
        "options": {"preset": "fast", "device": "cpu"},
    }  # fmt: skip
    path = folder / "study.json"
    path.write_text(json.dumps(fields, indent=1))
    return [whole_file(path, Study.load)]


def result(folder: Path) -> list[Subject]:
    saved = make_result().save(folder / "result")
    path = saved / "result.json"
    return [Subject(path, path.read_bytes(), lambda: load_result(saved))]


def transform(folder: Path) -> list[Subject]:
    saved = make_result().save(folder / "result")
    return [whole_file(saved / "transform.h5", read_transform)]


def camera_model(folder: Path) -> list[Subject]:
    import torch

    path = folder / "model.pt"
    fields = {"format": "polypose camera model", "version": 1, "digest": "0", "state": {"a": torch.ones(3)}}
    write_tensors(fields, path)
    pickled, packed = in_archive(path, "data.pkl")
    return [
        whole_file(path, load_model),
        Subject(path, pickled, lambda: read_tensors(path, "camera model"), packed),
    ]


def cohort(folder: Path) -> list[Subject]:
    listed = folder / "list.csv"
    listed.write_text('id,site,study\na-1,"Bonn, Rhein",one/study.json\nb.2,,two/study.json\n')
    (folder / "outcomes").mkdir()
    write_outcome(folder, Outcome("a", 3, "why", "0" * 64, "studies/a", stamps={"0f": FileStamp(1, 2, "ab")}))
    data_set = folder / "set"
    (data_set / "sub-01").mkdir(parents=True)
    (data_set / "sub-01/sub-01_study.json").write_text("{}")
    description = data_set / "dataset_description.json"
    description.write_text(json.dumps({"Name": "a", "BIDSVersion": "1.10.0"}))
    outcome = folder / "outcomes/a.json"
    return [
        whole_file(listed, lambda path: read_entries(path, False)),
        Subject(outcome, outcome.read_bytes(), lambda: read_outcome(folder, "a")),
        Subject(description, description.read_bytes(), lambda: read_entries(data_set, False)),
    ]
