"""How much memory is left: of the machine, of a container, and of the limits of this process."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from PolyPoseLib.data.memory_need import MemoryNeed
from PolyPoseLib.errors import LESS_MEMORY, InputError

_CGROUPS = Path("/sys/fs/cgroup")
_OWN_CGROUPS = Path("/proc/self/cgroup")
_GIB = 1 << 30


@dataclass(frozen=True)
class MemoryLeft:
    """Bytes that are left under one limit.

    Parameters
    ----------
    left : int
        Bytes that may still be taken.
    used : int
        Bytes of this process that count already.
    limit : str
        The limit's name, for the sentence.
    is_address_space : bool
        Whether it counts what is reserved, not what is used.

    """

    left: int
    used: int
    limit: str
    is_address_space: bool = False


def require_memory(need: MemoryNeed, what: str) -> None:
    """Refuse what will not fit in memory, before it is begun.

    Parameters
    ----------
    need : MemoryNeed
        At the peak, what the process holds already included.
    what : str
        What needs them, for the sentence.

    Raises
    ------
    InputError
        A limit is too low; the sentence says how much is needed, what is left under which limit, and what to do.

    """
    for each in memory_left():
        peak = need.address_space if each.is_address_space else need.resident
        more = peak - min(each.used, need.loaded + _libraries(each))
        if more > each.left:
            raise InputError(
                f"{what} needs about {peak / _GIB:.1f} GiB of memory ({more / _GIB:.1f} GiB more than it has now), "
                f"but {max(each.left, 0) / _GIB:.1f} GiB are left {each.limit}: {LESS_MEMORY}."
            )


def require_room(more: float, what: str) -> None:
    """Refuse something that takes this many bytes more than the process has now; raises InputError."""
    for each in memory_left():
        if more > each.left:
            raise InputError(
                f"{what}: it takes {more / _GIB:.1f} GiB of memory, but {max(each.left, 0) / _GIB:.1f} GiB are left "
                f"{each.limit}: {LESS_MEMORY}."
            )


def _libraries(each: MemoryLeft) -> int:
    """Bytes that libraries have taken at most when the question is asked."""
    return (1300 if each.is_address_space else 450) << 20


def memory_left() -> Iterator[MemoryLeft]:
    """Everything that limits how much memory this process can take, as far as the system says."""
    if sys.platform == "linux":
        size, resident = _own_bytes()
        yield from _address_space(size)
        yield from _containers(resident)
        yield from _machine(resident)
    elif sys.platform == "win32":
        yield from _windows()


def _own_bytes() -> tuple[int, int]:
    """Address space and memory of this process."""
    try:
        fields = Path("/proc/self/statm").read_text().split()
        page = os.sysconf("SC_PAGE_SIZE")
        return int(fields[0]) * page, int(fields[1]) * page
    except (OSError, ValueError, IndexError):
        return 0, 0


def _address_space(size: int) -> Iterator[MemoryLeft]:
    """The limit of ``ulimit -v``."""
    if sys.platform == "win32":
        return
    import resource

    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit != resource.RLIM_INFINITY:
        yield MemoryLeft(limit - size, size, "under this process's limit of address space (ulimit -v)", True)


def _containers(resident: int) -> Iterator[MemoryLeft]:
    """The limits of control groups, as containers and batch systems set them."""
    try:
        lines = _OWN_CGROUPS.read_text().splitlines()
    except OSError:
        return
    for line in lines:
        _, _, rest = line.partition(":")
        controllers, _, name = rest.partition(":")
        if controllers and "memory" not in controllers.split(","):
            continue
        root = _CGROUPS / "memory" if controllers else _CGROUPS
        names = (
            ("memory.limit_in_bytes", "memory.usage_in_bytes")
            if controllers
            else ("memory.max", "memory.current")
        )
        folder = root / name.lstrip("/")
        for place in (folder, *folder.parents):
            limit, used = (_number(place / each) for each in names)
            if limit is not None and used is not None and limit < 1 << 60:
                left = limit - used + _reclaimable(place)
                yield MemoryLeft(left, resident, "under the memory limit of its container or job")
            if place == root:
                break


def _reclaimable(group: Path) -> int:
    """Bytes of a control group that only cache files."""
    try:
        for line in (group / "memory.stat").read_text().splitlines():
            name, _, value = line.partition(" ")
            if name in ("inactive_file", "total_inactive_file"):
                return int(value)
    except (OSError, ValueError):
        pass
    return 0


def _machine(resident: int) -> Iterator[MemoryLeft]:
    """The machine's memory, with what it can swap out."""
    try:
        lines = Path("/proc/meminfo").read_text().splitlines()
        kib = {
            name: int(rest.split()[0]) for name, _, rest in (line.partition(":") for line in lines) if rest
        }
        left = (kib["MemAvailable"] + kib.get("SwapFree", 0)) << 10
    except (OSError, ValueError, KeyError, IndexError):
        return
    yield MemoryLeft(left, resident, "on this machine")


def _windows() -> Iterator[MemoryLeft]:
    """What Windows can still promise: memory and page file."""
    import ctypes

    class Status(ctypes.Structure):
        _fields_ = [("length", ctypes.c_ulong), ("load", ctypes.c_ulong)] + [
            (name, ctypes.c_ulonglong)
            for name in (
                "memory",
                "memory_left",
                "paged",
                "paged_left",
                "virtual",
                "virtual_left",
                "extended",
            )
        ]

    status = Status(length=ctypes.sizeof(Status))
    try:
        known = ctypes.windll.kernel32.GlobalMemoryStatusEx(ctypes.byref(status))  # type: ignore[attr-defined]
    except (AttributeError, OSError):
        return
    if known:
        yield MemoryLeft(int(status.paged_left), 0, "on this machine")


def _number(path: Path) -> int | None:
    """The whole number in a file; None where there is none."""
    try:
        text = path.read_text().strip()
    except OSError:
        return None
    return int(text) if text.isdigit() else None
