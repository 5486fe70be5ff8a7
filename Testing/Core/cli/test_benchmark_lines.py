"""What a person sees of a benchmark that takes hours: every run that has ended, and what runs now."""

import io

import pytest

from PolyPoseLib.cli._benchmark_lines import EndedRuns, RunLines
from PolyPoseLib.data.benchmark.progress import BenchmarkProgress


class Terminal(io.StringIO):
    def isatty(self):
        return True


def step(ended, system, status, reused=False):
    what = {"case": "case-1", "system": system, "status": status, "reused": reused}
    return BenchmarkProgress("runs", ended, 4, None, 12.4, **what)


STEPS = [
    step(0, "a", "running"),
    step(0, "b", "running"),
    step(1, "a", "done"),
    step(2, "c", "done", True),
    step(3, "b", "failed"),
    step(3, "d", "running"),
    step(4, "d", "skipped"),
]

ENDED = [
    "1/4 a on case-1: done, 12 s since the start",
    "2/4 c on case-1: done (kept from an earlier run), 12 s since the start",
    "3/4 b on case-1: failed, 12 s since the start",
    "4/4 d on case-1: skipped, 12 s since the start",
]


def shown(stream):
    """Lines as a terminal shows them in the end."""
    screen = []
    for line in stream.getvalue().split("\n"):
        seen = ""
        for part in line.split("\r"):
            seen = part + seen[len(part) :]
        screen.append(seen.rstrip())
    return screen


def test_a_file_has_a_line_for_every_run_that_has_ended():
    stream = io.StringIO()
    display = RunLines(stream)
    for each in STEPS:
        display(each)
    display.close()
    assert stream.getvalue() == "\n".join([*ENDED, ""])


def test_a_terminal_says_what_runs_and_keeps_what_has_ended():
    stream = Terminal()
    display = RunLines(stream)
    for count, each in enumerate(STEPS, start=1):
        display(each)
        if count == 2:
            assert shown(stream) == ["0/4 ended, running: a on case-1, b on case-1"]
        if count == 3:
            assert shown(stream) == [ENDED[0], "1/4 ended, running: b on case-1"]
    display.close()
    assert shown(stream) == [*ENDED, ""]


@pytest.mark.parametrize("count", [3, 4, 30])
def test_many_runs_at_a_time_are_counted(count):
    stream = Terminal()
    display = RunLines(stream)
    for number in range(count):
        display(step(0, f"s{number}", "running"))
    said = shown(stream)[-1]
    assert said.startswith("0/4 ended, running: s0 on case-1, s1 on case-1, s2 on case-1")
    assert said.endswith(f", {count - 3} more") == (count > 3)


def test_an_interrupted_run_leaves_no_line_that_says_it_runs():
    stream = Terminal()
    display = RunLines(stream)
    display(STEPS[0])
    display.close()
    assert shown(stream) == [""]


def test_programs_get_the_runs_that_have_ended_only():
    class Kept:
        def __init__(self):
            self.steps, self.closed = [], False

        def __call__(self, each):
            self.steps.append(each)

        def close(self):
            self.closed = True

    kept = Kept()
    display = EndedRuns(kept)
    for each in STEPS:
        display(each)
    display.close()
    assert [each.system for each in kept.steps] == ["a", "c", "b", "d"] and kept.closed
