"""Instruments in the field of an operation: Kirschner wires, retractors, a clamp. All of stainless steel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from PolyPoseLib.simulation.degradations.anatomy import bone_points, bones_of_kind, long_axis
from PolyPoseLib.simulation.degradations.degraded_case import DegradedCase
from PolyPoseLib.simulation.degradations.solids import STEEL, Box, Rod, Solid, metal_line, wire

WIRE_RADIUS_MM = 1.0


def k_wires(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """Two Kirschner wires of 2 mm in each of two bones, their ends outside the skin."""
    solids: list[Solid] = []
    for name in operated_bones(degraded)[:2]:
        target, medial, axis = approach(degraded, name)
        for offset in (-9.0, 9.0):
            direction = medial + rng.uniform(-0.25, 0.25) * axis + np.array([0, rng.uniform(-0.35, 0.35), 0])
            direction /= np.linalg.norm(direction)
            at = target + (offset + rng.uniform(-3, 3)) * axis
            solids.append(Rod(at - 95 * direction, at + rng.uniform(20, 38) * direction, WIRE_RADIUS_MM))
    return with_metal(degraded, solids, STEEL)


def retractor(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """Two Hohmann retractors at one bone: bent blades 14 mm wide whose tips lie on it."""
    name = operated_bones(degraded)[0]
    target, medial, axis = approach(degraded, name)
    solids: list[Solid] = []
    for side in (-1.0, 1.0):
        out = -medial + side * rng.uniform(0.6, 0.9) * axis
        out /= np.linalg.norm(out)
        front = np.array([0.0, -1.0, 0.0])
        tip = target + side * 24 * axis - 12 * medial + 6 * front
        path = [
            tip,
            tip + 22 * out + 8 * front,
            tip + 55 * out + 55 * front,
            tip + (150 + rng.uniform(0, 20)) * out + 75 * front,
        ]
        solids += blade(path, width=14.0, thickness=2.5)
    return with_metal(degraded, solids, STEEL)


def clamp(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """A bone-holding clamp with two finger rings, its jaws on one bone."""
    name = operated_bones(degraded)[-1]
    target, medial, axis = approach(degraded, name)
    out = -medial + rng.uniform(-0.6, 0.6) * axis + np.array([0.0, -0.45, 0.0])
    out /= np.linalg.norm(out)
    across = np.cross(out, [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    solids: list[Solid] = []
    for side in (-1.0, 1.0):
        outline = [(0, 9), (14, 17), (45, 8), (62, 0), (80, -7), (165, -24)]
        path = [target + along * out + side * wide * across for along, wide in outline]
        solids += wire(path[:3], 2.6) + wire(path[2:], 3.2)
        ring = path[-1] + 13 * out - 3 * side * across
        turns = np.linspace(0, 2 * np.pi, 25)
        circle = [ring + 13 * (np.cos(t) * out + np.sin(t) * across) for t in turns]
        solids += wire(circle, 2.2)
    normal = np.cross(out, across)
    pivot = target + 62 * out
    solids.append(Rod(pivot - 4.5 * normal, pivot + 4.5 * normal, 5.0))
    return with_metal(degraded, solids, STEEL)


def operated_bones(degraded: DegradedCase) -> list[str]:
    """Bones that are operated on: limbs, else any but the anchor."""
    case = degraded.case
    names = [name for name in bones_of_kind(case, "limb") if name != case.anchor]
    return names or list(case.structures.names)


def approach(degraded: DegradedCase, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where instruments reach a bone: a point (3,) in its upper half, and unit vectors (3,) inwards and along it."""
    case = degraded.case
    points, middle = bone_points(case, name), bone_points(case, case.anchor).mean(0)
    axis = long_axis(points)
    along = points @ axis
    low, high = np.quantile(along, (0.3, 0.5))
    target = points[(along >= low) & (along <= high)].mean(0)
    medial = np.array([-1.0 if target[0] >= middle[0] else 1.0, 0.0, 0.0])
    medial -= (medial @ axis) * axis
    length = np.linalg.norm(medial)
    return target, medial / length if length > 1e-6 else np.array([1.0, 0.0, 0.0]), axis


def blade(path: Sequence[np.ndarray], width: float, thickness: float) -> list[Solid]:
    """A flat bar bent along a path of points (3,); its width lies across the path and level with the detector."""
    solids: list[Solid] = []
    for start, end in pairwise(path):
        along = (end - start) / 2
        unit = along / np.linalg.norm(along)
        across = np.cross(unit, [0.0, 1.0, 0.0])
        across /= np.linalg.norm(across)
        normal = np.cross(unit, across)
        overlap = along + unit * thickness / 4
        solids.append(Box((start + end) / 2, np.stack([overlap, across * width / 2, normal * thickness / 2])))
    return solids


def with_metal(degraded: DegradedCase, solids: Sequence[Solid], attenuation: float) -> DegradedCase:
    """The case with things of one material (1/mm) in every view's beam, through its true camera."""
    return degraded.with_views(
        lambda view, _: replace(view, line=view.line + metal_line(solids, attenuation, view.camera))
    )
