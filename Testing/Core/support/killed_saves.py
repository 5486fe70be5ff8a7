"""Saves that are killed at a given moment: a process that has imported everything and saves in forks of itself.

Run as a program, it reads one request a line, ``{"place", "seed", "moment", "overwrite"}``, and forks. The fork saves;
at the moment it says so on stdout, waits, and goes on. When it has ended, its status is written: its exit status, or
minus the number of the signal that killed it. :class:`Saver` is the other end.
"""

from __future__ import annotations

import contextlib
import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import PolyPoseLib

FOLDER_MOMENTS = (
    "folder is made",
    "json is written",
    "transform is written",
    "last volume is written",
    "before the exchange",
    "after the exchange",
    "old folder is removed",
)
TWO_STEP_MOMENTS = ("before the renames", "between the renames", "after the renames", "old folder is removed")
"""Where no exchange is possible."""

NEW_MOMENTS = ("before the first rename", "after the first rename")
"""Where no earlier result stands at the place."""

FILE_MOMENTS = ("file is written", "before the replacement", "after the replacement")

WAIT_SECONDS = 0.15


class Saver:
    """Asks a process for saves, and sends a signal to the fork that saves when it has reached its moment."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, __file__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, "PYTHONPATH": str(Path(PolyPoseLib.__file__).parents[1])},
        )

    def save(
        self,
        place: Path,
        seed: int,
        moment: str = "",
        number: int = 0,
        overwrite: bool = True,
        two_steps: bool = False,
        after_seconds: float | None = None,
    ) -> int:
        """The end of one save: the exit status, or minus the number of a signal.

        moment: at which the signal ``number`` is sent, "" for a save that nothing disturbs; after_seconds: send the
        signal so long after the save has begun.
        """
        request = {"place": str(place), "seed": seed, "moment": moment, "overwrite": overwrite}
        self._write({**request, "two_steps": two_steps})
        pid = int(self._read("began"))
        if after_seconds is not None:
            time.sleep(after_seconds)
            self._kill(pid, number)
        elif moment:
            self._read(moment)
            self._kill(pid, number)
        return int(self._read("ended"))

    def close(self) -> None:
        """End the process."""
        self._process.stdin.close()
        self._process.wait(timeout=30)
        self._process.stdout.close()

    def _kill(self, pid: int, number: int) -> None:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, number)

    def _write(self, request: dict) -> None:
        self._process.stdin.write(json.dumps(request) + "\n")
        self._process.stdin.flush()

    def _read(self, word: str) -> str:
        """The rest of the next line, which begins with a word."""
        line = self._process.stdout.readline()
        assert line.startswith(word), (word, line)
        return line.removeprefix(word)


def main() -> None:
    """Serve requests until stdin ends."""
    import PolyPoseLib.io.results  # noqa: F401  (what every fork needs)

    for line in sys.stdin:
        request = json.loads(line)
        pid = os.fork()
        if pid == 0:
            _save_and_exit(request)
        _say(f"began{pid}")
        _, status = os.waitpid(pid, 0)
        _say(f"ended{os.waitstatus_to_exitcode(status)}")


def _save_and_exit(request: dict) -> None:
    """Save as the request says, and leave the fork."""
    from PolyPoseLib.__main__ import _interrupt_on_termination

    _interrupt_on_termination()
    try:
        _wait_at(request["moment"], request["two_steps"])
        save = _save_file if Path(request["place"]).suffix == ".json" else _save_result
        save(Path(request["place"]), request["seed"], request["overwrite"])
    except KeyboardInterrupt:
        os._exit(130)
    except Exception as error:
        print(repr(error), file=sys.stderr, flush=True)
        os._exit(1)
    os._exit(0)


def _save_result(place: Path, seed: int, overwrite: bool) -> None:
    from result_case import make_result

    make_result(seed).save(place, overwrite=overwrite)


def _save_file(place: Path, seed: int, overwrite: bool) -> None:
    from PolyPoseLib.cli.cameras import write_json

    write_json(file_fields(seed), place, "--output")


def file_fields(seed: int) -> dict:
    """What a file holds."""
    return {"seed": seed, "numbers": random.Random(seed).choices(range(1000), k=20000)}


def _wait_at(moment: str, two_steps: bool) -> None:
    """Patch what happens at a moment, so that it is announced and lasts a while."""
    from PolyPoseLib.io import results, whole_files, whole_folders

    def before(owner: object, name: str, when: Callable[[int], bool] = lambda count: True) -> None:
        _patch(owner, name, moment, when, at_the_end=False)

    def after(owner: object, name: str, when: Callable[[int], bool] = lambda count: True) -> None:
        _patch(owner, name, moment, when, at_the_end=True)

    results._write_picture = lambda result, path: path.write_bytes(b"drawing takes a second")
    if two_steps:
        whole_folders.exchange = lambda first, second: False
    {
        "": lambda: None,
        "folder is made": lambda: after(Path, "mkdir"),
        "json is written": lambda: after(Path, "write_text"),
        "transform is written": lambda: after(results, "write_transform"),
        "last volume is written": lambda: after(results, "write_volume", lambda count: count == 4),
        "before the exchange": lambda: before(whole_folders, "exchange"),
        "after the exchange": lambda: after(whole_folders, "exchange"),
        "old folder is removed": lambda: before(whole_folders.shutil, "rmtree"),
        "before the renames": lambda: before(whole_folders, "_replace_in_two_steps"),
        "between the renames": lambda: before(Path, "rename", lambda count: count == 2),
        "after the renames": lambda: after(Path, "rename", lambda count: count == 2),
        "before the first rename": lambda: before(whole_folders, "rename_folder_to_new"),
        "after the first rename": lambda: after(whole_folders, "rename_folder_to_new"),
        "file is written": lambda: after(Path, "write_text"),
        "before the replacement": lambda: before(whole_files.os, "replace"),
        "after the replacement": lambda: after(whole_files.os, "replace"),
    }[moment]()


def _patch(owner: object, name: str, moment: str, when: Callable[[int], bool], at_the_end: bool) -> None:
    """Announce the moment at the first call of a function whose count ``when`` holds for, and wait there."""
    inner, count, announced = getattr(owner, name), 0, False

    def announce(at_the_end_now: bool) -> None:
        nonlocal announced
        if when(count) and at_the_end_now == at_the_end and not announced:
            announced = True
            _announce(moment)

    def outer(*arguments: object, **settings: object) -> object:
        nonlocal count
        count += 1
        announce(False)
        value = inner(*arguments, **settings)
        announce(True)
        return value

    setattr(owner, name, outer)


def _announce(moment: str) -> None:
    _say(moment)
    time.sleep(WAIT_SECONDS)


def _say(line: str) -> None:
    os.write(1, (line + "\n").encode())


SIGNALS = tuple(getattr(signal, name) for name in ("SIGKILL", "SIGTERM", "SIGINT") if hasattr(signal, name))


if __name__ == "__main__":
    main()
