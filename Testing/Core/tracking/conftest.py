"""A knee of small images, followed once for several tests."""

import pytest
from moving_knee import SMALL, KneeOptions, MovingKnee

from PolyPoseLib.tracking.follow import track


@pytest.fixture(scope="session")
def knee():
    return MovingKnee(1, KneeOptions(**SMALL))


@pytest.fixture(scope="session")
def knee_sequence(knee):
    """Its images are made once."""
    return knee.sequence()


@pytest.fixture(scope="session")
def knee_track(knee_sequence):
    return track(knee_sequence)
