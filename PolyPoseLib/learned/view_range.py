"""Which cameras a regressor is trained for: directions around standard views, positions and distances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.xray import Xray
from PolyPoseLib.errors import InputError, unknown_name
from PolyPoseLib.geometry.standard_views import STANDARD_VIEWS, standard_view_rotation

ANGLE_DEG = 45.0
"""Orientations lie within this angle of a standard view, about any axis."""

OFFSET_MM = 100.0
"""The anchor's centre lies within this distance of the point at the nominal distance on the detector's axis."""

ZOOM = 0.2
"""The distance from the source varies by this share."""

DISTANCE_SHARE = 0.735
"""From the source to the anchor, where unknown, as a share of the distance to the detector (750 of 1020 mm)."""


@dataclass(frozen=True)
class ViewRange:
    """Cameras around standard views.

    Attributes
    ----------
    views : tuple[str, ...]
        Names, at least one.
    distance_mm : float
        Nominal distance from the source to the anchor's neighbourhood.
    angle_deg, offset_mm, zoom : float
        How far cameras stray from that.

    """

    views: tuple[str, ...]
    distance_mm: float
    angle_deg: float = ANGLE_DEG
    offset_mm: float = OFFSET_MM
    zoom: float = ZOOM

    def __post_init__(self) -> None:
        """Check names and sizes; raises InputError."""
        if not self.views:
            raise InputError("A range of views needs at least one standard view, such as AP.")
        for name in self.views:
            if name not in STANDARD_VIEWS:
                raise InputError(unknown_name("view", str(name), STANDARD_VIEWS))
        if not (
            np.isfinite(self.distance_mm)
            and 0 <= self.zoom < 1
            and 0 <= self.angle_deg <= 180
            and 0 <= self.offset_mm < self.nearest_mm
        ):
            raise InputError("A range of views needs a distance that exceeds its offsets.")

    @classmethod
    def of_xrays(cls, xrays: Sequence[Xray]) -> ViewRange:
        """The standard views that X-rays name, or all of them when one X-ray names none."""
        named = [xray.standard_view for xray in xrays]
        known = [name for name in named if name is not None]
        views = tuple(dict.fromkeys(known)) if len(known) == len(named) else tuple(STANDARD_VIEWS)
        shares = [DISTANCE_SHARE * xray.source_to_detector_mm for xray in xrays]
        return cls(views, float(np.mean(shares)))

    @property
    def nearest_mm(self) -> float:
        """Smallest distance from the source to the point from which offsets count."""
        return (1 - self.zoom) * self.distance_mm

    @property
    def centres(self) -> np.ndarray:
        """(C, 3, 3) rotations, world to camera, of the standard views."""
        return np.stack([_rotation(name) for name in self.views])

    def draw(self, rng: np.random.Generator, anchor_centre: np.ndarray) -> tuple[int, np.ndarray]:
        """A random camera: (index of its standard view, extrinsic (4, 4)); ``anchor_centre`` (3,) is LPS mm.

        The angle is uniform, its axis is, and the offset fills its ball evenly.
        """
        view = int(rng.integers(len(self.views)))
        axis, direction = rng.normal(size=(2, 3))
        angle = np.radians(rng.uniform(0, self.angle_deg))
        turn = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis)).as_matrix()
        offset = self.offset_mm * np.cbrt(rng.uniform()) * direction / np.linalg.norm(direction)
        distance = self.distance_mm * rng.uniform(1 - self.zoom, 1 + self.zoom)
        extrinsic = np.eye(4)
        extrinsic[:3, :3] = turn @ _rotation(self.views[view])
        extrinsic[:3, 3] = (0, 0, distance) - extrinsic[:3, :3] @ (anchor_centre + offset)
        return view, extrinsic


@cache
def _rotation(view: str) -> np.ndarray:
    """(3, 3) of a standard view, worked out once."""
    rotation = standard_view_rotation(view)
    rotation.flags.writeable = False
    return rotation
