"""What SECURITY.md promises, watched from outside: commands run while the interpreter reports all that they do."""

import gzip
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pydicom
import pytest
import SimpleITK as sitk
from tiny_case import tiny_case

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.io.cases import write_case

PATIENT = "Secretname^Patient"
FILE = "Secretname_Patient_4711"
"""Part of the names of the study's folder and files."""

NUMBER = "SECRET-4711"

WATCHED = """
import json
import os
import sys
from pathlib import Path

seen = {"network": [], "processes": [], "unpickled": [], "written": []}
busy = False

def ours(frame):
    while frame is not None:
        name = frame.f_code.co_filename
        if name.endswith("PolyPoseLib/compiled.py") or "/numba/" in name:
            return True
        frame = frame.f_back
    return False

def hook(event, arguments):
    global busy
    if busy:
        return
    busy = True
    try:
        if event.startswith(("socket.", "http.client.", "urllib.", "ftplib.", "smtplib.")):
            seen["network"].append(event)
        elif event in ("subprocess.Popen", "os.system", "os.exec", "os.posix_spawn", "os.startfile"):
            seen["processes"].append(f"{event} {arguments[0]}")
        elif event == "pickle.find_class" and not ours(sys._getframe()):
            seen["unpickled"].append(".".join(map(str, arguments)))
        elif event == "open" and isinstance(arguments[1], str) and set(arguments[1]) & set("wax+"):
            seen["written"].append(os.path.realpath(str(arguments[0])))
    finally:
        busy = False

from PolyPoseLib.__main__ import main
sys.addaudithook(hook)
status = main(sys.argv[2:])
busy = True
Path(sys.argv[1]).write_text(json.dumps({"status": status, **seen}))
"""


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    """A tiny study whose CT and X-rays are DICOM files that carry a patient's name and number, as their names do."""
    folder = tmp_path_factory.mktemp("promises") / f"{FILE}-study"
    tiny = tiny_case()
    write_case(tiny, folder, options={"preset": "fast", "seed": 1, "threads": 1})
    for path in folder.glob("*.dcm"):
        dataset = pydicom.dcmread(path)
        dataset.PatientName, dataset.PatientID = PATIENT, NUMBER
        dataset.save_as(path)
    write_ct_slices(tiny.ct, folder / f"{FILE}-ct")
    fields = json.loads((folder / "study.json").read_text())
    fields |= {"ct": f"{FILE}-ct", "segmentation": named(folder, fields["segmentation"])}
    fields["xrays"] = [{**each, "image": named(folder, each["image"])} for each in fields["xrays"]]
    for each in fields["xrays"]:
        del each["name"]
    (folder / f"{FILE}.json").write_text(json.dumps(fields))
    (folder / "study.json").unlink()
    return folder


def named(folder: Path, name: str) -> str:
    """The new name of a file, which holds the patient's."""
    (folder / name).rename(folder / f"{FILE}-{name}")
    return f"{FILE}-{name}"


def write_ct_slices(ct: Volume, folder: Path) -> None:
    """A CT as one DICOM file a slice."""
    folder.mkdir()
    writer = sitk.ImageFileWriter()
    writer.KeepOriginalImageUIDOn()
    series, spacing = pydicom.uid.generate_uid(), np.linalg.norm(ct.affine[:3, :3], axis=0)
    axes = (ct.affine[:3, :2] / spacing[:2]).T.ravel()
    for number, voxels in enumerate(ct.voxels):
        image = sitk.GetImageFromArray(voxels[None].astype(np.int16))
        image.SetSpacing(spacing.tolist())
        place = ct.affine[:3, 3] + number * ct.affine[:3, 2]
        tags = {
            "0008|0016": pydicom.uid.CTImageStorage,
            "0008|0018": pydicom.uid.generate_uid(),
            "0008|0060": "CT",
            "0010|0010": PATIENT,
            "0010|0020": NUMBER,
            "0020|000e": series,
            "0020|0013": str(number + 1),
            "0020|0032": "\\".join(f"{value:.6f}" for value in place),
            "0020|0037": "\\".join(f"{value:.6f}" for value in axes),
        }
        for tag, value in tags.items():
            image.SetMetaData(tag, value)
        writer.SetFileName(str(folder / f"{number:03d}.dcm"))
        writer.Execute(image)


def watch(folder: Path, *arguments: str, **variables: str) -> tuple[dict, str]:
    """What a command did, and all that it said."""
    temporary = folder / "temporary"
    temporary.mkdir(exist_ok=True)
    environment = {**os.environ, "TMPDIR": str(temporary), "MPLBACKEND": "Agg", **variables}
    report = folder / "watched.json"
    done = subprocess.run(
        [sys.executable, "-c", WATCHED, str(report), *arguments],
        capture_output=True,
        text=True,
        env=environment,
        check=False,
    )
    assert report.is_file(), done.stderr
    return json.loads(report.read_text()), done.stdout + done.stderr


@pytest.fixture(scope="module")
def registered(case):
    """A registration from files to files."""
    result = case.parent / "result"
    seen, said = watch(case.parent, "register", str(case / f"{FILE}.json"), "--output", str(result))
    assert seen["status"] == 0, said
    return seen, said, result


def test_the_watcher_sees_a_command_that_was_asked_to_use_the_network(tmp_path):
    nowhere = {
        "PIP_INDEX_URL": "http://127.0.0.1:9/simple",
        "PIP_CONFIG_FILE": os.devnull,
        "PIP_FIND_LINKS": "",
    }
    cache = {"POLYPOSE_CACHE": str(tmp_path / "cache")}
    seen, said = watch(tmp_path, "sample", "pelvis", "--output", str(tmp_path / "out"), **nowhere, **cache)
    assert seen["status"] == 2, said
    assert "socket.connect" in seen["network"]
    assert len(seen["processes"]) == 1  # pip, asked for its settings


def test_a_registration_uses_no_network_and_starts_no_program(registered):
    seen, _, _ = registered
    assert (seen["network"], seen["processes"]) == ([], [])


def test_nothing_that_a_study_brings_is_unpickled(registered):
    seen, _, _ = registered
    assert seen["unpickled"] == []


def test_files_are_written_into_the_result_and_temporary_folders_alone(registered, case):
    seen, _, result = registered
    caches = ("__pycache__", "numba", "matplotlib", "fontconfig", "/dev/null")
    strangers = [
        path
        for path in seen["written"]
        if not Path(path).is_relative_to(result.resolve().parent) and not any(name in path for name in caches)
    ]
    assert strangers == []
    assert not [path for path in seen["written"] if Path(path).is_relative_to(case.resolve())]


def test_no_output_names_the_patient(registered):
    _, said, result = registered
    content = {"messages": said.encode()}
    for path in result.iterdir():
        found = path.read_bytes()
        content[path.name] = gzip.decompress(found) if path.suffix == ".gz" else found
    for name, text in content.items():
        assert b"secretname" not in text.lower() and NUMBER.encode() not in text, name
    assert b"X-ray 1" in content["result.json"]


@pytest.mark.parametrize(
    "command", ["evaluate", "evaluate --truth", pytest.param("cameras", marks=pytest.mark.long)]
)
def test_no_other_command_names_the_patient(registered, case, command):
    result, report = registered[2], case.parent / "report.json"
    labels = next(case.glob(f"{FILE}-labels*"))
    arguments = {
        "evaluate": [result, "--segmentation", labels],
        "evaluate --truth": [result, "--truth", case / "truth"],
        "cameras": [
            case / f"{FILE}.json",
            "--again",
            "--output",
            case / "found.json",
            "--report",
            report,
            "--keep-uncertain",
        ],
    }[command]
    seen, said = watch(case.parent, command.split()[0], *map(str, arguments))
    assert seen["status"] in (0, 3), said
    assert "secretname" not in said.lower()
    assert not report.exists() or "secretname" not in report.read_text().lower()
