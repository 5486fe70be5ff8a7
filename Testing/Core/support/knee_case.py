"""A coarse knee in motion before small cameras, for the tests of sequences: half a second to make."""

from functools import cache

from PolyPoseLib.simulation.joint_phantom import joint_phantom
from PolyPoseLib.simulation.sequence_options import SequenceOptions
from PolyPoseLib.simulation.sequences import rig_cameras, simulate_sequence

PIXELS = 32


@cache
def knee(seed=0, spacing_mm=5.0):
    return joint_phantom(seed, spacing_mm)


def knee_cameras(angles=(20.0, 90.0), pixels=PIXELS):
    return rig_cameras(knee().ct, knee().structures, angles, pixels)


def knee_sequence(
    seed=0, angles=(20.0, 90.0), poses=None, initial_error=(1.0, 1.0), pixels=PIXELS, **options
):
    settings = SequenceOptions(
        **{"frames": 5, "projector": "sum", "soft_mm": 5.0, "node_mm": 15.0, **options}
    )
    return simulate_sequence(
        knee().ct,
        knee().structures,
        knee_cameras(angles, pixels),
        poses,
        seed,
        settings,
        initial_error=initial_error,
    )
