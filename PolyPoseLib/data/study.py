"""A study: one CT, its structures, and the X-rays to which it is registered."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from PolyPoseLib.data.hounsfield import impossible_highest_value, impossible_size
from PolyPoseLib.data.options import Options
from PolyPoseLib.data.segmentation import checked_source
from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.view_names import view_name
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.rigid import require_rigid, rigid_inverse

if TYPE_CHECKING:
    from PolyPoseLib.data.xray import RigPose, Xray

RIG_TOLERANCE = (1.0, 2.0)
"""Degrees and mm by which the relative pose of two known cameras may differ from their rig's, and by one of which two
places in a rig must differ at least."""


@dataclass(frozen=True)
class Study:
    """Everything that a registration needs; a study that exists is valid.

    Parameters
    ----------
    ct : Volume
        Hounsfield units.
    structures : Structures
        On the CT's grid.
    anchor : str
        The structure that defines the cameras; it does not move.
    xrays : sequence of Xray
        At least one.
    options : mapping or Options
        As in the study's file; ``Options.from_dict(study.options)`` gives them with their defaults.
    warnings : sequence of str
        What was odd but not wrong; each X-ray has its own besides.
    source_segmentation : Volume or None
        The whole label map on the CT's grid, which is warped with the CT; None when the segmentation has overlapping
        layers, which one label map cannot hold.
    initial_poses : dict of str to (4, 4) array
        Where structures are started, fixed to moving, LPS mm, as :class:`PolyPoseLib.data.result.StructureResult` has
        them; they are fitted from there without restarts. The others start where the CT has them.
    label_names : mapping of int to str
        Names of the source segmentation's labels as far as they are known, for messages.

    Raises
    ------
    InputError
        The parts do not fit together; the sentence names them and the fix.

    """

    ct: Volume
    structures: Structures
    anchor: str
    xrays: tuple[Xray, ...]
    options: Mapping[str, Any] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    source_segmentation: Volume | None = None
    initial_poses: Mapping[str, np.ndarray] = field(default_factory=dict)
    label_names: Mapping[int, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check that the parts fit together; raises InputError."""
        named = tuple(
            each if each.name else replace(each, name=view_name(number))
            for number, each in enumerate(self.xrays)
        )
        object.__setattr__(self, "xrays", named)
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
        if (fault := impossible_size(self.ct) or impossible_highest_value(self.ct)) is not None:
            raise InputError(f"The study's CT: {fault}")
        object.__setattr__(self, "source_segmentation", checked_source(self.source_segmentation, self.ct))
        options = self.options
        preset = Options.from_dict(options).preset
        object.__setattr__(
            self, "options", options.to_dict() if isinstance(options, Options) else dict(options)
        )
        object.__setattr__(self, "initial_poses", self._checked_poses(preset))

    def _checked_poses(self, preset: str) -> dict[str, np.ndarray]:
        """The initial poses as rigid motions of known structures; raises InputError."""
        if self.initial_poses and preset == "paper":
            raise InputError(
                '"initial_poses" do not go with the preset "paper", which starts where the CT has the bones: leave '
                "them out, or choose another preset."
            )
        poses = {}
        for name, pose in self.initial_poses.items():
            self.structures.index(name)
            if name == self.anchor:
                raise InputError(
                    f'"initial_poses" moves the anchor "{name}", which does not move: leave it out.'
                )
            poses[name] = require_rigid(pose, f'"initial_poses"."{name}"')
        return poses

    @classmethod
    def load(cls, path: str | Path, allow_outside: bool = False) -> Study:
        """Read a study file: :func:`PolyPoseLib.io.studies.load_study`, which is imported late for this name's sake."""
        from PolyPoseLib.io.studies import load_study

        return load_study(path, allow_outside)


Member = tuple["Xray", "RigPose"]
"""An X-ray with its place in its rig."""


def _require_whole_rigs(xrays: tuple[Xray, ...]) -> None:
    """Every rig needs two X-rays at least, places in one coordinate frame, and known cameras that agree with them."""
    rigs: dict[str, list[Member]] = {}
    for xray in xrays:
        if xray.rig is not None:
            rigs.setdefault(xray.rig.name, []).append((xray, xray.rig))
    for name, members in rigs.items():
        if len(members) == 1:
            raise InputError(
                f'The rig "{name}" has one X-ray only: name it in the "rig" of another, or remove it.'
            )
        first, first_place = members[0]
        other = next((each for each, place in members if place.frame != first_place.frame), None)
        if other is not None:
            raise InputError(
                f'The rig "{name}" mixes two coordinate frames: one of "{first.name}" and "{other.name}" is placed in '
                "its calibration's own world, the other in the CT's; give both calibrations, or both extrinsics."
            )
        _require_places_apart(members)
        known = [(xray, place) for xray, place in members if xray.camera == "known"]
        for each in known[1:]:
            _require_same_relative_pose(known[0], each)


def _require_places_apart(members: list[Member]) -> None:
    """Raise InputError when two cameras of a rig, whose poses are in one world, stand at the same place.

    Two such views show no depth, and the calibration of one camera was likely given to both.
    """
    for number, (second, second_place) in enumerate(members):
        for first, first_place in members[:number]:
            if _is_within(RIG_TOLERANCE, _difference(first_place.extrinsic, second_place.extrinsic)):
                raise InputError(
                    f'"{first.name}" and "{second.name}" have the same place in the rig "{first_place.name}": give '
                    "each the calibration (or extrinsic) of its own camera."
                )


def _require_same_relative_pose(first: Member, second: Member) -> None:
    """Raise InputError when the relative pose of two known cameras is not that of their places in the rig."""
    known = _relative(_known_extrinsic(first[0]), _known_extrinsic(second[0]))
    turn, step = _difference(known, _relative(first[1].extrinsic, second[1].extrinsic))
    if not _is_within(RIG_TOLERANCE, (turn, step)):
        raise InputError(
            f'The known cameras of "{first[0].name}" and "{second[0].name}" contradict their rig "{first[1].name}" by '
            f'{turn:.1f} degrees and {step:.1f} mm: correct their extrinsics, or remove "rig" or "camera": "known".'
        )


def _known_extrinsic(xray: Xray) -> np.ndarray:
    """(4, 4) of an X-ray whose camera is known, which Xray requires to have one."""
    assert xray.extrinsic is not None
    return xray.extrinsic


def _relative(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """(4, 4) from the first camera's axes to the second's."""
    return second @ rigid_inverse(first)


def _difference(first: np.ndarray, second: np.ndarray) -> tuple[float, float]:
    """Degrees between the axes of two poses (4, 4), world to camera, and mm between their sources."""
    chord = np.linalg.norm(first[:3, :3] - second[:3, :3]) / np.sqrt(8)  # sin of half the angle
    turn = 2 * np.degrees(np.arcsin(min(chord, 1.0)))
    # Sources, as the world sees them: unlike translations, they do not part as the axes turn.
    return float(turn), float(np.linalg.norm(rigid_inverse(first)[:3, 3] - rigid_inverse(second)[:3, 3]))


def _is_within(tolerance: tuple[float, float], difference: tuple[float, float]) -> bool:
    """Whether neither the degrees nor the mm of a difference are beyond the tolerance."""
    return difference[0] <= tolerance[0] and difference[1] <= tolerance[1]
