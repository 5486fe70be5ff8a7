"""Compiled loops: cached where that is possible, never stale, never mixed up, never a reason to fail."""

import os
import shutil
import stat
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("numba")

import PolyPoseLib
from PolyPoseLib import compiled

PACKAGE = Path(PolyPoseLib.__file__).parent

STAGE = """
import numba

@numba.njit
def stage(x):
    return x + 1
"""

LOOP = """
from loops.compiled import compiled
from loops.stage_kernel import stage

@compiled(fastmath=True)
def loop(values):
    total = values[0] * 0
    for value in values:
        total += stage(value)
    return total
"""

CALL = """
import logging
import sys
logging.basicConfig(level=logging.INFO, format="LOG %(message)s", stream=sys.stdout)
import numpy as np
from loops.compiled import is_kept
from loops.outer_kernel import loop

print("KEPT", is_kept(loop))
types = [np.float32, np.float64][:: int(sys.argv[1])]
print("SUM", *(float(loop(np.arange(5, dtype=t))) for t in types))
hits = getattr(loop, "stats").cache_hits
print("HITS", sum(hits.values()))
"""


@pytest.fixture
def loops(tmp_path):
    """A small package with one loop, whose stage is in another file; calls it in a new process."""
    return Loops(tmp_path)


class Loops:
    def __init__(self, root):
        self.package = root / "loops"
        self.package.mkdir()
        (self.package / "__init__.py").touch()
        (self.package / "stage_kernel.py").write_text(STAGE)
        (self.package / "outer_kernel.py").write_text(LOOP)
        shutil.copy(compiled.__file__, self.package / "compiled.py")
        self.temporary = root / "temporary"
        self.temporary.mkdir()
        self.file = root / "file"
        self.file.touch()
        self.kept = False
        private = {name: str(root / "home") for name in ("HOME", "XDG_CACHE_HOME", "LOCALAPPDATA")}
        self.environment = {
            **{name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")},
            **private,
            **dict.fromkeys(("TMPDIR", "TEMP", "TMP"), str(self.temporary)),
            "PYTHONPATH": str(root),
            "PYTHONDONTWRITEBYTECODE": "1",
        }

    def make_unwritable(self, *names):
        """Take the folders for caches away: where they should be is a file."""
        (self.package / "__pycache__").touch()
        for name in ("HOME", "XDG_CACHE_HOME", "LOCALAPPDATA", *names):
            self.environment[name] = str(self.file)

    def start(self, step=1):
        command = [sys.executable, "-c", CALL, str(step)]
        return subprocess.Popen(
            command,
            env=self.environment,
            cwd=self.file.parent,
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )

    def call(self):
        return self.end(self.start())

    def end(self, process):
        output, _ = process.communicate(timeout=300)
        assert process.returncode == 0, output
        lines = output.splitlines()
        sums = next(line for line in lines if line.startswith("SUM")).split()[1:]
        hits = int(next(line for line in lines if line.startswith("HITS")).split()[1])
        self.kept = "KEPT True" in lines  # before anything was called
        return [float(x) for x in sums], hits, [line for line in lines if line.startswith("LOG")]

    def cached(self, folder=None):
        return sorted((folder or self.package).rglob("*.nbc"))


def test_machine_code_is_kept_in_the_packages_folder(loops):
    assert loops.call() == ([15.0, 15.0], 0, [])
    assert len(loops.cached()) == 2 and not loops.kept
    assert loops.call() == ([15.0, 15.0], 2, [])
    assert loops.kept


def test_where_nothing_else_can_be_written_a_private_temporary_folder_serves(loops):
    loops.make_unwritable()
    sums, hits, log = loops.call()
    assert (sums, hits, len(log)) == ([15.0, 15.0], 0, 1)
    (folder,) = loops.temporary.iterdir()
    assert str(folder) in log[0]
    assert len(loops.cached(folder)) == 2
    if os.name == "posix":
        assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    assert loops.call()[:2] == ([15.0, 15.0], 2)


def test_where_nothing_at_all_can_be_written_every_start_compiles(loops):
    loops.make_unwritable("TMPDIR", "TEMP", "TMP")
    loops.file.parent.joinpath(f"polypose-{os.getuid()}" if os.name == "posix" else "polypose").touch()
    loops.environment["TMPDIR"] = str(loops.file.parent)  # writable, but the folder's name is taken
    for _ in range(2):
        sums, hits, log = loops.call()
        assert (sums, hits, len(log)) == ([15.0, 15.0], 0, 1)
        assert "NUMBA_CACHE_DIR" in log[0] and not loops.kept


@pytest.mark.skipif(os.name != "posix", reason="permissions of POSIX")
@pytest.mark.parametrize("trap", ["open to all", "a link"])
def test_a_temporary_folder_that_others_can_write_to_is_never_read(loops, trap):
    loops.make_unwritable()
    folder = loops.temporary / f"polypose-{os.getuid()}"
    if trap == "a link":
        (loops.temporary / "elsewhere").mkdir(mode=0o700)
        folder.symlink_to(loops.temporary / "elsewhere")
    else:
        folder.mkdir()
        folder.chmod(0o777)
    sums, hits, log = loops.call()
    assert (sums, hits, len(log)) == ([15.0, 15.0], 0, 1)
    assert not loops.cached(loops.temporary)


def test_a_change_in_an_imported_stage_is_seen(loops):
    loops.call()
    (loops.package / "stage_kernel.py").write_text(STAGE.replace("x + 1", "x + 2"))
    assert loops.call() == ([20.0, 20.0], 0, [])
    assert not loops.kept
    assert loops.call() == ([20.0, 20.0], 2, [])
    assert loops.kept
    assert len(loops.cached()) == 2


def test_damaged_files_are_compiled_again(loops):
    loops.call()
    first, second = loops.cached()
    whole = first.read_bytes()
    for damaged in (b"", whole[:20], whole[: len(whole) // 2], whole[:-1], second.read_bytes()):
        first.write_bytes(damaged)
        assert loops.call() == ([15.0, 15.0], 1, [])
        assert loops.call() == ([15.0, 15.0], 2, [])


def test_a_folder_that_is_lost_or_full_later_costs_one_line(tmp_path, monkeypatch, caplog):
    import numpy as np

    monkeypatch.setattr(compiled, "_warned", [])

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(compiled.OverloadFiles, "save", full)
    monkeypatch.setattr(compiled.OverloadFiles, "load", full)

    @compiled.compiled()
    def double(x):
        return 2 * x

    @compiled.compiled()
    def triple(x):
        return 3 * x

    assert double(2.0) == 4.0
    assert triple(np.float32(2.0)) == 6.0
    assert [record.getMessage().count("No space left") for record in caplog.records] == [1]


@pytest.mark.long
def test_processes_that_start_together_on_an_empty_cache_agree(loops):
    """Each compiles two signatures in its own order; every file then belongs to its signature."""
    started = [loops.start(step=(-1) ** n) for n in range(4)]
    assert all(loops.end(process)[0] == [15.0, 15.0] for process in started)
    assert len(list((loops.package / "__pycache__").iterdir())) == 2
    assert loops.call() == ([15.0, 15.0], 2, [])


def test_all_compiled_loops_are_in_files_that_the_cache_watches():
    watched = set(PACKAGE.rglob(compiled.KERNEL_FILES))
    for path in set(PACKAGE.rglob("*.py")) - {Path(compiled.__file__)}:
        text = path.read_text(encoding="utf-8")
        if "numba.njit" in text or "@compiled(" in text:
            assert path in watched
            assert "cache=True" not in text
