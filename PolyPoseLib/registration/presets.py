"""The presets' resolution pyramids."""

from __future__ import annotations

from dataclasses import dataclass

from PolyPoseLib.registration.joint import JointPlan
from PolyPoseLib.registration.levels import Level


@dataclass(frozen=True)
class Preset:
    """Levels of the camera stage, plan of the joint stage, and the weights of the smooth warp."""

    camera_levels: tuple[Level, ...]
    joint: JointPlan
    weights: str = "rigid"
    weight_frame: str = "moving"


PRESETS: dict[str, Preset] = {
    "default": Preset(
        camera_levels=(Level(6.0, 40.0, 15), Level(3.0, 20.0, 15), Level(2.0, 14.0, 10)),
        joint=JointPlan(
            first_levels=(Level(6.0, 40.0, 20, 0.01),),
            restart_level=Level(4.0, 28.0, 8, 0.003),
            last_levels=(
                Level(3.0, 20.0, 20, 0.005),
                Level(2.0, 14.0, 20, 0.002),
                Level(1.2, 10.0, 15, 0.001),
            ),
        ),
    ),
    "fast": Preset(
        camera_levels=(Level(6.0, 40.0, 12), Level(3.0, 20.0, 12)),
        joint=JointPlan(
            first_levels=(Level(6.0, 40.0, 15, 0.01),),
            restart_level=None,
            last_levels=(Level(3.0, 20.0, 15, 0.005),),
        ),
    ),
    # Its levels are those of PolyPoseLib.registration.paper.
    "paper": Preset(camera_levels=(), joint=JointPlan((), None, ()), weights="mass", weight_frame="fixed"),
}
