"""A study: one CT, its structures, and the X-rays to which it is registered."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from PolyPoseLib.data.options import Options
from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.rigid import rigid_inverse

if TYPE_CHECKING:
    from PolyPoseLib.data.xray import Xray

RIG_TOLERANCE = (1.0, 2.0)
"""Degrees and mm by which two known cameras may differ from the relative pose that their rig tells, and by which two
places in a rig must differ at least, in one of them."""


@dataclass(frozen=True)
class Study:
    """Everything that a registration needs; a study that exists is valid.

    ct: Hounsfield units.
    structures: on the CT's grid.
    anchor: the structure that defines the cameras; it does not move.
    xrays: at least one.
    options: as in the file; Options.from_dict(study.options) gives them with their defaults.
    warnings: what was odd but not wrong; each X-ray has its own besides.
    source_segmentation: the whole label map on the CT's grid (warped with the CT), or None when the
    segmentation
    has overlapping layers, which one label map cannot hold.
    """

    ct: Volume
    structures: Structures
    anchor: str
    xrays: tuple[Xray, ...]
    options: Mapping[str, Any] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    source_segmentation: Volume | None = None

    def __post_init__(self) -> None:
        """Check that the parts fit together; raises InputError."""
        object.__setattr__(self, "xrays", tuple(self.xrays))
        object.__setattr__(self, "warnings", tuple(self.warnings))
        if not self.xrays:
            raise InputError(
                "A study needs at least one X-ray: add one, or better two from different directions."
            )
        if self.structures.labels.shape != self.ct.shape:
            raise InputError(
                f"The structures have {self.structures.labels.shape} voxels but the CT has {self.ct.shape}: "
                "resample the labels onto the CT's grid."
            )
        self.structures.index(self.anchor)
        _require_whole_rigs(self.xrays)
        if not np.isfinite(self.ct.voxels).all():
            raise InputError("The CT holds NaN or infinite voxels: replace them by -1000, the value of air.")
        if self.source_segmentation is not None and self.source_segmentation.shape != self.ct.shape:
            raise InputError(
                "The source segmentation is on another grid than the CT: resample it onto the CT's."
            )
        options = self.options
        Options.from_dict(options)
        object.__setattr__(
            self, "options", options.to_dict() if isinstance(options, Options) else dict(options)
        )

    @classmethod
    def load(cls, path: str | Path, allow_outside: bool = False) -> Study:
        """Read a study file: :func:`PolyPoseLib.io.studies.load_study`, which is imported late for this name's sake."""
        from PolyPoseLib.io.studies import load_study

        return load_study(path, allow_outside)


def _require_whole_rigs(xrays: tuple[Xray, ...]) -> None:
    """A rig has two X-rays at least, one way of telling their places, and known cameras that fit these."""
    rigs: dict[str, list[Xray]] = {}
    for xray in xrays:
        if xray.rig is not None:
            rigs.setdefault(xray.rig.name, []).append(xray)
    for name, members in rigs.items():
        if len(members) == 1:
            raise InputError(
                f'The rig "{name}" has one X-ray only: name it in the "rig" of another, or remove it.'
            )
        first = members[0]
        other = next((each for each in members if each.rig.frame != first.rig.frame), None)
        if other is not None:
            raise InputError(
                f'The rig "{name}" mixes two worlds: the places of "{first.name}" and "{other.name}" are told by a '
                "calibration's own world and by the CT's; tell both by calibrations, or both by extrinsics."
            )
        _require_places_apart(members)
        known = [each for each in members if each.camera == "known"]
        for each in known[1:]:
            _require_same_relative_pose(known[0], each)


def _require_places_apart(members: list[Xray]) -> None:
    """Raise InputError when two cameras of a rig, whose poses are in one world, stand at the same place.

    Two such views tell no depth, and the calibration of one camera was likely given to both.
    """
    for number, second in enumerate(members):
        for first in members[:number]:
            if _is_within(RIG_TOLERANCE, _difference(first.rig.extrinsic, second.rig.extrinsic)):
                raise InputError(
                    f'"{first.name}" and "{second.name}" have the same place in the rig "{first.rig.name}": give each '
                    "the calibration (or extrinsic) of its own camera."
                )


def _require_same_relative_pose(first: Xray, second: Xray) -> None:
    """Raise InputError when two known cameras stand otherwise to each other than their rig says."""
    known = second.extrinsic @ rigid_inverse(first.extrinsic)
    calibrated = second.rig.extrinsic @ rigid_inverse(first.rig.extrinsic)
    turn, step = _difference(known, calibrated)
    if not _is_within(RIG_TOLERANCE, (turn, step)):
        raise InputError(
            f'The known cameras of "{first.name}" and "{second.name}" contradict their rig "{first.rig.name}" by '
            f'{turn:.1f} degrees and {step:.1f} mm: correct their extrinsics, or remove "rig" or "camera": "known".'
        )


def _difference(first: np.ndarray, second: np.ndarray) -> tuple[float, float]:
    """Degrees between the axes of two poses (4, 4), world to camera, and mm between their sources."""
    chord = np.linalg.norm(first[:3, :3] - second[:3, :3]) / np.sqrt(8)  # sin of half the angle
    turn = 2 * np.degrees(np.arcsin(min(chord, 1.0)))
    # Sources, as the world sees them: unlike translations, they do not part as the axes turn.
    return float(turn), float(np.linalg.norm(rigid_inverse(first)[:3, 3] - rigid_inverse(second)[:3, 3]))


def _is_within(tolerance: tuple[float, float], difference: tuple[float, float]) -> bool:
    """Whether neither the degrees nor the mm of a difference are beyond the tolerance."""
    return difference[0] <= tolerance[0] and difference[1] <= tolerance[1]
