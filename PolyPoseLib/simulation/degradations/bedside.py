"""What lies on and under the patient: electrodes with their cables, the rails of a table."""

from __future__ import annotations

import numpy as np

from PolyPoseLib.simulation.degradations.anatomy import skin_surface
from PolyPoseLib.simulation.degradations.degraded_case import DegradedCase
from PolyPoseLib.simulation.degradations.instruments import with_metal
from PolyPoseLib.simulation.degradations.solids import COPPER, STEEL, Box, Rod, Solid, wire
from PolyPoseLib.simulation.simulate import structures_centre

CABLE_RADIUS_MM = 0.5
"""Of the copper core."""


def ecg_leads(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """Four electrodes on the front of the patient, whose cables leave the picture together."""
    case = degraded.case
    size = degraded.size_factor
    centre = structures_centre(case.structures, case.ct.affine)
    places = np.array([[-95.0, 75.0], [85.0, 95.0], [-70.0, -60.0], [95.0, -35.0]])
    places += rng.uniform(-25, 25, (4, 2))
    leaving = np.array([rng.choice([-1.0, 1.0]) * rng.uniform(120, 170), rng.uniform(150, 230)])
    cables: list[Solid] = []
    snaps: list[Solid] = []
    curves = []
    for place in places:
        bends = place + rng.uniform(-110, 110, 2), leaving + rng.uniform(-90, 90, 2)
        curves.append(size * _bezier(place, *bends, leaving + rng.uniform(-12, 12, 2)) + centre[[0, 2]])
    heights = skin_surface(case, *np.concatenate(curves).T).reshape(len(curves), -1) - 4.0
    for flat, y in zip(curves, heights, strict=True):
        path = np.stack([flat[:, 0], _smooth(y), flat[:, 1]], axis=-1)
        cables += wire(path, CABLE_RADIUS_MM)
        snaps.append(Rod(path[0] - [0, 3, 0], path[0] + [0, 2, 0], 5.0))
    return with_metal(with_metal(degraded, cables, COPPER), snaps, STEEL)


def table_rails(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """Two steel rails of 8 x 20 mm along a narrow table behind the patient, with a cross-bar beyond the anatomy."""
    case = degraded.case
    centre = structures_centre(case.structures, case.ct.affine)
    half = 138.0 + rng.uniform(-6, 6)
    below = float(skin_surface(case, centre[:1], centre[2:], back=True)[0]) + 45.0
    tilt = np.radians(rng.uniform(-2, 2))
    along = 300.0 * np.array([np.sin(tilt), 0.0, np.cos(tilt)])
    solids: list[Solid] = []
    for side in (-1.0, 1.0):
        at = np.array([centre[0] + side * half, below, centre[2]])
        solids.append(Box(at, np.stack([along, [4.0 * np.cos(tilt), 0, -4.0 * np.sin(tilt)], [0, 10.0, 0]])))
    return with_metal(degraded, solids, STEEL)


def _bezier(start: np.ndarray, first: np.ndarray, second: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Points (40, 2) of a cubic curve."""
    t = np.linspace(0, 1, 40)[:, None]
    return (1 - t) ** 3 * start + 3 * t * (1 - t) ** 2 * first + 3 * t**2 * (1 - t) * second + t**3 * end


def _smooth(values: np.ndarray) -> np.ndarray:
    """A cable does not follow every fold of the skin."""
    padded = np.pad(values, 3, mode="edge")
    return np.convolve(padded, np.ones(7) / 7, mode="valid")
