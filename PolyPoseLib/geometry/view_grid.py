"""Directions of view spread evenly around some central ones, with rotations of the image about the axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation


@dataclass(frozen=True)
class ViewGrid:
    """Rotations to try, each ``turn(rolls[r]) @ rotations[d]`` where allowed[d, r].

    Attributes
    ----------
    rotations : (D, 3, 3) array
        World to camera.
    rolls : (R,) array
        rad, of the camera about its axis, x toward y.
    allowed : (D, R) array of bool
        Which pairs to try.

    """

    rotations: np.ndarray
    rolls: np.ndarray
    allowed: np.ndarray


def turn(roll: float) -> np.ndarray:
    """(3, 3) rotation in camera coordinates by ``roll`` rad about the axis."""
    return Rotation.from_rotvec([0.0, 0.0, roll]).as_matrix()


def view_grid(
    centres: np.ndarray, radius_rad: float, direction_spacing_rad: float, roll_spacing_rad: float
) -> ViewGrid:
    """Rotations that cover those within an angle of any of some central ones.

    Parameters
    ----------
    centres : (C, 3, 3) array
        Central rotations, world to camera.
    radius_rad : float
        Largest angle from a central rotation.
    direction_spacing_rad : float
        Distance of neighbouring directions on the sphere, a Fibonacci lattice.
    roll_spacing_rad : float
        Largest distance of neighbouring rotations about the axis.

    Returns
    -------
    ViewGrid
        Directions and rolls, and which pairs lie within the radius.

    References
    ----------
    A. Gonzalez, "Measurement of areas on a sphere using Fibonacci and latitude-longitude lattices", Math. Geosci. 42,
    2010.

    """
    axes = centres[:, 2]
    directions = _fibonacci(max(12, round(4 * np.pi / (np.sqrt(3) / 2 * direction_spacing_rad**2))))
    cosines = np.clip(directions @ axes.T, -1, 1)
    nearest = cosines.argmax(axis=1)
    tilt = np.arccos(cosines.max(axis=1))
    kept = tilt <= radius_rad
    directions, nearest, tilt = directions[kept], nearest[kept], tilt[kept]
    if not len(directions):
        directions, nearest, tilt = axes, np.arange(len(axes)), np.zeros(len(axes))
    rotations = np.stack(
        [centres[c] @ rotation_between(d, axes[c]) for d, c in zip(directions, nearest, strict=True)]
    )
    count = int(np.ceil(radius_rad / roll_spacing_rad))
    rolls = np.linspace(-radius_rad, radius_rad, 2 * count + 1)
    angle = 2 * np.arccos(np.clip(np.cos(tilt / 2)[:, None] * np.cos(rolls / 2), -1, 1))
    return ViewGrid(rotations, rolls, angle <= radius_rad + 1e-6)


def rotation_between(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """(3, 3) smallest rotation that takes the unit vector ``start`` (3,) to ``end`` (3,)."""
    axis = np.cross(start, end)
    sine, cosine = np.linalg.norm(axis), float(start @ end)
    if sine < 1e-12:
        if cosine > 0:
            return np.eye(3)
        axis, sine = np.cross(start, np.eye(3)[np.argmin(np.abs(start))]), 1.0
        return Rotation.from_rotvec(np.pi * axis / np.linalg.norm(axis)).as_matrix()
    return Rotation.from_rotvec(np.arctan2(sine, cosine) * axis / sine).as_matrix()


def _fibonacci(count: int) -> np.ndarray:
    """(count, 3) unit vectors, evenly spread."""
    n = np.arange(count) + 0.5
    z = 1 - 2 * n / count
    longitude = np.pi * (1 + np.sqrt(5)) * n
    ring = np.sqrt(1 - z**2)
    return np.stack([ring * np.cos(longitude), ring * np.sin(longitude), z], axis=1)
