"""Seconds, processor seconds and largest memory of a block of code in this process."""

from __future__ import annotations

import contextlib
import math
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path


@dataclass
class Measures:
    """What a block took; NaN until it has ended.

    Attributes
    ----------
    seconds : float
        By the clock.
    cpu_seconds : float
        Of all threads, and of processes that the block started and waited for.
    peak_memory_mib : float
        Largest resident memory of this process during the block on Linux, what it held before included; elsewhere since
        its start, and NaN where the system does not tell.

    """

    seconds: float = math.nan
    cpu_seconds: float = math.nan
    peak_memory_mib: float = math.nan


@contextlib.contextmanager
def measured() -> Iterator[Measures]:
    """Measure a block, also one that raises."""
    found = Measures()
    _forget_peak()
    began, used = time.perf_counter(), _cpu_seconds()
    try:
        yield found
    finally:
        found.seconds, found.cpu_seconds = time.perf_counter() - began, _cpu_seconds() - used
        found.peak_memory_mib = _peak_mib()


def _cpu_seconds() -> float:
    try:
        import resource
    except ImportError:
        return time.process_time()
    usages = [resource.getrusage(which) for which in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in usages)


def _forget_peak() -> None:
    """Let Linux count the largest resident memory from now on."""
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")


def _peak_mib() -> float:
    with contextlib.suppress(OSError):
        for line in Path("/proc/self/status").read_text(errors="replace").splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) / (1 << 10)
    try:
        import resource
    except ImportError:
        return math.nan
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (
        1 << 20 if sys.platform == "darwin" else 1 << 10
    )
