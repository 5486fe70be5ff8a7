"""How to register: everything that a study's "options" may hold."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from PolyPoseLib.data.paper_options import PaperOptions
from PolyPoseLib.errors import InputError, unknown_name

CHOICES: dict[str, tuple[str, ...]] = {
    "preset": ("default", "fast", "paper"),
    "device": ("auto", "cpu", "cuda"),
    "weights": ("mass", "epsilon", "rigid"),
    "weight_frame": ("moving", "fixed"),
    "optimizer": ("adam", "lm"),
    "kernel": ("auto", "torch", "numba"),
}
"""Allowed values of the options that name something."""

RANGES: dict[str, tuple[float, float]] = {
    "threads": (1, 1024),
    "seed": (0, 2**63 - 1),
    "epsilon": (1e-6, 1e6),
    "rotation_reach_mm": (0.1, 1e6),
    "transform_spacing_mm": (0.1, 4),
}
"""Least and largest values of the options that are numbers; beyond them sizes and weights leave what computers hold."""

USUAL_EPSILON = 0.1
"""Of the weights "epsilon" where none is given, 1/mm^2 in the patient's millimetres."""

_LONGEST_SHOWN = 40


@dataclass(frozen=True)
class Weighting:
    """How the motions of structures make the field between them.

    Attributes
    ----------
    form
        Of a structure's weight by its distance, of :func:`PolyPoseLib.warp.weights.weights`.
    frame
        Where distances are measured: "fixed", at the point itself, or "moving", where the structure's pose takes it.
    epsilon
        1/mm^2, of the form "epsilon" only.

    """

    form: Literal["mass", "epsilon", "rigid"]
    frame: Literal["moving", "fixed"]
    epsilon: float = USUAL_EPSILON


@dataclass(frozen=True)
class Options:
    """Settings of one registration; None leaves a setting to the preset.

    Parameters
    ----------
    preset : {"default", "fast", "paper"}
        "fast" is coarser, for a first impression; "paper" has the published method's settings.
    device : {"auto", "cpu", "cuda"}
        "auto" takes a CUDA device when there is one.
    threads : int, optional
        CPU threads, at most 1024; None for all.
    seed : int
        Of every random choice; the same seed gives the same result on the same device.
    preview : str, optional
        File into which a coarse displacement field is written during the run.
    weights, weight_frame : str, optional
        Form of the weight field ("mass", "epsilon", "rigid"), and the frame in which distances are measured
        ("moving", "fixed").
    epsilon : float, optional
        1/mm^2, of the weights "epsilon" only; None for 0.1.
    rotation_reach_mm : float, optional
        Distance from a bone at which tissue takes half of its rotation; a very large one lets bones rotate all tissue,
        as the preset "paper" does.
    optimizer : {"adam", "lm"}, optional
        Of the joint stage.
    kernel : {"auto", "torch", "numba"}
        "numba" is the fused one, "torch" the plain one; "auto" takes what is installed.
    refine_cameras : bool
        Whether cameras that are not known are refined on the anchor.
    uncertainty : bool
        Whether confidence intervals are computed.
    transform_spacing_mm : float, optional
        Grid of the displacement field, from 0.1 to 4 mm.
    camera_model : str, optional
        File of a trained camera regressor, in the study's folder, for X-rays without a camera.
    composed : bool
        Whether the warped CT is composed of rigid bones over warped soft tissue, instead of warped smoothly throughout;
        bones that touch in the CT then part without being stretched.
    paper : PaperOptions, optional
        Or an object of its options: how faithful the preset "paper" is to the published program.

    Raises
    ------
    InputError
        A value out of its range; the sentence names the option.

    """

    preset: str = "default"
    device: str = "auto"
    threads: int | None = None
    seed: int = 0
    preview: str | None = None
    weights: Literal["mass", "epsilon", "rigid"] | None = None
    weight_frame: Literal["moving", "fixed"] | None = None
    epsilon: float | None = None
    rotation_reach_mm: float | None = None
    optimizer: str | None = None
    kernel: str = "auto"
    refine_cameras: bool = True
    uncertainty: bool = True
    transform_spacing_mm: float | None = None
    camera_model: str | None = None
    composed: bool = False
    paper: PaperOptions | None = None

    def __post_init__(self) -> None:
        """Check every value; raises InputError naming the option."""
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if value is None and field.default is None:
                continue
            if field.name != "paper":
                _check(field.name, str(field.type), value)
        if self.paper is not None:
            object.__setattr__(self, "paper", PaperOptions.from_dict(self.paper))
        if self.rotation_reach_mm is not None and self.preset == "paper":
            raise InputError(
                'Option "rotation_reach_mm" does not go with the preset "paper", whose bones turn all tissue: leave it '
                "out, or choose another preset."
            )
        if self.paper is not None and self.preset != "paper":
            raise InputError(
                f'Option "paper" does not go with the preset "{self.preset}": leave it out, or choose the preset '
                '"paper".'
            )

    @classmethod
    def from_dict(cls, options: Mapping[str, Any] | Options | None) -> Options:
        """Options from a study's JSON object; raises InputError for unknown names and wrong values."""
        if options is None:
            return cls()
        if isinstance(options, Options):
            return options
        if not isinstance(options, Mapping):
            raise InputError(
                f'"options" must be an object such as {{"preset": "fast"}}, not {type(options).__name__}.'
            )
        known = [field.name for field in dataclasses.fields(cls)]
        for name in options:
            if name not in known:
                raise InputError(unknown_name("option", str(name), known))
        return cls(**options)

    def to_dict(self) -> dict[str, Any]:
        """The options that differ from their defaults, ready for JSON."""
        found = {
            field.name: getattr(self, field.name)
            for field in dataclasses.fields(self)
            if getattr(self, field.name) != field.default
        }
        return found if self.paper is None else found | {"paper": self.paper.to_dict()}

    def updated(self, **changes: Any) -> Options:
        """A copy in which every change that is not None replaces the value; raises InputError as
        from_dict.
        """
        return Options.from_dict(
            {
                **dataclasses.asdict(self),
                **{name: value for name, value in changes.items() if value is not None},
            }
        )


def _check(name: str, declared: str, value: Any) -> None:
    """Check one option's type and range."""
    if name in CHOICES:
        if value not in CHOICES[name]:
            allowed = ", ".join(f'"{choice}"' for choice in CHOICES[name])
            raise InputError(f'Option "{name}" is {_shown(value)}: give one of {allowed}.')
    elif declared.startswith("bool"):
        if not isinstance(value, bool):
            raise InputError(f'Option "{name}" is {_shown(value)}: give true or false.')
    elif declared.startswith("int"):
        _check_range(name, value, (int,), "whole number")
    elif declared.startswith("float"):
        _check_range(name, value, (int, float), "number")
    elif not isinstance(value, str) or not value:
        raise InputError(f'Option "{name}" is {_shown(value)}: give a text that is not empty.')


def _check_range(name: str, value: Any, types: tuple[type, ...], what: str) -> None:
    """Check the type and size of a number; integers of any length are compared as they are, NaN is in no range."""
    least, largest = RANGES[name]
    if isinstance(value, bool) or not isinstance(value, types) or not least <= value <= largest:
        raise InputError(f'Option "{name}" is {_shown(value)}: give a {what} from {least:g} to {largest:g}.')


def _shown(value: Any) -> str:
    """A value as Python writes it, cut where it is long."""
    try:
        text = repr(value)
    except ValueError:  # Python writes no integers of thousands of digits
        return "a number of thousands of digits"
    return text if len(text) <= _LONGEST_SHOWN else f"{text[:_LONGEST_SHOWN]}..."
