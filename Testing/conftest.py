"""Sample data for all tests: taken from the cache, fetched only where POLYPOSE_FETCH_SAMPLES asks for it."""

import os

import pytest


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
