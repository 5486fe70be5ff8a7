"""A correction by hand: which frames it renews, and what it refuses."""

from dataclasses import replace

import numpy as np
import pytest
from json_values import assert_one_sentence
from result_case import random_pose
from track_case import make_track

import PolyPoseLib as pp
from PolyPoseLib.errors import InputError

TRACK = replace(make_track(2, frames=10, first=5), smoothed=False)
POSE = random_pose(np.random.default_rng(0), 30, 50)


@pytest.mark.parametrize(
    ("direction", "until", "renewed"),
    [
        ("forward", None, range(8, 15)),
        ("backward", None, range(5, 9)),
        ("both", None, range(5, 15)),
        ("forward", 11, range(8, 12)),
        ("backward", 6, range(6, 9)),
        ("both", 11, range(5, 12)),
        ("both", 6, range(6, 15)),
        ("forward", 8, range(8, 9)),
        ("backward", 8, range(8, 9)),
        ("both", 8, range(8, 9)),
    ],
)
def test_frames_that_are_tracked_anew(direction, until, renewed):
    correction = pp.Correction(TRACK, 8, {"talus": POSE}, direction, until)
    assert correction.renewed == renewed and correction.corrected is TRACK.frames[3]


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"frame": 4}, "The corrected frame, 4, is none of the track's: give one from 5 to 14."),
        ({"until": 15}, "The frame to end at, 15, is none of the track's"),
        ({"until": 7, "direction": "forward"}, "lies before frame 8"),
        ({"until": 9, "direction": "backward"}, "lies after frame 8"),
        ({"direction": "up"}, 'direction "up"'),
        ({"poses": {"femur": POSE}}, 'structure "femur"'),
        ({"poses": {"talus": np.eye(3)}}, 'The corrected pose of "talus" has shape'),
        ({"poses": {"talus": np.full((4, 4), np.nan)}}, "NaN"),
        ({"poses": {"talus": 2 * np.eye(4)}}, "last row"),
        ({"track": replace(TRACK, smoothed=True)}, "was smoothed"),
    ],
)
def test_what_cannot_be_is_one_sentence(changes, says):
    given = {"track": TRACK, "frame": 8, "poses": {"talus": POSE}, **changes}
    with pytest.raises(InputError) as error:
        pp.Correction(**given)
    assert says in str(error.value)
    assert_one_sentence(error)
