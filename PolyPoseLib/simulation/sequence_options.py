"""How a sequence is simulated."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from PolyPoseLib.errors import InputError, unknown_name
from PolyPoseLib.geometry.rigid import require_rigid
from PolyPoseLib.simulation.motion_laws import MOTIONS
from PolyPoseLib.simulation.moving_degradations import require_moving_degradations
from PolyPoseLib.simulation.simulation_limits import require_in_range
from PolyPoseLib.simulation.xray_physics import XrayPhysics

MOST_FRAMES = 100_000

LIMITS: dict[str, tuple[float, float]] = {
    "frames": (1, MOST_FRAMES),
    "frames_per_second": (0.01, 10_000.0),
    "sway_mm": (0.0, 100.0),
    "sway_deg": (0.0, 90.0),
    "shutter": (0.0, 1.0),
    "soft_mm": (0.3, 20.0),
    "node_mm": (1.0, 100.0),
    "exposures": (1, 100),
}
"""Least and largest values."""


@dataclass(frozen=True)
class SequenceOptions:
    """Settings of a simulated sequence; lengths in mm.

    Parameters
    ----------
    frames : int
        How many.
    frames_per_second : float
        Of all cameras.
    motion : str
        "flexion", "gait", "breathing", "jaw", "drawn" or "still", see :mod:`PolyPoseLib.simulation.motion_laws`.
    amplitude : float, optional
        Degrees of flexion, mm of breathing; the usual ones by default.
    period_s : float, optional
        Of a cycle; a flexion takes the whole sequence there and back by default.
    sway_mm, sway_deg : float
        How far the whole patient moves slowly besides, at most about so much along and about every axis; 0 keeps the
        reference still.
    world : (4, 4) array
        From the rig's world to the CT's before anything moves; poses map the one to the other.
    physics : XrayPhysics
        What the detector makes of clean line integrals.
    shutter : float
        Share of the time between frames in which a frame is exposed; bones that move meanwhile are blurred.
    exposures : int
        Postures that a blurred frame is averaged over.
    first : tuple of int
        For every camera, images before the sequence's first frame: cameras that started earlier.
    skew_s : tuple of float
        For every camera, seconds by which its images are later than the sequence says.
    degradations : tuple of str
        Of :data:`PolyPoseLib.simulation.moving_degradations.NAMES`.
    blank : mapping of int to tuple of int
        {camera: its images without exposure}.
    repeated : mapping of int to tuple of int
        {camera: images in whose place the one before was stored again}.
    soft_mm, node_mm : float
        Voxels of soft tissue, and nodes of its displacement.
    projector : str
        "auto", "rtk" or "sum".

    Raises
    ------
    InputError
        A value out of its range; the sentence names it.

    """

    frames: int = 100
    frames_per_second: float = 30.0
    motion: str = "flexion"
    amplitude: float | None = None
    period_s: float | None = None
    sway_mm: float = 2.0
    sway_deg: float = 1.0
    world: np.ndarray = field(default_factory=lambda: np.eye(4))
    physics: XrayPhysics = field(default_factory=XrayPhysics)
    shutter: float = 0.0
    exposures: int = 5
    first: tuple[int, ...] = ()
    skew_s: tuple[float, ...] = ()
    degradations: tuple[str, ...] = ()
    blank: Mapping[int, tuple[int, ...]] = field(default_factory=dict)
    repeated: Mapping[int, tuple[int, ...]] = field(default_factory=dict)
    soft_mm: float = 2.0
    node_mm: float = 8.0
    projector: str = "auto"

    def __post_init__(self) -> None:
        """Check the ranges; raises InputError."""
        for name, limits in LIMITS.items():
            kind = "whole number" if isinstance(limits[0], int) else "number"
            require_in_range(getattr(self, name), limits, f"The simulation's {name}", kind)
        if self.motion not in MOTIONS:
            raise InputError(unknown_name("motion", self.motion, MOTIONS))
        if self.period_s is not None:
            require_in_range(self.period_s, (0.01, 1e6), "The simulation's period_s")
        require_moving_degradations(self.degradations)
        if any(first < 0 for first in self.first):
            raise InputError("The simulation's first must be numbers of images, 0 or more.")
        object.__setattr__(self, "world", require_rigid(self.world, "The simulation's world"))

    @property
    def duration_s(self) -> float:
        """Seconds of the whole sequence."""
        return self.frames / self.frames_per_second

    def first_of(self, camera: int) -> int:
        """Images of a camera before the sequence's first frame."""
        return self.first[camera] if camera < len(self.first) else 0

    def seconds(self, camera: int, image: int) -> float:
        """When an image of a camera was really taken, since the sequence's first frame."""
        late = self.skew_s[camera] if camera < len(self.skew_s) else 0.0
        return (image - self.first_of(camera)) / self.frames_per_second + late
