"""The soak itself, when it is asked for by ``-m soak``; and always, that it sees what it looks for."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
import soak

SCRIPT = Path(soak.__file__)
NOTHING = soak.Holdings(100 << 20, frozenset({"0 /dev/null"}), 4, frozenset())

pytestmark = pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="reads /proc")


@pytest.mark.soak
def test_nothing_is_left_of_two_hundred_registrations():
    done = subprocess.run([sys.executable, str(SCRIPT)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({}, None),
        ({"memory": 101 << 20}, None),
        ({"memory": 103 << 20}, "memory grew"),
        ({"files": frozenset({"0 /dev/null", "9 /left/open"})}, "9 /left/open"),
        ({"threads": 5}, "5 threads"),
        ({"children": frozenset({42})}, "42"),
    ],
)
def test_what_is_left_is_named(change, said):
    held = [NOTHING] * (soak.WARM_UP + soak.WINDOW) + [replace(NOTHING, **change)] * soak.WINDOW
    found = soak.leaks(held)
    assert len(found) == (said is not None)
    assert all(said in sentence for sentence in found)


def test_a_file_and_a_child_are_seen(tmp_path):
    before = soak.Holdings.now()
    child = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    try:
        with (tmp_path / "open").open("w"):
            now = soak.Holdings.now()
    finally:
        child.communicate()
    assert any(name.endswith("open") for name in now.files - before.files)
    assert child.pid in now.children
