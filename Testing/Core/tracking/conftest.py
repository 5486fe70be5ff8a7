"""A knee of small images, followed once for several tests."""

import pytest
from moving_knee import SMALL, KneeOptions, MovingKnee

from PolyPoseLib.data.progress import Monitor
from PolyPoseLib.tracking.follow import track
from PolyPoseLib.tracking.frame_fit import Frame
from PolyPoseLib.tracking.patient import Patient


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


@pytest.fixture(scope="module")
def patient(knee_sequence):
    """Who is followed, as read."""
    return Patient(knee_sequence, Monitor(None, None))


@pytest.fixture(scope="module")
def frame(patient):
    """One of the frames."""
    return Frame(patient, 3)


@pytest.fixture(scope="module")
def right(patient, knee):
    """The true poses of that frame, in the scene."""
    return patient.enlarged(knee.poses[3])
