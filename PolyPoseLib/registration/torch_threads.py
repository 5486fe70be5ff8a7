"""Torch on one thread for small images: waiting for others costs more than it saves.

Where numba and torch share one OpenMP runtime, numba's threads become torch's as well, whatever torch was told before.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import torch


@contextmanager
def one_torch_thread() -> Iterator[None]:
    """Inside, torch computes on the calling thread alone; its number of threads is restored afterwards."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)
