"""Pipes, sockets and devices in the place of a file are refused at once, in a sentence, and never waited for."""

import os
import signal
import socket

import numpy as np
import pytest

from PolyPoseLib.__main__ import main
from PolyPoseLib.cli._destinations import check_json_destinations
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.files import refuse_special_file
from PolyPoseLib.io.images import ENDINGS
from PolyPoseLib.io.paths import resolve
from PolyPoseLib.io.segmentations import read_segmentation
from PolyPoseLib.io.volumes import read_ct, read_volume
from PolyPoseLib.io.xray.calibration import read_calibration
from PolyPoseLib.io.xray.plain import PLAIN_ENDINGS, read_plain
from PolyPoseLib.io.xray.read import read_xray

pytestmark = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")

META = "ObjectType = Image\nNDims = 3\nBinaryData = True\nElementSpacing = 2 2 2\nDimSize = 6 6 6\n"
NRRD = "NRRD0004\ntype: short\ndimension: 3\nsizes: 6 6 6\nspacings: 2 2 2\nendian: little\nencoding: raw\n"


@pytest.fixture(autouse=True)
def patience():
    """Whoever opens a pipe is interrupted after some seconds, so that a mistake is a failure and no wait."""

    def give_up(*_):
        raise TimeoutError("a pipe was opened")

    before = signal.signal(signal.SIGALRM, give_up)
    signal.alarm(20)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


def pipe(path):
    os.mkfifo(path)
    return path


def refusal(read, path, *more) -> str:
    with pytest.raises(InputError) as error:
        read(path, *more)
    message = str(error.value)
    assert path.name in message and "\n" not in message
    return message


def test_whatever_is_no_file_is_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # a socket's path must be short
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind("socket")
        assert "a socket, not a file" in refusal(refuse_special_file, tmp_path / "socket")
    (tmp_path / "zeros").symlink_to("/dev/zero")
    assert "a device, not a file" in refusal(refuse_special_file, tmp_path / "zeros")
    assert "a named pipe, not a file" in refusal(refuse_special_file, pipe(tmp_path / "pipe"))
    (tmp_path / "file").write_bytes(b"")
    for usual in ("file", ".", "absent", "a\0b"):
        refuse_special_file(tmp_path / usual)


@pytest.mark.parametrize("ending", [*ENDINGS, ".dcm"])
@pytest.mark.parametrize("read", [read_ct, read_volume, read_segmentation])
def test_no_pipe_is_a_volume(tmp_path, ending, read):
    assert "named pipe" in refusal(read, pipe(tmp_path / f"ct{ending}"))


@pytest.mark.parametrize("ending", [*PLAIN_ENDINGS, ".dcm"])
def test_no_pipe_is_an_xray(tmp_path, ending):
    refusal(read_xray, pipe(tmp_path / f"x{ending}"))
    if ending != ".dcm":
        assert "named pipe" in refusal(read_plain, tmp_path / f"x{ending}", f"x{ending}")


@pytest.mark.parametrize(
    ("name", "header"),
    [
        ("a.mhd", META + "ElementType = MET_SHORT\nElementDataFile = voxels\n"),
        ("a.nhdr", NRRD + "data file: voxels\n\n"),
    ],
)
def test_no_pipe_holds_the_voxels_of_a_header(tmp_path, name, header):
    (tmp_path / name).write_text(header)
    pipe(tmp_path / "voxels")
    assert "named pipe" in refusal(read_volume, tmp_path / name)


def test_no_pipe_is_half_of_a_pair(tmp_path):
    for half, other in (("a.hdr", "a.img"), ("b.img", "b.hdr")):
        (tmp_path / half).write_bytes(bytes(400))
        pipe(tmp_path / other)
        with pytest.raises(InputError, match=f"{other}: this is a named pipe"):
            read_volume(tmp_path / half)


@pytest.mark.parametrize("ending", [".csv", ".json", ".txt"])
def test_no_pipe_is_a_calibration(tmp_path, ending):
    assert "named pipe" in refusal(read_calibration, pipe(tmp_path / f"camera{ending}"))


@pytest.mark.parametrize("outside", [False, True])
@pytest.mark.parametrize("name", ["ct.nii.gz", "ct.mhd", "ct.nhdr", "ct.img", "ap.dcm", "camera.csv"])
def test_a_study_that_names_a_pipe_is_refused(tmp_path, name, outside):
    pipe(tmp_path / name)
    with pytest.raises(InputError, match=f'"ct" names "{name}": this is a named pipe'):
        resolve(name, "ct", tmp_path, outside)


def test_no_pipe_is_a_model(tmp_path):
    from PolyPoseLib.io.camera_models import read_tensors

    assert "named pipe" in refusal(read_tensors, pipe(tmp_path / "model.pt"), "camera model")


def test_no_report_goes_into_a_pipe(tmp_path):
    fields = {"ct": "ct", "segmentation": "labels", "xrays": []}
    with pytest.raises(InputError, match=r"report\.json: this is a named pipe"):
        check_json_destinations(
            tmp_path / "a.json", fields, tmp_path / "a.json", pipe(tmp_path / "report.json")
        )


def test_the_command_line_ends_with_status_2(tmp_path, capsys):
    study, result = pipe(tmp_path / "study.json"), tmp_path / "result"
    result.mkdir()
    pipe(result / "result.json")
    pipe(tmp_path / "ct.nii.gz")
    np.save(tmp_path / "any.npy", np.zeros(3))
    ct = ["--ct", tmp_path / "any.npy", "--segmentation", tmp_path / "any.npy"]
    for argv in (
        ["register", study, "--output", tmp_path / "new"],
        ["cameras", study],
        ["train", study, "--output", tmp_path / "model.pt"],
        ["structures", tmp_path / "ct.nii.gz"],
        ["simulate", *ct, "--structures", study, "--output", tmp_path / "new"],
        ["evaluate", result, "--segmentation", tmp_path / "any.npy"],
        ["render", tmp_path / "ct.nii.gz"],
    ):
        assert main([str(each) for each in argv]) == 2, argv
        assert "this is a named pipe, not a file" in capsys.readouterr().err, argv
    assert not (tmp_path / "new").exists()
