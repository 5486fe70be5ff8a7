"""Implants that the CT does not show: a joint prosthesis, and screws and rods in the spine."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from PolyPoseLib.data.volume import WATER_ATTENUATION_PER_MM, hounsfield_to_attenuation
from PolyPoseLib.simulation.degradations.anatomy import (
    bone_points,
    bones_of_kind,
    excess_lines,
    long_axis,
    parent_of,
)
from PolyPoseLib.simulation.degradations.degraded_case import DegradedCase
from PolyPoseLib.simulation.degradations.instruments import operated_bones, with_metal
from PolyPoseLib.simulation.degradations.solids import (
    COBALT_CHROME,
    TITANIUM,
    Ellipsoid,
    HalfBall,
    Rod,
    Solid,
    metal_line,
    wire,
)
from PolyPoseLib.simulation.motion import joint_centre

HEAD_RADII_MM = (14.0, 18.0)
CUP_RADIUS_MM, CUP_WALL_MM = 26.0, 3.5
RESECTED_MM = 28.0
NECK_MM, STEM_MM = 26.0, 120.0
"""How far below the head the stem begins, and its length."""

OFFSET_MM = 40.0
"""From the head to the shaft's axis, where the CT does not show the shaft."""

LEVEL_MM = 34.0
"""Distance of vertebrae, where the labels do not part them."""


def prosthesis(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """A hip (or shoulder) replaced since the CT: ball, stem and cup, the bone's own head resected."""
    case = degraded.case
    name = operated_bones(degraded)[int(rng.integers(2)) % len(operated_bones(degraded))]
    points, socket = bone_points(case, name), bone_points(case, parent_of(case, name))
    head = joint_centre(name, points, socket)
    axis, foot = _shaft(points, head)
    neck = foot + NECK_MM * axis
    stem: list[Solid] = [*wire([head, neck], 6.5)]
    marks = np.linspace(0, STEM_MM, 6)
    for start, end in pairwise(marks):
        stem.append(Rod(neck + start * axis, neck + end * axis, 8.5 - 4.5 * start / STEM_MM))
    stem.append(Ellipsoid.ball(neck, 8.5))
    out = _away(head, socket, neck)
    ball = rng.uniform(*HEAD_RADII_MM)
    outer = HalfBall(head, CUP_RADIUS_MM, -out)
    inner = HalfBall(head, CUP_RADIUS_MM - CUP_WALL_MM, -out)
    resected = _resected(degraded, name, head)

    def place(view, number):
        cup = metal_line([outer], TITANIUM, view.camera) - metal_line([inner], TITANIUM, view.camera)
        metal = metal_line([Ellipsoid.ball(head, ball)], COBALT_CHROME, view.camera)
        metal += metal_line(stem, TITANIUM * 1.3, view.camera) + np.maximum(cup, 0)
        line = np.maximum(view.line + resected[number], 0) + metal
        return replace(view, line=line)

    return degraded.with_views(place)


def pedicle_screws(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """Titanium screws of 6 mm in both pedicles of three or four neighbouring vertebrae, and the rods that join them."""
    centres = _vertebrae(degraded)
    first = int(rng.integers(0, max(len(centres) - 3, 1)))
    levels = centres[first : first + 4]
    solids: list[Solid] = []
    for side in (-1.0, 1.0):
        heads = []
        for centre in levels:
            # Screws run from behind and outside to the front and middle.
            entry = centre + np.array([side * 19.0, 12.0, rng.uniform(-2, 2)])
            inwards = np.array([-side * rng.uniform(0.2, 0.35), -1.0, rng.uniform(-0.12, 0.12)])
            inwards /= np.linalg.norm(inwards)
            solids.append(Rod(entry, entry + 45 * inwards, 3.0))
            solids.append(Rod(entry - 16 * inwards, entry, 6.5))
            heads.append(entry - 11 * inwards)
        if len(heads) > 1:
            ends = heads[0] + 12 * _unit(heads[0] - heads[1]), heads[-1] + 12 * _unit(heads[-1] - heads[-2])
            solids += wire([ends[0], *heads, ends[1]], 2.75)
    return with_metal(degraded, solids, TITANIUM)


def _vertebrae(degraded: DegradedCase) -> list[np.ndarray]:
    """Middles (3,) of vertebrae from the feet upwards, by structure or along a fused spine."""
    case = degraded.case
    centres = []
    for name in bones_of_kind(case, "spine"):
        points = bone_points(case, name)
        low, high = np.quantile(points[:, 2], (0.02, 0.98))
        count = max(1, round((high - low) / LEVEL_MM)) if high - low > 1.6 * LEVEL_MM else 1
        edges = np.linspace(low, high + 1e-6, count + 1)
        for bottom, top in pairwise(edges):
            here = points[(points[:, 2] >= bottom) & (points[:, 2] <= top)]
            if len(here):
                centres.append(here.mean(0))
    return sorted(centres, key=lambda centre: float(centre[2]))


def _shaft(points: np.ndarray, head: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Direction (3,) of a bone's shaft away from its head, and the point (3,) of its line beside the head."""
    far = points[np.linalg.norm(points - head, axis=1) > 60]
    if len(far) < 50 or np.ptp(far @ long_axis(far)) < 50:
        lateral = np.array([np.sign((points.mean(0) - head)[0]) or 1.0, 0.0, 0.0])
        return np.array([0.0, 0.0, -1.0]), head + OFFSET_MM * lateral
    axis = long_axis(far)
    if (far.mean(0) - head) @ axis < 0:
        axis = -axis
    middle = far.mean(0)
    return axis, middle + ((head - middle) @ axis) * axis


def _away(head: np.ndarray, socket: np.ndarray, neck: np.ndarray) -> np.ndarray:
    """Unit vector (3,) in which a cup opens: along the neck, turned away from the middle of the socket's bone."""
    near = socket[np.linalg.norm(socket - head, axis=1) < 60]
    inwards = _unit(near.mean(0) - head) if len(near) else np.zeros(3)
    return _unit(_unit(neck - head) - 0.8 * inwards)


def _resected(degraded: DegradedCase, name: str, head: np.ndarray) -> list[np.ndarray]:
    """Line integrals (H, W) a view, negative, of the bone that made room for the ball."""
    case = degraded.case
    number = case.structures.names.index(name) + 1
    kji = np.argwhere(case.fixed_labels.voxels == number)
    near = np.linalg.norm(case.fixed_labels.to_world(kji[:, ::-1]) - head, axis=1) < RESECTED_MM
    excess = np.zeros(case.fixed_ct.shape, np.float32)
    inside = tuple(kji[near].T)
    mu = hounsfield_to_attenuation(case.fixed_ct.voxels[inside])
    excess[inside] = -np.maximum(mu - WATER_ATTENUATION_PER_MM, 0)
    return excess_lines(case, excess, [view.camera for view in degraded.views])


def _unit(vector: np.ndarray) -> np.ndarray:
    """Of length 1."""
    return vector / max(float(np.linalg.norm(vector)), 1e-12)
