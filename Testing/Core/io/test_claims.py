"""Places that results are written to: claimed by one run at a time, tidied up, never taken from others."""

import os
import re
import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest
from result_case import FILES, make_result

import PolyPoseLib
from PolyPoseLib.errors import InputError
from PolyPoseLib.io import locks, renames, whole_folders
from PolyPoseLib.io.results import load_result
from PolyPoseLib.io.signals import deferred_signals
from PolyPoseLib.io.whole_files import claimed_file, replaced_whole
from PolyPoseLib.io.whole_folders import claimed_folder

HOLD = """
    import sys, time
    from pathlib import Path
    from PolyPoseLib.io.whole_files import claimed_file
    from PolyPoseLib.io.whole_folders import claimed_folder
    place = Path(sys.argv[1])
    with claimed_folder(place, True) if sys.argv[2] == "folder" else claimed_file(place):
        print("held", flush=True)
        time.sleep(60)
"""


class Holder:
    """Another process that holds the claim of a place."""

    def __init__(self, place: Path, kind: str = "folder") -> None:
        root = str(Path(PolyPoseLib.__file__).parents[1])
        self.process = subprocess.Popen(
            [sys.executable, "-c", textwrap.dedent(HOLD), str(place), kind],
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, "PYTHONPATH": root},
        )
        assert self.process.stdout.readline() == "held\n"

    def __enter__(self) -> "Holder":
        return self

    def __exit__(self, *_) -> None:
        self.process.kill()
        self.process.communicate()


def names(folder: Path) -> list[str]:
    return sorted(os.listdir(folder))


@pytest.mark.parametrize("name", ["out", "ö" * 100, "a" * 250, "with [brackets] (and) more.*"])
def test_one_run_at_a_time(tmp_path, name):
    place = tmp_path / name
    with Holder(place) as holder:
        with pytest.raises(InputError, match=rf"process {holder.process.pid}\) is writing here: wait"):
            make_result().save(place)
        assert not place.exists()
    make_result().save(place)
    assert names(tmp_path) == [name]


def test_two_claims_of_one_process_are_two_runs(tmp_path):
    place = tmp_path / "out"
    with claimed_folder(place, False), pytest.raises(InputError, match="another run"):
        make_result().save(place)
    with claimed_folder(tmp_path / "out", False), claimed_folder(tmp_path / "other", False):
        pass
    assert names(tmp_path) == []


def test_a_single_file_waits_for_its_turn(tmp_path, monkeypatch):
    path = tmp_path / "study.json"
    with Holder(path, "file"):
        with pytest.raises(InputError, match="another run"), claimed_file(path, wait_seconds=0.1):
            pass
        monkeypatch.setattr(locks, "_PAUSE_SECONDS", 0.3)
        held = locks._take

        def take_or_kill(where):
            try:
                return held(where)
            except locks._Held:
                holder.process.kill()
                holder.process.wait()
                raise

        monkeypatch.setattr(locks, "_take", take_or_kill)
    with Holder(path, "file") as holder, replaced_whole(path) as temporary:
        temporary.write_text("new")
    assert path.read_text() == "new" and names(tmp_path) == ["study.json"]


def test_what_a_killed_process_left_goes_and_nothing_else(tmp_path):
    place = tmp_path / "out"
    with Holder(place):
        pass  # killed
    assert names(tmp_path) == [".out.polypose-lock"]
    for stale in (".out.01234567.partial", ".out.89abcdef.old"):
        (tmp_path / stale).mkdir()
        (tmp_path / stale / "transform.h5").write_bytes(b"half")
    kept = [
        ".out.partial",
        ".out.0123456g.partial",
        ".other.01234567.partial",
        "out.01234567.partial",
        ".out.x",
    ]
    for other in kept:
        (tmp_path / other).mkdir()
    (tmp_path / ".out.00000000.partial").write_text("a file, which a folder's claim never makes")
    make_result().save(place, overwrite=True)
    assert names(tmp_path) == sorted([*kept, ".out.00000000.partial", "out"])


@pytest.mark.skipif(sys.platform == "win32", reason="links need a privilege there")
def test_links_are_never_followed(tmp_path):
    (tmp_path / "photos").mkdir()
    (tmp_path / "photos" / "mine.jpg").write_text("x")
    (tmp_path / ".out.01234567.partial").symlink_to(tmp_path / "photos")
    make_result().save(tmp_path / "out")
    assert names(tmp_path / "photos") == ["mine.jpg"]
    (tmp_path / ".more.polypose-lock").symlink_to(tmp_path / "photos" / "mine.jpg")
    with pytest.raises(InputError, match="could not be written"):
        make_result().save(tmp_path / "more")
    assert (tmp_path / "photos" / "mine.jpg").read_text() == "x"


@pytest.mark.parametrize("empty_place", [False, True])
@pytest.mark.parametrize("how", ["load", "claim"])
def test_a_result_that_was_moved_aside_comes_back(tmp_path, how, empty_place, caplog):
    place = tmp_path / "out"
    make_result(3).save(place)
    place.rename(tmp_path / ".out.01234567.old")
    if empty_place:
        place.mkdir()
    if how == "claim":
        with pytest.raises(InputError, match="--overwrite"), claimed_folder(place, False):
            pass
    elif not empty_place:
        assert load_result(place).anchor == "pelvis"
    if how == "claim" or not empty_place:
        assert "in its place again" in caplog.text
        assert set(names(place)) == FILES and names(tmp_path) == ["out"]


def test_a_result_is_not_restored_under_a_living_run(tmp_path):
    place = tmp_path / "out"
    make_result(3).save(place)
    with Holder(place):
        place.rename(tmp_path / ".out.01234567.old")
        with pytest.raises(InputError, match="no such folder"):
            load_result(place)
        (tmp_path / ".out.01234567.old").rename(place)
    assert load_result(place).anchor == "pelvis"


@pytest.mark.parametrize("overwrite", [False, True])
@pytest.mark.parametrize("what", ["result", "others", "file"])
def test_what_appears_meanwhile_is_not_taken(tmp_path, what, overwrite):
    place = tmp_path / "out"
    with claimed_folder(place, overwrite) as claim:
        if what == "file":
            place.write_text("mine")
        else:
            place.mkdir()
            (place / ("result.json" if what == "result" else "thesis.doc")).write_text("mine")
        if what == "result" and overwrite:
            with claim.whole() as temporary:
                (temporary / "result.json").write_text("new")
            assert (place / "result.json").read_text() == "new"
            return
        with pytest.raises(InputError, match=f"{re.escape(str(place))}: "), claim.whole() as temporary:
            (temporary / "result.json").write_text("new")
        assert not claim.written
    kept = place if what == "file" else next(place.iterdir())
    assert kept.read_text() == "mine" and names(tmp_path) == ["out"]


def test_a_file_that_appears_in_the_last_moment_is_given_back(tmp_path, monkeypatch):
    place = tmp_path / "out"
    make_result(1).save(place)

    def exchange_late(first, second):
        if (first / "result.json").is_file() and not (second / "thesis.doc").exists():
            (second / "thesis.doc").write_text("years of work")
        return renames.exchange(first, second)

    if not exchange_works(tmp_path):
        pytest.skip("this file system cannot exchange folders")
    monkeypatch.setattr(whole_folders, "exchange", exchange_late)
    with pytest.raises(InputError, match=r"out: the folder holds files that are no result \(\"thesis\.doc"):
        make_result(2).save(place, overwrite=True)
    assert (place / "thesis.doc").read_text() == "years of work" and names(tmp_path) == ["out"]


def exchange_works(folder: Path) -> bool:
    for name in "ab":
        (folder / name).mkdir()
    try:
        return renames.exchange(folder / "a", folder / "b")
    finally:
        for name in "ab":
            (folder / name).rmdir()


@pytest.mark.skipif(sys.platform != "linux", reason="Linux has the call")
def test_linux_exchanges_in_one_step(tmp_path):
    (tmp_path / "a").mkdir()
    (tmp_path / "b").write_text("b")
    if not renames.exchange(tmp_path / "a", tmp_path / "b"):
        pytest.skip("this file system cannot")
    assert (tmp_path / "a").is_file() and (tmp_path / "b").is_dir()
    with pytest.raises(FileNotFoundError):
        renames.exchange(tmp_path / "a", tmp_path / "absent")


def test_a_new_name_replaces_nothing(tmp_path):
    for name in ("old", "new"):
        (tmp_path / name).write_text(name)
    with pytest.raises(FileExistsError):
        renames.rename_file_to_new(tmp_path / "new", tmp_path / "old")
    renames.rename_file_to_new(tmp_path / "new", tmp_path / "newer")
    (tmp_path / "folder").mkdir()
    with pytest.raises(FileExistsError):
        renames.rename_folder_to_new(tmp_path / "folder", tmp_path / "old")
    assert names(tmp_path) == ["folder", "newer", "old"]
    with claimed_file(tmp_path / "model.pt", overwrite=False) as claim:
        (tmp_path / "model.pt").write_text("of another")
        with pytest.raises(InputError, match="appeared here meanwhile"), claim.whole() as temporary:
            temporary.write_text("ours")
    assert (tmp_path / "model.pt").read_text() == "of another"
    assert names(tmp_path) == ["folder", "model.pt", "newer", "old"]


def test_without_locks_a_result_is_saved_all_the_same(tmp_path, monkeypatch):
    monkeypatch.setattr(locks, "_lock", lambda descriptor: False)
    (tmp_path / ".out.01234567.partial").mkdir()
    make_result().save(tmp_path / "out")
    assert names(tmp_path) == [".out.01234567.partial", "out"]  # perhaps of a run that lives


def test_a_place_where_a_disk_is_mounted_is_refused_at_once(tmp_path, monkeypatch):
    (tmp_path / "out").mkdir()
    monkeypatch.setattr(os.path, "ismount", lambda path: Path(path) == tmp_path / "out")
    with pytest.raises(InputError, match="a disk is mounted here"), claimed_folder(tmp_path / "out", False):
        pass


def test_signals_wait_for_the_end_of_a_short_block():
    seen = []
    earlier = signal.signal(signal.SIGINT, lambda number, frame: seen.append(number))
    try:
        with deferred_signals():
            signal.raise_signal(signal.SIGINT)
            assert not seen
        assert seen == [signal.SIGINT]
        signal.raise_signal(signal.SIGINT)
        assert len(seen) == 2
    finally:
        signal.signal(signal.SIGINT, earlier)
