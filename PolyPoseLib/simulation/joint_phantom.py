"""A knee drawn from formulas: femur, tibia and patella with a thin cortex around spongy bone, in a limb of soft tissue.

It stands in for a CT where none is at hand. Nothing is random but sizes and texture, which the seed fixes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.tracking.joints import Joint
from PolyPoseLib.data.volume import AIR_HU, Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.grid import bounding_box, grown_box
from PolyPoseLib.simulation.shapes import Points, ellipsoid, joined, round_cone, without

NAMES = ("femur", "tibia", "patella")

CORTEX_HU, SPONGE_HU, MARROW_HU = 1300.0, 320.0, -30.0
MUSCLE_HU, FAT_HU, SKIN_HU = 55.0, -95.0, 60.0

SPACING_RANGE_MM = (0.4, 6.0)

_BOX_MM = np.array([[-64.0, 64.0], [-64.0, 80.0]])
"""First and last voxel's centre along x and y."""

REACH_MM, LONGEST_MM = 130.0, 250.0
"""From the joint's gap, at z = 0, to the CT's ends; both long bones go on beyond."""

_SKIN_MM, _FAT_MM = 2.0, 7.0

JOINTS = (
    Joint("knee", "femur", "tibia", "grood_suntay", "right"),
    Joint("patellofemoral", "femur", "patella", "grood_suntay", "right"),
)
"""Whose motion is reported."""

_PATELLA_MM = -1.0, -37.0, 24.0
"""Its middle."""


@dataclass(frozen=True)
class JointPhantom:
    """A CT of a right knee in extension.

    Attributes
    ----------
    ct : Volume
        Hounsfield units, LPS mm.
    structures : Structures
        NAMES on its grid.
    landmarks : dict[str, np.ndarray]
        {name: (3,) LPS mm} of points that name the axes of its joints.
    joints : tuple of Joint
        Tibia and patella relative to the femur.

    """

    ct: Volume
    structures: Structures
    landmarks: dict[str, np.ndarray]
    joints: tuple[Joint, ...] = JOINTS


@dataclass(frozen=True)
class _Sizes:
    """What differs from knee to knee: a scale of all, and mm of some parts."""

    scale: float
    medial: float
    tuberosity: float
    patella: np.ndarray
    limb: float


def joint_phantom(seed: int = 0, spacing_mm: float = 1.0, reach_mm: float = REACH_MM) -> JointPhantom:
    """Draw a knee.

    Parameters
    ----------
    seed : int
        Of sizes and texture; the same seed gives the same knee, bit for bit.
    spacing_mm : float
        Of the cubic voxels. At 1 mm there are five million of them.
    reach_mm : float
        How far the CT goes up and down from the joint.

    Raises
    ------
    InputError
        A spacing out of SPACING_RANGE_MM, a reach that is none of 60 to LONGEST_MM, or a seed below 0.

    """
    if not SPACING_RANGE_MM[0] <= spacing_mm <= SPACING_RANGE_MM[1]:
        low, high = SPACING_RANGE_MM
        raise InputError(
            f"The phantom's spacing is {spacing_mm:g} mm: give a number from {low:g} to {high:g}."
        )
    if not 60 <= reach_mm <= LONGEST_MM:
        raise InputError(f"The phantom's reach is {reach_mm:g} mm: give a number from 60 to {LONGEST_MM:g}.")
    if seed < 0:
        raise InputError("The phantom's seed must be 0 or more.")
    rng = np.random.default_rng([seed, 0x6B6E6565])
    sizes = _Sizes(
        scale=float(rng.uniform(0.95, 1.05)),
        medial=float(rng.uniform(-1.5, 1.5)),
        tuberosity=float(rng.uniform(2.0, 6.0)),
        patella=rng.uniform(-1.5, 1.5, 3),
        limb=float(rng.uniform(-4.0, 4.0)),
    )
    axes = [
        np.arange(low, high + spacing_mm / 2, spacing_mm) for low, high in (*_BOX_MM, (-reach_mm, reach_mm))
    ]
    affine = np.diag([spacing_mm, spacing_mm, spacing_mm, 1.0])
    affine[:3, 3] = [axis[0] for axis in axes]
    x, y, z = (axis.astype(np.float32) for axis in axes)
    points: Points = (
        x[None, None, :] / np.float32(sizes.scale),
        y[None, :, None] / np.float32(sizes.scale),
        z[:, None, None] / np.float32(sizes.scale),
    )
    depths = [sizes.scale * each(points, sizes) for each in (_femur, _tibia, _patella)]
    hu = _soft_tissue(points, sizes, spacing_mm, rng)
    labels = np.zeros(hu.shape, np.int16)
    for number, depth in enumerate(depths, start=1):
        labels[(depth < 0) & (labels == 0)] = number
        _draw_bone(hu, depth, points[2], spacing_mm, rng)
    return JointPhantom(Volume(hu, affine), Structures(NAMES, labels), _landmarks(sizes))


def _femur(p: Points, sizes: _Sizes) -> np.ndarray:
    """Signed distance (k, j, i) in mm from the femur's surface, below 0 inside."""
    shaft = round_cone(p, (-16.0, -7.5, 300.0), (-1.0, 0.0, 50.0), 10.0, 15.0)
    flare = round_cone(p, (-1.0, 0.0, 50.0), (0.0, 2.0, 28.0), 15.0, 23.0)
    medial = ellipsoid(p, (21.0, 9.0, 23.0), (13.5, 23.5 + sizes.medial, 21.0))
    lateral = ellipsoid(p, (-22.0, 8.0, 22.5), (14.5, 23.0, 19.5))
    bone = joined(joined(shaft, flare, 8.0), joined(medial, lateral, 3.0), 7.0)
    notch = ellipsoid(p, (0.0, 22.0, 4.0), (8.0, 21.0, 18.0))
    groove = ellipsoid(p, (-1.0, -31.0, 20.0), (10.0, 12.0, 26.0))
    return without(without(bone, notch, 3.0), groove, 3.0)


def _tibia(p: Points, sizes: _Sizes) -> np.ndarray:
    """Signed distance (k, j, i) in mm from the tibia's surface, below 0 inside."""
    plateau = ellipsoid(p, (0.0, 3.0, -13.0), (38.0, 26.0, 15.0))
    top = p[2] + np.float32(2.5)
    plateau = -joined(-plateau, -top, 2.0)
    for x, depth in ((20.0, 1.8), (-20.0, 1.0)):
        plateau = without(plateau, ellipsoid(p, (x, 4.0, 37.5 - depth), (40.0, 40.0, 40.0)), 1.0)
    head = round_cone(p, (0.0, 4.0, -22.0), (1.0, 7.0, -62.0), 23.0, 13.5)
    shaft = round_cone(p, (1.0, 7.0, -62.0), (9.0, 11.0, -300.0), 13.5, 9.0)
    tuberosity = ellipsoid(p, (-sizes.tuberosity, -17.0, -34.0), (8.0, 8.0, 14.0))
    bone = joined(joined(plateau, head, 6.0), joined(shaft, tuberosity, 5.0), 7.0)
    for x, height in ((6.0, 6.0), (-5.0, 4.5)):
        bone = joined(bone, ellipsoid(p, (x, 5.0, -3.0), (4.0, 7.0, height)), 2.0)
    return bone


def _patella(p: Points, sizes: _Sizes) -> np.ndarray:
    """Signed distance (k, j, i) in mm from the patella's surface, below 0 inside."""
    x, y, z = np.add(_PATELLA_MM, sizes.patella)
    body = ellipsoid(p, (x, y, z), (22.0, 9.0, 19.0))
    apex = ellipsoid(p, (x + 1.0, y - 1.0, z - 15.0), (10.0, 6.0, 12.0))
    ridge = ellipsoid(p, (x + 3.0, y + 5.0, z + 1.0), (6.0, 6.0, 14.0))
    return joined(joined(body, apex, 4.0), ridge, 3.0)


def _soft_tissue(p: Points, sizes: _Sizes, spacing: float, rng: np.random.Generator) -> np.ndarray:
    """Skin, fat and muscle with streaks of fat (k, j, i) float32 HU, in air."""
    x, y, z = p
    bulk = 53.0 + sizes.limb + 4.0 * np.tanh(z / 60.0) - 2.0 * np.exp(-((z / 40.0) ** 2))
    shift = 1.0 + 7.0 * (1 - np.exp(-((z / 50.0) ** 2)))
    outside = (np.sqrt((x / 1.0) ** 2 + ((y - shift) / 1.06) ** 2) - bulk).astype(np.float32)
    shape = outside.shape
    streaks = _texture(shape, np.array([14.0, 3.0, 3.0]) / spacing, rng)
    grain = _texture(shape, np.full(3, 2.0) / spacing, rng)
    hu = np.where(streaks > 1.3, FAT_HU + 40, MUSCLE_HU) + 12 * grain
    hu = np.where(outside > -_SKIN_MM - _FAT_MM - 2 * streaks, FAT_HU + 10 * grain, hu)
    hu = np.where(outside > -_SKIN_MM, SKIN_HU, hu)
    cover = _coverage(outside, spacing)
    return (AIR_HU + cover * (hu - AIR_HU)).astype(np.float32)


def _draw_bone(
    hu: np.ndarray, depth: np.ndarray, z: np.ndarray, spacing: float, rng: np.random.Generator
) -> None:
    """Draw a bone in place where its signed distance (k, j, i) in mm is below 0."""
    inside = bounding_box(depth < 0)
    assert inside is not None
    box = grown_box(inside, 2, depth.shape)
    depth, level = depth[box], np.abs(np.broadcast_to(z, hu.shape)[box])
    shaft = np.clip((level - 35.0) / 45.0, 0, 1)
    cortex = 1.3 + 3.0 * shaft
    coarse = _texture(depth.shape, np.full(3, 3.0) / spacing, rng)
    fine = _texture(depth.shape, np.full(3, 1.0) / spacing, rng)
    below = np.clip(-depth / 12.0, 0, 1)
    sponge = SPONGE_HU + 130 * (1 - below) + 90 * coarse + 70 * fine
    inner = sponge + shaft * (MARROW_HU + 25 * coarse - sponge)
    core = _coverage(depth + cortex, spacing)
    bone = CORTEX_HU + 60 * coarse + core * (inner - CORTEX_HU - 60 * coarse)
    hu[box] += (_coverage(depth, spacing) * (bone - hu[box])).astype(np.float32)


def _coverage(distance: np.ndarray, spacing: float) -> np.ndarray:
    """Share of each voxel that lies inside a surface, from the signed distance of its centre in mm."""
    return np.clip(0.5 - distance / np.float32(spacing), 0, 1)


def _texture(shape: tuple[int, ...], sigma: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Smooth noise (k, j, i) float32 of mean 0 and standard deviation 1; sigma: of its grain, in voxels."""
    noise = gaussian_filter(rng.standard_normal(shape, dtype=np.float32), sigma, mode="wrap")
    return (noise - noise.mean()) / max(float(noise.std()), 1e-9)


def _landmarks(sizes: _Sizes) -> dict[str, np.ndarray]:
    """Points that name the axes of the bones, LPS mm."""
    patella = np.add(_PATELLA_MM, sizes.patella)
    points = {
        "femur.medial_epicondyle": (34.0, 8.0, 24.0),
        "femur.lateral_epicondyle": (-36.0, 8.0, 24.0),
        "femur.shaft_proximal": (-3.4, -1.2, 90.0),
        "tibia.medial_plateau": (30.0, 3.0, -4.0),
        "tibia.lateral_plateau": (-30.0, 3.0, -4.0),
        "tibia.shaft_distal": (1.9, 7.5, -90.0),
        "patella.origin": patella,
        "patella.y_axis": np.add(patella, (0.0, 0.0, 10.0)),
        "patella.x_side": np.add(patella, (0.0, -5.0, 0.0)),
    }
    return {name: sizes.scale * np.array(point) for name, point in points.items()}
