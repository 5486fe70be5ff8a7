"""Wrong files of weights are found out before anything is run or written."""

import os
import pickle
from pathlib import Path

import numpy as np
import pytest
import torch

from PolyPoseLib.__main__ import main
from PolyPoseLib.baselines.trained.trained_weights import TrainedWeights
from PolyPoseLib.benchmark.systems import SYSTEMS
from PolyPoseLib.benchmark.weight_checks import require_weights
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.camera_models import save_model
from PolyPoseLib.learned.camera_model import CameraModel
from PolyPoseLib.learned.detector import VirtualDetector
from PolyPoseLib.learned.network import Architecture
from PolyPoseLib.learned.view_range import ViewRange

TRAINED = ("liftreg", "2d3d-regnet")
STATES = (
    "fdk-unigradicon",
    "fdk-unigradicon-io",
    "fdk-multigradicon",
    "fdk-multigradicon-io",
    "fdk-anatomix",
)
TAKES = ("rigid", *TRAINED, *STATES)


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """{kind: a good file}."""
    folder = tmp_path_factory.mktemp("weights")
    for name in TRAINED:
        weights = TrainedWeights(
            name,
            16,
            np.eye(3)[:2],
            np.array([[100.0] * 3, [200.0] * 3]),
            np.zeros((2, 2, 3)),
            {"w": torch.ones(2)},
        )
        torch.save(weights.to_fields(), folder / name)
    sizes = Architecture(1, (1, 1, 1, 1), (4, 4, 8, 8))
    model = CameraModel(
        "f" * 64, ViewRange(("AP",), 735.0), VirtualDetector(48, 0.15), sizes, {"w": torch.ones(2)}, 7.5
    )
    save_model(model, folder / "rigid")
    torch.save({"w": torch.ones(2, 3)}, folder / "state")
    return {path.name: path for path in folder.iterdir()}


def good(system):
    return "state" if system in STATES else system


@pytest.mark.parametrize("system", TAKES)
def test_a_good_file_is_taken_and_those_of_other_kinds_are_refused(system, files):
    require_weights(system, files[good(system)])
    for kind in files.keys() - {good(system)}:
        with pytest.raises(InputError, match=kind):
            require_weights(system, files[kind])


@pytest.mark.parametrize("system", SYSTEMS)
def test_no_system_of_the_table_takes_what_is_no_weights(system, tmp_path):
    contents = {
        "empty": b"",
        "text": b"not weights\n",
        "zip": b"PK\x03\x04" + bytes(40),
        "pickle": pickle.dumps(Path("x")),
    }
    for name, content in contents.items():
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InputError) as caught:
            require_weights(system, tmp_path / name)
        assert str(tmp_path / name) in str(caught.value) and "\n" not in str(caught.value)
        assert ("takes no weights" in str(caught.value)) == (system not in TAKES)


def test_of_a_users_own_system_a_file_need_only_be_readable(tmp_path):
    (tmp_path / "own").write_text("any format")
    require_weights("my_systems:Mine", tmp_path / "own")
    with pytest.raises(InputError, match="no such file"):
        require_weights("my_systems:Mine", tmp_path / "other")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes here")
def test_a_pipe_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for system in ("rigid", "liftreg", "fdk-anatomix", "my_systems:Mine"):
        with pytest.raises(InputError, match="pipe: this is a named pipe"):
            require_weights(system, tmp_path / "pipe")


@pytest.mark.skipif(not Path("/proc/self/mem").is_file(), reason="no file here that even root cannot read")
@pytest.mark.parametrize("system", ["rigid", "liftreg", "fdk-anatomix", "my_systems:Mine"])
def test_a_file_that_cannot_be_read_is_told_as_such(system):
    with pytest.raises(InputError, match="/proc/self/mem: the file cannot be read"):
        require_weights(system, Path("/proc/self/mem"))


@pytest.mark.parametrize("system", ["rigid", "liftreg", "fdk-unigradicon"])
def test_the_command_refuses_before_it_makes_its_folder(system, tmp_path, capsys):
    for each in ("data/case-1/truth", "data/case-1"):
        (tmp_path / each).mkdir(parents=True, exist_ok=True)
    (tmp_path / "data/case-1/study.json").write_text("{}")
    (tmp_path / "data/case-1/truth/truth.json").write_text("{}")
    (tmp_path / "weights").write_text("nothing of the kind")
    command = ["benchmark", "simulated", str(tmp_path / "data"), "--output", str(tmp_path / "out")]
    status = main([*command, "--methods", system, "--weights", f"{system}={tmp_path / 'weights'}"])
    out, err = capsys.readouterr()
    assert (status, out) == (2, "") and err.count("\n") == 1 and f"--weights: {tmp_path / 'weights'}: " in err
    assert not (tmp_path / "out").exists()
