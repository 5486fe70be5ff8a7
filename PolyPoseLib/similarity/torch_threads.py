"""Torch on one thread for small images: waiting for others costs more than it saves.

Where numba and torch share one OpenMP runtime, numba's number of threads becomes torch's as well, whatever torch was
set to before.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager

import torch


def one_torch_thread() -> AbstractContextManager[None]:
    """Inside, torch computes on the calling thread alone; its number of threads is restored afterwards."""
    return torch_threads(1)


@contextmanager
def torch_threads(count: int) -> Iterator[None]:
    """Inside, torch computes on ``count`` threads; their number is restored afterwards."""
    before = torch.get_num_threads()
    torch.set_num_threads(count)
    try:
        yield
    finally:
        torch.set_num_threads(before)
