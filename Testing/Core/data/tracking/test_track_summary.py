"""A track in a few numbers: ranges of motion do not depend on the rig's world, nor on where frames begin."""

import numpy as np
import pytest
from result_case import random_pose
from scipy.spatial.transform import Rotation
from track_case import frame_at, make_track

from PolyPoseLib.data.tracking.summary import summary_of
from PolyPoseLib.data.tracking.track import TrackedFrame


def flexion(world_of, angles):
    """A track whose talus turns about an axis through the tibia's world, which moves, too."""
    track = make_track(frames=3)
    frames = []
    for number, angle in enumerate(angles):
        turn = np.eye(4)
        turn[:3, :3] = Rotation.from_rotvec([np.radians(angle), 0, 0]).as_matrix()
        world = world_of(number)
        frames.append(TrackedFrame(**{**frame_at(number).__dict__, "poses": np.stack([world, turn @ world])}))
    return type(track)(
        **{**track.__dict__, "frames": tuple(frames), "centroids": np.array([[0.0, 0, 0], [0, 0, 10]])}
    )


@pytest.mark.parametrize("seed", range(5))
def test_ranges_are_relative_to_the_reference(seed):
    rng = np.random.default_rng(seed)
    angles = rng.uniform(-30, 50, 20)
    worlds = [random_pose(rng, 90, 400) for _ in angles]
    _, talus = summary_of(flexion(lambda number: worlds[number], angles))
    span = np.ptp(angles)
    assert talus.rotation_deg == pytest.approx(span, abs=1e-5)
    assert talus.translation_mm == pytest.approx(20 * np.sin(np.radians(span / 2)), abs=1e-6)
    still, _ = summary_of(flexion(lambda number: worlds[0], angles))
    assert still.rotation_deg == pytest.approx(0, abs=1e-4) and still.translation_mm == pytest.approx(
        0, abs=1e-9
    )


def test_lost_frames_are_counted_and_left_out():
    track = make_track(2, frames=6)
    tibia, talus = summary_of(track)
    assert (tibia.lost, tibia.doubtful, talus.lost, talus.doubtful) == (0, 0, 1, 1)
    assert np.isfinite([talus.rotation_deg, talus.translation_mm, talus.residual]).all()
    alone = type(track)(**{**track.__dict__, "frames": track.frames[:1]})
    assert np.isnan(summary_of(alone)[0].rotation_deg)


def test_thousands_of_frames_take_no_time():
    assert summary_of(make_track(0, frames=3000))[0].rotation_deg > 90
