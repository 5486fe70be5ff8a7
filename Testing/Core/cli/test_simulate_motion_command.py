"""simulate --motion: a study that can be registered, or one sentence that says what the anatomy lacks."""

import json

import numpy as np
import pytest
from chest_phantom import LABELS, NAMES, RIBS, chest

from PolyPoseLib.__main__ import main
from PolyPoseLib.data.label_names import label_table
from PolyPoseLib.data.study import Study
from PolyPoseLib.io.truths import load_truth
from PolyPoseLib.io.volumes import write_volume

NUMBERS = {name: number for number, name in label_table("totalsegmentator_v2").items()}


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """The chest with TotalSegmentator's labels; its structures as a proposal has them, ribs by side."""
    folder = tmp_path_factory.mktemp("chest")
    ct, structures, source = chest()
    voxels = np.where(np.isin(source.voxels, list(LABELS)), source.voxels, 0).astype(np.int16)
    for number, name in enumerate(NAMES, start=1):
        label = NUMBERS["vertebrae_T6" if name == NAMES[0] else name]
        voxels[structures.labels == number] = label
    write_volume(ct.with_voxels(ct.voxels.astype(np.int16)), folder / "ct.nii.gz")
    write_volume(ct.with_voxels(voxels), folder / "labels.nii.gz")
    groups = {
        "thoracic_spine": [NUMBERS["vertebrae_T6"]],
        "ribs_left": [NUMBERS[name] for name in RIBS if "left" in name],
        "ribs_right": [NUMBERS[name] for name in RIBS if "right" in name],
        "sternum": [NUMBERS["sternum"]],
    }
    fields = {"label_table": "totalsegmentator_v2", "structures": groups, "anchor": "thoracic_spine"}
    (folder / "structures.json").write_text(json.dumps(fields))
    return folder


def simulate(files, output, *more):
    paths = [
        f"--{name}={files / file}" for name, file in (("ct", "ct.nii.gz"), ("segmentation", "labels.nii.gz"))
    ]
    structures = f"--structures={files / 'structures.json'}"
    return main(["simulate", *paths, structures, f"--output={output}", "--pixels=64", *more])


@pytest.mark.slow
def test_breathing_gives_a_study_with_every_rib(files, tmp_path):
    output = tmp_path / "case"
    assert simulate(files, output, "--motion", "breathing", "--amplitude", "15", "--format", "nifti") == 0
    study, truth = Study.load(output / "study.json"), load_truth(output / "truth")
    assert set(study.structures.names) == set(truth.names) == set(NAMES)
    assert study.anchor == "thoracic_spine"
    still = {name for name, pose in truth.fixed_to_moving.items() if np.allclose(pose, np.eye(4))}
    assert still == {"thoracic_spine"}
    assert set(truth.organ_names.values()) == set(LABELS.values())


@pytest.mark.parametrize(
    ("motion", "needs"), [("jaw", "the mandible"), ("gait", "both femurs"), ("flexion", "femur")]
)
def test_what_the_anatomy_lacks_is_said_in_one_sentence(files, tmp_path, capsys, motion, needs):
    assert simulate(files, tmp_path / "case", "--motion", motion) == 2
    message = capsys.readouterr().err
    refusal = message.strip().splitlines()[-1]
    assert f'The motion "{motion}" needs' in refusal and needs in refusal
    assert not (tmp_path / "case").exists()
