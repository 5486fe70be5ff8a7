"""How much memory something takes, in use and reserved; what every registration takes, whatever its study."""

from __future__ import annotations

import os
from dataclasses import dataclass

MIB = 1 << 20

_PROGRAM = 560 * MIB
"""Python, the libraries, their compiled loops and thread pools."""

_COMPILING = 330 * MIB
"""What compiling the loops takes, and does not give back."""

_RESERVED = 950 * MIB
"""What the libraries reserve of the address space beyond the memory that they use."""

_RESERVED_BY_THREAD = 70 * MIB
"""The same for each thread: its stack, and its share of the allocator's arenas."""


@dataclass(frozen=True)
class MemoryNeed:
    """Bytes at the peak of a computation.

    Parameters
    ----------
    resident : int
        Memory in use.
    address_space : int
        Memory that is reserved, which ``ulimit -v`` limits.
    loaded : int
        Of both: images that are in memory before it begins.

    """

    resident: int
    address_space: int
    loaded: int = 0

    @classmethod
    def of_program(
        cls, more: float = 0, loaded: float = 0, threads: int | None = None, compiles: bool = False
    ) -> MemoryNeed:
        """The program and ``more`` bytes, of which ``loaded`` are in memory already.

        threads: at least so many; compiles: whether no earlier run left its compiled loops.
        """
        reserved = _RESERVED + _RESERVED_BY_THREAD * max(threads or 0, _processors())
        program = _PROGRAM + (_COMPILING if compiles else 0)
        return cls(int(program + more), int(program + more + reserved), int(loaded))


def _processors() -> int:
    """Processors that this process may use: libraries start as many threads."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
