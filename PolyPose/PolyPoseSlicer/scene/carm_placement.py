"""A C-arm as it is set up: angles, distances and the table's position; and the camera that follows from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from PolyPoseLib.geometry.carm import carm_angles, carm_extrinsic

_TABLE_TO_LPS = np.diag([1.0, -1.0, 1.0])
"""Left, front and head in LPS."""


@dataclass(frozen=True)
class Placement:
    """Angles in degrees, distances in mm.

    table_mm: how far the patient's reference point lies to the left, to the front and to the head of the
        isocentre.
    """

    primary_deg: float = 0.0
    secondary_deg: float = 0.0
    rotation_deg: float = 0.0
    source_to_isocenter_mm: float = 700.0
    source_to_detector_mm: float = 1000.0
    table_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def extrinsic(self, reference: np.ndarray) -> np.ndarray:
        """World LPS mm to camera, (4, 4); reference: the patient's reference point (3,), LPS mm.

        Raises InputError for a number out of range.
        """
        isocenter = np.asarray(reference) - _TABLE_TO_LPS @ np.array(self.table_mm)
        return carm_extrinsic(
            self.primary_deg,
            self.secondary_deg,
            self.source_to_isocenter_mm,
            isocenter,
            "HFS",
            detector_rotation_deg=self.rotation_deg,
        )

    @classmethod
    def of(cls, extrinsic: np.ndarray, source_to_detector_mm: float, reference: np.ndarray) -> Placement:
        """The placement of a camera; its isocentre is the beam axis' nearest point to the reference."""
        extrinsic, reference = np.asarray(extrinsic), np.asarray(reference)
        angles = carm_angles(extrinsic)
        axis = extrinsic[2, :3]
        source = -extrinsic[:3, :3].T @ extrinsic[:3, 3]
        distance = float(axis @ (reference - source))
        left, front, head = (_TABLE_TO_LPS @ (reference - source - distance * axis)).tolist()
        return cls(
            angles.primary_deg,
            angles.secondary_deg,
            angles.detector_rotation_deg,
            distance,
            float(source_to_detector_mm),
            (left, front, head),
        )


def intrinsics_at(
    intrinsics: np.ndarray, known_distance_mm: float, source_to_detector_mm: float
) -> np.ndarray:
    """Intrinsics (3, 3) of the same detector at another distance from the source."""
    scaled = np.array(intrinsics, dtype=np.float64)
    scaled[:2, :2] *= source_to_detector_mm / known_distance_mm
    return scaled
