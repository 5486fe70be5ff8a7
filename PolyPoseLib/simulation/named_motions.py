"""Motions with a name, instead of postures drawn at random: breathing, walking, bending, opening the mouth.

All of them are laws of their own, made from the labels alone: nothing here knows the registration's model.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.data.label_names import structure_of
from PolyPoseLib.errors import InputError
from PolyPoseLib.simulation.motion import JointMotion, structure_points
from PolyPoseLib.simulation.simulation_limits import AMPLITUDES, require_motion

if TYPE_CHECKING:
    from PolyPoseLib.data.structures import Structures
    from PolyPoseLib.simulation.soft_motion import SoftMotion


_BETWEEN_WORDS = re.compile(r"[\s_-]+")


@dataclass(frozen=True)
class Anatomy:
    """What a law of motion may look at.

    Attributes
    ----------
    structures : Structures
        Labels on the CT's grid.
    affine : (4, 4) array
        Index (i, j, k) to LPS mm of that grid.
    anchor : str
        The structure that stays.
    labels : (k, j, i) array of integers, optional
        The full segmentation on that grid.
    names : Mapping[int, str]
        Of its labels.

    """

    structures: Structures
    affine: np.ndarray
    anchor: str
    labels: np.ndarray | None = None
    names: Mapping[int, str] = field(default_factory=dict)

    @cached_property
    def points(self) -> dict[str, np.ndarray]:
        """Voxel centres (N, 3) in LPS mm of every structure."""
        return structure_points(self.structures, self.affine)

    @property
    def spacing(self) -> np.ndarray:
        """Voxel size (3,) along (k, j, i) in mm."""
        return np.linalg.norm(self.affine[:3, :3], axis=0)[::-1]

    def find(self, words: Iterable[str]) -> list[str]:
        """Structures whose names hold one of the words."""
        words = tuple(words)
        return [name for name in self.structures.names if any(word in name.lower() for word in words)]

    def named(self, bone: str) -> list[str]:
        """Structures that are a bone by their name, such as femur_left (`structure_of`)."""
        return [name for name in self.structures.names if structure_of(name) == bone]

    def organ(self, *words: str) -> np.ndarray:
        """Where labels are (k, j, i) whose names hold all of the words as words of their own."""
        if self.labels is None:
            return np.zeros(self.structures.labels.shape, bool)
        chosen = [
            n for n, name in self.names.items() if set(words) <= set(_BETWEEN_WORDS.split(name.lower()))
        ]
        return np.isin(self.labels, chosen)


@dataclass(frozen=True)
class Posture:
    """Where a motion takes the bones, and what soft organs do by themselves.

    Attributes
    ----------
    joints : dict[str, JointMotion]
        {structure: its motion}; a structure that is missing stays.
    soft : SoftMotion, optional
        Displacements of soft organs.

    """

    joints: dict[str, JointMotion]
    soft: SoftMotion | None = None


Law = Callable[[Anatomy, float, np.random.Generator], Posture]
"""Anatomy, amplitude (mm for breathing, degrees for the others) and generator to posture."""


def named_posture(
    motion: str, amplitude: float | None, anatomy: Anatomy, rng: np.random.Generator
) -> Posture:
    """The posture of a named motion.

    Parameters
    ----------
    motion : {"breathing", "gait", "flexion", "jaw"}
        Which.
    amplitude : float or None
        mm or degrees, see AMPLITUDES; None for the usual one. 0 is rest.
    anatomy : Anatomy
        What moves.
    rng : np.random.Generator
        Draws what differs from person to person (sides, shares, directions), never the amplitude.

    Raises
    ------
    InputError
        An amplitude beyond its limits, or an anatomy that lacks what the motion needs.

    """
    from PolyPoseLib.simulation.breathing import breathing
    from PolyPoseLib.simulation.limb_motions import flexion, gait, jaw

    require_motion(motion, amplitude)
    laws: dict[str, Law] = {"breathing": breathing, "gait": gait, "flexion": flexion, "jaw": jaw}
    if motion not in laws:
        raise InputError(f'"{motion}" is no named motion: give one of {", ".join(laws)}.')
    return laws[motion](anatomy, AMPLITUDES[motion].usual if amplitude is None else amplitude, rng)


def lacking(motion: str, what: str, anatomy: Anatomy) -> InputError:
    """The refusal of an anatomy that lacks what a motion needs."""
    names = ", ".join(anatomy.structures.names)
    return InputError(f'The motion "{motion}" needs {what}: the structures are {names}.')
