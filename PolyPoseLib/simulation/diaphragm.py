"""The diaphragm's descent, and what liver and heart do with it.

Where the lungs end below, each half of the diaphragm descends: most at its dome, not at all at its lowest border, where
it is attached. Below it the liver shifts along, column by column, which keeps its volume. The heart's base moves less
than its lower face. The left main coronary artery moves by about 0.6 of the diaphragm in the mean, from 0.17 to 0.93
between people (P. Danias and others, "Relationship between motion of coronary arteries and diaphragm during free
breathing", American Journal of Roentgenology 172, 1999); the heart's shares are chosen around it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt, gaussian_filter

from PolyPoseLib.simulation.motion import apply
from PolyPoseLib.simulation.named_motions import Anatomy
from PolyPoseLib.simulation.nearest import nearest_known
from PolyPoseLib.simulation.soft_motion import SoftMotion

HEART_SHARE = (0.7, 0.5)
"""Descent of the heart over that of the diaphragm, at its lower face and at its base: a choice, not a measurement."""

_CELL_MM = 2.5
"""Size of the columns in which the diaphragm is sought, and about the distance of the voxels that are looked at."""

_FULL_DESCENT = 1 / 1.5
"""Share of a dome's height from which on it descends by the whole amplitude."""

_DOME_BAND = (5.0, 95.0)
"""Percentiles of the heights of a lung's lower face that count as its border and its dome."""

_SMOOTH_MM = 8.0
_REACH = 1.5
"""Points are left free within so many times their displacement of a bone: ribs and organs slide along each other, and
a field without jumps must have room."""

_SKIN_MM = 5.0
"""Soft organs are left free at their surface, but for the diaphragm."""


@dataclass(frozen=True)
class Descent:
    """How far the diaphragm descends over the patient's cross-section.

    Attributes
    ----------
    origin : (2,) array
        x and y of the first column, LPS mm.
    depth_mm : (x, y) array
        Of every column of _CELL_MM, beyond the lungs continued.

    """

    origin: np.ndarray
    depth_mm: np.ndarray

    def at(self, points: np.ndarray) -> np.ndarray:
        """Descent (N,) in mm at points (N, 3)."""
        cells = np.rint((points[:, :2] - self.origin) / _CELL_MM).astype(int)
        cells = np.clip(cells, 0, np.array(self.depth_mm.shape) - 1)
        return self.depth_mm[tuple(cells.T)]


def soft_organs(
    anatomy: Anatomy, lungs: np.ndarray, amplitude: float, rng: np.random.Generator
) -> SoftMotion:
    """What soft organs do by themselves when the diaphragm descends.

    Parameters
    ----------
    anatomy : Anatomy
        With labels.
    lungs : (k, j, i) array of bool
        On its grid.
    amplitude : float
        Descent of the right half's dome in mm; that of the left one differs a little.
    rng : np.random.Generator
        Draws that difference and the heart's share.

    """
    left_share, heart_share = (float(np.clip(rng.normal(1, 0.1), 0.7, 1.3)) for _ in range(2))
    sparse = _Sparse.of(anatomy)
    from_bone = np.asarray(
        distance_transform_edt(sparse.take(anatomy.structures.labels == 0), sampling=sparse.spacing)
    )
    heart = sparse.take(anatomy.organ("heart"))
    halves = {side: sparse.take(anatomy.organ("lung", side)) for side in ("right", "left")}
    if not all(mask.any() for mask in halves.values()):
        halves = {"right": sparse.take(lungs)}
    dome, descent = _diaphragm(sparse, halves, heart, amplitude, left_share)
    liver = sparse.inside(sparse.take(anatomy.organ("liver")))
    heart_core = sparse.inside(heart)
    parts = [(dome, descent.at(dome)), (liver, descent.at(liver))]
    if len(heart_core):
        height = (heart_core[:, 2] - heart_core[:, 2].min()) / max(float(np.ptp(heart_core[:, 2])), 1.0)
        parts.append((heart_core, amplitude * heart_share * np.interp(height, (0, 1), HEART_SHARE)))
    points, depth = (np.concatenate(each) for each in zip(*parts, strict=True))
    free = sparse.at(from_bone, points) > _REACH * depth
    displacements = np.zeros((int(free.sum()), 3))
    displacements[:, 2] = -depth[free]
    return SoftMotion(points[free], displacements, lungs)


def _diaphragm(
    sparse: _Sparse, halves: dict[str, np.ndarray], heart: np.ndarray, amplitude: float, left_share: float
) -> tuple[np.ndarray, Descent]:
    """Points (N, 3) of the lungs' lower faces, and how far they descend; halves: {side: (k, j, i) lung}."""
    sides = {side: sparse.points(mask) for side, mask in halves.items()}
    every = np.concatenate(list(sides.values()))[:, :2]
    if not len(every):
        return np.empty((0, 3)), Descent(np.zeros(2), np.zeros((1, 1)))
    origin = every.min(0) - _CELL_MM
    shape = tuple(np.ceil((every.max(0) - origin) / _CELL_MM).astype(int) + 2)
    depth = np.full(shape, np.nan)
    faces = []
    for side, points in sides.items():
        cells = np.ravel_multi_index(np.rint((points[:, :2] - origin) / _CELL_MM).astype(int).T, shape)
        order = np.lexsort((points[:, 2], cells))
        lowest = order[np.r_[True, np.diff(cells[order]) > 0]]
        face, cell = points[lowest], cells[lowest]
        on_heart = np.any([sparse.at(heart, face - [0, 0, down]) for down in (2.5, 5.0, 7.5, 10.0)], axis=0)
        chosen = (face[:, 2] < (points[:, 2].min() + points[:, 2].max()) / 2) & ~on_heart
        face, cell = face[chosen], cell[chosen]
        if not len(face):
            continue
        border, dome = np.percentile(face[:, 2], _DOME_BAND)
        share = np.clip((face[:, 2] - border) / max(dome - border, 1.0) / _FULL_DESCENT, 0, 1)
        depth.flat[cell] = share * amplitude * (left_share if side == "left" else 1.0)
        faces.append(face)
    missing = np.isnan(depth)
    if missing.all():
        return np.empty((0, 3)), Descent(origin, np.zeros(shape))
    whole = depth[nearest_known(missing)]
    smooth = gaussian_filter(whole, _SMOOTH_MM / _CELL_MM, mode="nearest")
    return np.concatenate(faces), Descent(origin, smooth)


@dataclass(frozen=True)
class _Sparse:
    """Every nth voxel of the CT's grid along each axis, about _CELL_MM apart.

    Attributes
    ----------
    affine : (4, 4) array
        Index (i, j, k) among them to LPS mm.
    step : tuple of slice
        Takes them.

    """

    affine: np.ndarray
    step: tuple[slice, ...]

    @classmethod
    def of(cls, anatomy: Anatomy) -> _Sparse:
        steps = [max(1, round(_CELL_MM / s)) for s in anatomy.spacing]
        affine = anatomy.affine.copy()
        affine[:3, :3] = affine[:3, :3] * steps[::-1]
        return cls(affine, tuple(slice(None, None, step) for step in steps))

    @property
    def spacing(self) -> np.ndarray:
        return np.linalg.norm(self.affine[:3, :3], axis=0)[::-1]

    def take(self, mask: np.ndarray) -> np.ndarray:
        return np.ascontiguousarray(mask[self.step])

    def points(self, mask: np.ndarray) -> np.ndarray:
        """Where a mask of them is true, (N, 3) LPS mm."""
        return apply(self.affine, np.argwhere(mask)[:, ::-1].astype(float))

    def at(self, values: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Values (N,) of the voxels nearest to points (N, 3)."""
        index = np.rint(apply(np.linalg.inv(self.affine), points)[:, ::-1]).astype(int)
        return values[tuple(np.clip(index, 0, np.array(values.shape) - 1).T)]

    def inside(self, organ: np.ndarray) -> np.ndarray:
        """Points (N, 3) of an organ that lie under its surface."""
        if not organ.any():
            return np.empty((0, 3))
        return self.points(np.asarray(distance_transform_edt(organ, sampling=self.spacing)) > _SKIN_MM)
