"""The presets' resolution pyramids."""

from __future__ import annotations

from dataclasses import dataclass

from PolyPoseLib.registration.levels import Level


@dataclass(frozen=True)
class Preset:
    """Levels of the camera stage, of the joint stage, and the weights of the smooth warp."""

    camera_levels: tuple[Level, ...]
    joint_levels: tuple[Level, ...]
    weights: str = "rigid"
    weight_frame: str = "moving"


PRESETS: dict[str, Preset] = {
    "default": Preset(
        camera_levels=(Level(6.0, 40.0, 15), Level(3.0, 20.0, 15), Level(2.0, 14.0, 10)),
        joint_levels=(Level(6.0, 40.0, 20), Level(3.0, 20.0, 20), Level(2.0, 14.0, 20), Level(1.2, 10.0, 15)),
    ),
    "fast": Preset(
        camera_levels=(Level(6.0, 40.0, 12), Level(3.0, 20.0, 12)),
        joint_levels=(Level(6.0, 40.0, 15), Level(3.0, 20.0, 15)),
    ),
    # Its levels are those of PolyPoseLib.registration.paper.
    "paper": Preset(camera_levels=(), joint_levels=(), weights="mass", weight_frame="fixed"),
}
