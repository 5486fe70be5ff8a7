"""The truth of a simulated case: what a result is scored against."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera


@dataclass(frozen=True)
class Truth:
    """What really happened between the CT and the X-rays.

    Parameters
    ----------
    names : tuple of str
        Structures; label n belongs to names[n - 1].
    anchor : str
        The structure that does not move.
    fixed_to_moving : {str: (4, 4) array}
        True motion of every structure, LPS mm.
    cameras : list of Camera
        The true ones, in the order of the X-rays.
    moving_labels, fixed_labels : Volume
        Structure numbers in the CT's posture and in the X-rays', on the CT's grid; it is widened where a bone moved
        out of it.
    fixed_ct : Volume
        HU in the X-rays' posture.
    field : DisplacementField
        From fixed to moving points, soft tissue included.
    moving_organs, fixed_organs : Volume or None
        Labels of what is neither structure nor bone.
    organ_names : {int: str}
        Names of those labels.
    statistics : dict
        Numbers of the simulation.
    seed : int
        Of the simulation.

    """

    names: tuple[str, ...]
    anchor: str
    fixed_to_moving: dict[str, np.ndarray]
    cameras: list[Camera]
    moving_labels: Volume
    fixed_labels: Volume
    fixed_ct: Volume
    field: DisplacementField
    moving_organs: Volume | None
    fixed_organs: Volume | None
    organ_names: dict[int, str]
    statistics: dict[str, Any]
    seed: int

    def require_matching_volumes(self, where: str) -> None:
        """Raise InputError, saying where, unless the volumes share a grid and show every structure."""
        for name in ("fixed_ct", "fixed_labels", "moving_organs", "fixed_organs"):
            volume = getattr(self, name)
            if volume is not None and not volume.same_grid(self.moving_labels):
                raise InputError(
                    f'{where}: "{name}" and "moving_labels" differ in grid; simulate the case again.'
                )
        shown = np.unique(self.moving_labels.voxels)
        for number, name in enumerate(self.names, start=1):
            if number not in shown:
                raise InputError(
                    f'{where}: "moving_labels" shows nothing of "{name}"; simulate the case again.'
                )
