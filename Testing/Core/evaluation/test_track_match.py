"""A track is scored against the truth of its own sequence alone."""

from dataclasses import replace

import numpy as np
import pytest
from json_values import assert_one_sentence
from scipy.spatial.transform import Rotation
from track_case import make_track

from PolyPoseLib.data.tracking.track_truth import TrackTruth
from PolyPoseLib.errors import InputError
from PolyPoseLib.evaluation.track_match import require_truth_of

TRACK = replace(make_track(3, frames=6), centroids=np.array([[0.0, 10, 40], [3, -8, -30]]))


def truth(**changes):
    rng = np.random.default_rng(0)
    given = {
        "names": TRACK.names,
        "reference": TRACK.names[0],
        "frames_per_second": 50.0,
        "poses": np.tile(np.eye(4), (6, 2, 1, 1)),
        "centroids": TRACK.centroids,
        "points": {
            name: centroid + rng.uniform(-15, 15, (100, 3))
            for name, centroid in zip(TRACK.names, TRACK.centroids, strict=True)
        },
        "cameras": dict(TRACK.cameras),
    }
    return TrackTruth(**{**given, **changes})


def test_a_track_of_fewer_structures_cameras_and_frames_is_of_the_sequence():
    require_truth_of(TRACK, truth())
    points = {**truth().points, "femur": np.zeros((1, 3))}
    more = truth(
        names=(*TRACK.names, "femur"), poses=np.tile(np.eye(4), (9, 3, 1, 1)), points=points,
        centroids=np.r_[TRACK.centroids, np.zeros((1, 3))],
    )  # fmt: skip
    one = {"the left one": TRACK.cameras["camera 1"]}
    require_truth_of(replace(TRACK, cameras=one, frames=TRACK.frames[2:]), more)
    # A file rounds the camera, and the CT that was tracked ends before the bones do.
    camera = TRACK.cameras["camera 2"]
    extrinsic = camera.extrinsic.copy()
    extrinsic[:3, 3] += 0.05
    rounded = replace(camera, intrinsics=camera.intrinsics.round(1), extrinsic=extrinsic)
    shifted = TRACK.centroids + np.array([[0, 0, 9.0], [0, 0, -9.0]])
    require_truth_of(replace(TRACK, cameras={"camera 2": rounded}, centroids=shifted), more)


def cameras(turn_deg=0.0, shift_mm=0.0, focal=1.0, pixels=0):
    """The truth's cameras, the second one changed."""
    camera = TRACK.cameras["camera 2"]
    extrinsic, intrinsics = camera.extrinsic.copy(), camera.intrinsics.copy()
    turn = Rotation.from_rotvec(np.radians(turn_deg) * np.array([0, 0, 1.0])).as_matrix()
    extrinsic[:3] = turn @ extrinsic[:3]
    extrinsic[:3, 3] += [shift_mm, 0, 0]
    intrinsics[0, 0] *= focal
    other = replace(camera, intrinsics=intrinsics, extrinsic=extrinsic, height=camera.height + pixels)
    return {**TRACK.cameras, "camera 2": other}


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"names": ("tibia", "femur")}, 'The truth has no structure "talus"'),
        ({"poses": np.tile(np.eye(4), (5, 2, 1, 1))}, "has 5 frames and the track's last frame is 5"),
        ({"frames_per_second": 60.0}, "has 50 frames per second and the truth 60"),
        ({"cameras": cameras(turn_deg=0.5)}, 'no camera with the calibration and the place of the track\'s "camera 2"'),
        ({"cameras": cameras(shift_mm=3)}, '"camera 2"'),
        ({"cameras": cameras(focal=1.01)}, '"camera 2"'),
        ({"cameras": cameras(pixels=2)}, '"camera 2"'),
        ({"points": {name: each + np.array([0, 60, 0]) for name, each in truth().points.items()}}, "lies elsewhere"),
    ],
)  # fmt: skip
def test_the_truth_of_another_sequence_is_refused(changes, says):
    with pytest.raises(InputError) as error:
        require_truth_of(TRACK, truth(**changes))
    assert says in str(error.value) and "truth of the same sequence" in str(error.value)
    assert_one_sentence(error)
