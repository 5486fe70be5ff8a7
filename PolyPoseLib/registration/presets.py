"""The presets' resolution pyramids."""

from __future__ import annotations

from dataclasses import dataclass

from PolyPoseLib.data.options import USUAL_EPSILON, Options, Weighting
from PolyPoseLib.registration.bones.joint import JointStage
from PolyPoseLib.registration.fit.levels import Level
from PolyPoseLib.warp.polyrigid import WeightFrame
from PolyPoseLib.warp.weights import WeightForm

ANCHOR = Level(3.0, 20.0, 15)
"""At which cameras are refined by the anchor alone."""


@dataclass(frozen=True)
class Preset:
    """Resolution levels and the smooth warp.

    Attributes
    ----------
    camera_levels : tuple of Level
        Of stage A, coarse to fine.
    joint : tuple of JointStage
        Of stage B, coarse to fine.
    weights, weight_frame, rotation_reach_mm
        Of the smooth warp, see :class:`SoftTissue`.
    unfolded : bool
        Whether folds are relaxed out of the written transform.
    shrinks : bool
        Whether poses are shrunk by a prior whose size they suggest, where their uncertainties are computed.
    rendering_mm : float, optional
        Voxels, ray steps and, about, pixels of the renderings that are handed out; as fine as they can be when None.

    """

    camera_levels: tuple[Level, ...]
    joint: tuple[JointStage, ...]
    weights: WeightForm = "rigid"
    weight_frame: WeightFrame = "moving"
    rotation_reach_mm: float | None = 40.0
    unfolded: bool = True
    shrinks: bool = True
    rendering_mm: float | None = None


PRESETS: dict[str, Preset] = {
    "default": Preset(
        camera_levels=(Level(6.0, 40.0, 15), Level(3.0, 20.0, 15), Level(2.0, 14.0, 10)),
        joint=(
            JointStage(Level(6.0, 40.0, 20, 0.01), soft_motion=True, holds_cameras=True),
            JointStage(Level(6.0, 40.0, 20, 0.01), soft_motion=True, holds_cameras=True, anchor=ANCHOR),
            JointStage(
                Level(3.0, 20.0, 20, 0.005),
                soft_motion=True,
                anchor=ANCHOR,
                restart=Level(4.0, 28.0, 10, 0.001),
            ),
            JointStage(
                Level(2.0, 14.0, 20, 0.002), restart=Level(3.0, 20.0, 10, 0.001), without_objects=True
            ),
            JointStage(
                Level(1.2, 10.0, 15, 0.001),
                restart_inconsistent=(Level(4.0, 28.0, 10, 0.001), Level(2.0, 14.0, 10, 0.001)),
                without_objects=True,
            ),
        ),
    ),
    "fast": Preset(
        camera_levels=(Level(6.0, 40.0, 12), Level(3.0, 20.0, 12)),
        joint=(
            JointStage(Level(6.0, 40.0, 15, 0.01), holds_cameras=True),
            JointStage(Level(2.5, 17.0, 15, 0.002), restart=Level(4.0, 28.0, 10, 0.001)),
        ),
        rendering_mm=2.0,
    ),
    # Its levels are those of PolyPoseLib.baselines.published.method.
    "paper": Preset(
        camera_levels=(),
        joint=(),
        weights="mass",
        weight_frame="fixed",
        rotation_reach_mm=None,
        unfolded=False,
        shrinks=False,
    ),
}


def weighting_of(options: Options) -> Weighting:
    """The stated weights of the smooth warp, or the preset's."""
    preset = PRESETS[options.preset]
    return Weighting(
        options.weights or preset.weights,
        options.weight_frame or preset.weight_frame,
        options.epsilon or USUAL_EPSILON,
    )
