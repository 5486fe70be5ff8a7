"""Bones that a sequence unites in one structure: those that move against the others are named after the track."""

from dataclasses import replace

import numpy as np
import pytest
from moving_knee import NAMES, SMALL, KneeOptions, MovingKnee

from PolyPoseLib.data.progress import Monitor
from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.tracking.track import TrackedFrame
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import CancelledError
from PolyPoseLib.tracking.follow import track
from PolyPoseLib.tracking.patient import Patient
from PolyPoseLib.tracking.united import united_warnings

FEMUR, TIBIA, PATELLA = 1, 2, 3


@pytest.fixture(scope="module")
def bent() -> dict[int, MovingKnee]:
    """Knees whose patella moves by up to a centimetre against the femur, by seed."""
    return {seed: MovingKnee(seed, KneeOptions(**{**SMALL, "flexion_deg": 20.0})) for seed in range(4)}


def united(knee):
    """The sequence with femur and patella as one structure."""
    labels = knee.structures.labels
    thigh = np.where(labels == TIBIA, 2, np.minimum(labels, 1))
    return replace(
        knee.sequence(backward=False),
        structures=Structures(("thigh", "tibia"), thigh),
        reference="thigh",
        initial_poses={"thigh": knee.poses[0, FEMUR - 1], "tibia": knee.poses[0, TIBIA - 1]},
        source_segmentation=Volume(labels, knee.ct.affine),
        label_names=dict(enumerate(NAMES, start=1)),
    )


def frames_at(poses, sources=None) -> list[TrackedFrame]:
    """Frames whose structures have poses (F, K, 4, 4)."""
    count = poses.shape[1]
    return [
        TrackedFrame(
            number,
            of_frame,
            np.stack([np.eye(6)] * count),
            np.zeros(count),
            ((),) * count,
            ("forward",) * count if sources is None else sources,
        )
        for number, of_frame in enumerate(poses)
    ]


def warnings(sequence, frames, cancel=None) -> list[str]:
    patient = Patient(sequence, Monitor(None, None))
    patient.run = replace(patient.run, monitor=Monitor(None, cancel))
    return list(united_warnings(patient, frames))


@pytest.mark.parametrize("seed", range(4))
def test_a_bone_that_moves_against_its_structure_is_named_with_the_frame(bent, seed):
    knee = bent[seed]
    (warning,) = warnings(united(knee), frames_at(knee.poses[:, :2]))
    assert warning.startswith('"thigh" seems to unite bones that moved against each other')
    assert '"patella"' in warning and '"femur"' not in warning
    assert "in frame 2 (" in warning and "of 5 frames looked at)" in warning  # the one bent most


def test_a_track_warns(bent):
    found = track(united(bent[2]))
    assert [line for line in found.warnings if '"thigh" seems to unite bones' in line]


def test_halves_of_bones_that_were_followed_are_not_off(knee, knee_sequence, knee_track):
    labels = knee.structures.labels
    halves = labels.astype(np.int32)
    for number in (FEMUR, TIBIA, PATELLA):
        upper = labels == number
        upper[: int(np.median(np.nonzero(upper)[0]))] = False
        halves[upper] += len(NAMES)
    sequence = replace(knee_sequence, source_segmentation=Volume(halves, knee.ct.affine))
    assert warnings(sequence, knee_track.frames) == []


def test_a_structure_that_was_lost_is_not_looked_at(bent):
    knee = bent[2]
    assert warnings(united(knee), frames_at(knee.poses[:, :2], ("none", "forward"))) == []


def test_it_can_be_cancelled(bent):
    knee = bent[2]
    with pytest.raises(CancelledError):
        warnings(united(knee), frames_at(knee.poses[:, :2]), cancel=lambda: True)
