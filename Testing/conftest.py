"""What all tests share: idle threads that sleep, sample data, a small heap, and how hypothesis draws examples.

Samples are taken from the cache and fetched only where POLYPOSE_FETCH_SAMPLES asks for it. Hypothesis draws the same
examples every time; ``--hypothesis-profile explore`` draws many others.
"""

import gc
import os

# Test processes share the cores, and threads that spin while they wait for others keep those from running: a small
# matrix product then takes forty times its time. Children inherit this. Loops keep all their threads.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pytest
from hypothesis import settings

settings.register_profile("seeded", derandomize=True, deadline=None, max_examples=25, database=None)
settings.register_profile("explore", deadline=None, max_examples=2000)
settings.load_profile("seeded")

RARE = ("kill", "soak", "fuzz", "long")
"""Marks of tests that run only when they are asked for, by ``-m``."""


@pytest.fixture(scope="module", autouse=True)
def heap_of_this_file() -> None:
    """Let garbage collections look only at what this file's tests make.

    Walking a million objects of imported packages and collected tests takes a third of a second each time, and every
    test of the panel does so once or twice to see that nothing was left.
    """
    gc.collect()
    gc.freeze()


def pytest_sessionstart(session: pytest.Session) -> None:
    """Fetch the samples once, before any test looks for them; without a registry those tests skip."""
    if not os.environ.get("POLYPOSE_FETCH_SAMPLES"):
        return
    from PolyPoseLib.errors import InputError
    from PolyPoseLib.io.samples import SAMPLES, fetch_sample

    for name in SAMPLES:
        try:
            fetch_sample(name)
        except InputError as error:
            print(f"The {name} sample is not there, its tests will skip: {error}")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out what takes minutes and tells nothing new every time, unless its mark is asked for."""
    rare = [mark for mark in RARE if mark not in config.option.markexpr]
    left_out = [item for item in items if any(item.get_closest_marker(mark) for mark in rare)]
    config.hook.pytest_deselected(items=left_out)
    items[:] = [item for item in items if item not in left_out]
