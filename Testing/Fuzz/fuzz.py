"""Fuzz the readers: ``python Testing/Fuzz/fuzz.py [TARGET ...] --seconds 300 --seed 1 --findings DIR``.

Every target runs in a child process, so that a crash of native code, a reader without an end and memory without a
bound are findings as much as an exception that is no InputError.  A finding is kept as the changed file beside a text
with the target, the seed and what happened.  The same seed draws the same changes.
"""

from __future__ import annotations

import argparse
import faulthandler
import json
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parents[1] / "Core" / "support"), str(Path(__file__).parents[2])]

BATCH = 100
"""Changes that are drawn from one seed."""

SLOW_SECONDS = 60
"""Reading one small file takes less, also on a busy machine."""

MEMORY_BYTES = 6 << 30
"""Address space that a child may add to what it needs to start."""


def main(argv: list[str] | None = None) -> int:
    """Fuzz and print a table; the status is the number of findings, 100 at most."""
    arguments = _arguments(argv)
    if arguments.child:
        return _child(arguments.child, arguments.seed, arguments.seconds, arguments.findings)
    from fuzz_targets import TARGETS

    names = arguments.targets or list(TARGETS)
    unknown = sorted(set(names) - set(TARGETS))
    if unknown:
        raise SystemExit(f"{', '.join(unknown)}: no such target; choose from {', '.join(TARGETS)}.")
    arguments.findings.mkdir(parents=True, exist_ok=True)
    found = 0
    print(f"{'target':14} {'tried':>7} {'refused':>8} {'findings':>8}")
    for name in names:
        tried, refused, findings = fuzz(
            name, arguments.seed, arguments.seconds / len(names), arguments.findings
        )
        print(f"{name:14} {tried:7} {refused:8} {len(findings):8}", *findings, flush=True)
        found += len(findings)
    return min(found, 100)


def fuzz(name: str, seed: int, seconds: float, findings: Path) -> tuple[int, int, list[str]]:
    """Fuzz one target in child processes: files tried, files refused, and names of the findings."""
    tried = refused = 0
    deaths: list[str] = []
    before = {path.name for path in findings.iterdir()}
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0:
        with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
            command = [sys.executable, __file__, "--child", name, "--seed", str(seed)]
            command += ["--seconds", str(left), "--findings", str(findings)]
            log = Path(folder) / "log"
            status = _run(command, Path(folder), log, left + 3 * SLOW_SECONDS)
            if not Path(folder, "counts").is_file():
                raise RuntimeError(f"the child ended before its first file: {log.read_text()[-2000:]}")
            counts = json.loads(Path(folder, "counts").read_text())
            tried, refused, seed = tried + counts["tried"], refused + counts["refused"], counts["seed"] + 1
            if status != 0:
                deaths.append(_keep_death(name, status, counts, Path(folder), findings))
    new = {path.name for path in findings.iterdir() if path.suffix == ".txt"} - before
    return tried, refused, sorted(new | set(deaths))


def _run(command: list[str], folder: Path, log: Path, seconds: float) -> int:
    """Run a child in a folder; its status, that of a killed one where it does not end."""
    with log.open("w") as stream:
        try:
            done = subprocess.run(
                command,
                cwd=folder,
                stdin=subprocess.DEVNULL,
                stdout=stream,
                stderr=subprocess.STDOUT,
                timeout=seconds,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return -signal.SIGTERM
    return done.returncode


def _keep_death(name: str, status: int, counts: dict, folder: Path, findings: Path) -> str:
    """Keep what a child read when it ended, and how it ended."""
    what = signal.Signals(-status).name if status < 0 else f"exit{status}"
    log = (folder / "log").read_text(errors="replace")[-4000:]
    return _keep(f"{name}-{what}-{counts['seed']}", Path(counts["file"]), folder / "current", log, findings)


def _keep(title: str, path: Path, content: Path, text: str, findings: Path) -> str:
    """Write a finding: the file, and a text that says what happened; the text's name."""
    if content.is_file():
        shutil.copyfile(content, findings / f"{title}-{path.name}")
    (findings / f"{title}.txt").write_text(text, encoding="utf-8", errors="replace")
    return f"{title}.txt"


def _child(name: str, seed: int, seconds: float, findings: Path) -> int:
    """Draw changes and read the changed files until the time is over."""
    import hypothesis
    from fuzz_targets import TARGETS
    from hostile_bytes import hostile
    from hypothesis import strategies as st
    from json_values import assert_one_sentence

    from PolyPoseLib.errors import InputError

    folder = Path.cwd()
    files = folder / "files"
    files.mkdir()
    subjects = TARGETS[name](files)
    counts = {"tried": 0, "refused": 0, "seed": seed, "file": ""}
    end = time.monotonic() + seconds
    seen: set[tuple[str, ...]] = set()
    _limit_memory()
    faulthandler.enable()

    class _TimeIsOver(BaseException):
        """Ends a batch."""

    def note() -> None:
        (folder / "counts").write_text(json.dumps(counts))

    def read(subject, content: bytes) -> None:
        if time.monotonic() > end:
            raise _TimeIsOver
        content = subject.packed(content)
        counts["tried"] += 1
        counts["file"] = str(subject.path)
        (folder / "current").write_bytes(content)
        note()
        kept = subject.path.read_bytes()
        subject.path.write_bytes(content)
        faulthandler.dump_traceback_later(SLOW_SECONDS, exit=True)
        try:
            subject.read()
        except InputError as error:
            counts["refused"] += 1
            try:
                assert_one_sentence(error)
                text = str(error)
                names = filter(None, (subject.path.stem, subject.path.parent.name, subject.part_of))
                assert text.isprintable() and any(name in text for name in names), text
            except (AssertionError, UnicodeError) as fault:
                _finding(fault, error)
        except Exception as error:
            _finding(error, error)
        finally:
            faulthandler.cancel_dump_traceback_later()
            subject.path.write_bytes(kept)

    def _finding(fault: Exception, error: Exception) -> None:
        frames = traceback.extract_tb(error.__traceback__)[-2:]
        kind = (type(fault).__name__, *(f"{Path(frame.filename).name}:{frame.lineno}" for frame in frames))
        if kind in seen:
            return
        seen.add(kind)
        text = "".join(traceback.format_exception(error)) + f"\n{type(fault).__name__}: {fault}\n"
        title = f"{name}-{type(fault).__name__}-{counts['seed']}-{len(seen)}"
        _keep(title, Path(counts["file"]), folder / "current", text, findings)

    cases = st.integers(0, len(subjects) - 1).flatmap(
        lambda number: st.tuples(st.just(number), hostile(subjects[number].whole))
    )
    quiet = hypothesis.settings(
        max_examples=BATCH,
        database=None,
        deadline=None,
        phases=[hypothesis.Phase.generate],
        suppress_health_check=list(hypothesis.HealthCheck),
    )
    note()
    try:
        while True:

            @hypothesis.seed(counts["seed"])
            @quiet
            @hypothesis.given(cases)
            def batch(case: tuple[int, bytes]) -> None:
                read(subjects[case[0]], case[1])

            batch()
            counts["seed"] += 1
    except _TimeIsOver:
        note()
    return 0


def _limit_memory() -> None:
    """Bound the address space, where the system can."""
    try:
        import resource
    except ImportError:
        return
    used = (
        int(Path("/proc/self/statm").read_text().split()[0]) * 4096
        if Path("/proc/self/statm").exists()
        else 0
    )
    resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY_BYTES, resource.RLIM_INFINITY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _arguments(argv: list[str] | None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("targets", nargs="*", metavar="TARGET", help="all when left out")
    parser.add_argument("--seconds", type=float, default=120, help="for all targets together (120)")
    parser.add_argument("--seed", type=int, default=0, help="of the first batch (0)")
    parser.add_argument(
        "--findings", type=Path, default=Path("fuzz-findings"), help="folder for what is found"
    )
    parser.add_argument("--child", help=argparse.SUPPRESS)
    return parser.parse_args(argv)


if __name__ == "__main__":
    sys.exit(main())
