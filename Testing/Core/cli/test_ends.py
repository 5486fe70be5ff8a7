"""However a command ends, it says what has become of the result."""

import json

import numpy as np
import pytest
import SimpleITK as sitk
from result_case import FILES, make_result

from PolyPoseLib import pipeline
from PolyPoseLib.__main__ import main
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.io import results
from PolyPoseLib.io.volumes import write_volume
from PolyPoseLib.io.whole_files import claimed_file
from PolyPoseLib.io.whole_folders import claimed_folder


@pytest.fixture
def study(tmp_path):
    """A small study on disk, alone in its folder."""
    folder = tmp_path / "case"
    folder.mkdir()
    rng = np.random.default_rng(0)
    labels = np.zeros((10, 11, 12), np.uint8)
    labels[:5], labels[6:] = 25, 75
    ct = Volume(rng.integers(-1000, 1500, labels.shape).astype(np.int16), np.eye(4))
    write_volume(ct, folder / "ct.nii.gz")
    write_volume(Volume(labels, np.eye(4)), folder / "labels.nii.gz")
    image = sitk.GetImageFromArray(rng.random((40, 50)).astype(np.float32))
    sitk.WriteImage(image, str(folder / "ap.nii.gz"))
    xray = {"image": "ap.nii.gz", "source_to_detector_mm": 1020, "pixel_spacing_mm": [1, 1]}
    fields = {
        "version": 1, "ct": "ct.nii.gz", "segmentation": "labels.nii.gz", "anchor": "pelvis", "xrays": [xray],
        "structures": {"pelvis": [25], "femur": [75]},
    }  # fmt: skip
    (folder / "study.json").write_text(json.dumps(fields))
    return folder / "study.json"


@pytest.fixture
def registered(monkeypatch):
    """A registration that takes no time; the studies it was given."""
    given = []

    def register(study, progress=None, cancel=None):
        given.append(study)
        return make_result()

    monkeypatch.setattr(pipeline, "register", register)
    return given


def run_main(argv, capsys):
    """Exit status, stdout and stderr of one command."""
    capsys.readouterr()
    status = main([str(each) for each in argv])
    return status, *capsys.readouterr()


@pytest.mark.parametrize("command", ["register", "train"])
def test_the_second_run_towards_one_place_is_refused_at_the_start(
    study, registered, tmp_path, capsys, command
):
    output = tmp_path / ("out" if command == "register" else "model.pt")
    claimed = claimed_folder(output, True) if command == "register" else claimed_file(output)
    with claimed:
        status, _, err = run_main([command, study, "--output", output, "--overwrite", "--quiet"], capsys)
    assert status == 2 and not registered
    assert err.count("\n") == 1 and "another run of PolyPose (process" in err
    assert [each.name for each in tmp_path.iterdir()] == ["case"]


def test_an_interrupt_after_the_result_was_written_says_so(study, registered, tmp_path, capsys, monkeypatch):
    output = tmp_path / "out"
    argv = ["register", study, "--output", output, "--progress", "none", "--quiet"]
    save = results.save_result

    def save_and_interrupt(result, claim):
        save(result, claim)
        raise KeyboardInterrupt

    monkeypatch.setattr(results, "save_result", save_and_interrupt)
    status, _, err = run_main(argv, capsys)
    assert status == 130 and f"the result was written to {output}" in err
    assert {each.name for each in output.iterdir()} == FILES

    def interrupt(result, claim):
        raise KeyboardInterrupt

    monkeypatch.setattr(results, "save_result", interrupt)
    status, _, err = run_main([*argv, "--overwrite"], capsys)
    assert status == 130 and "no result was written" in err
