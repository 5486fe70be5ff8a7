"""Domain randomisation: what a rendering lacks of a real X-ray, drawn at random over wide ranges."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import zoom

from PolyPoseLib.simulation.xray_physics import XrayPhysics, measure

LIMITED_SHARE = 0.4
"""How often an X-ray is collimated or cropped."""

LEAST_FIELD = 0.55
"""Smallest side of a collimated field, as a share of the detector's."""

VEIL = 0.4
"""Largest deviation (line integrals) of the smooth veil that stands for tissue and scatter that the CT lacks."""

FOREIGN_SHARE = 0.2
"""How often a foreign body (an instrument, a table's edge) lies over the image."""


def randomised(
    image: np.ndarray, mask: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """A rendering (S, S) of line integrals as some detector might show it, and its mask.

    Beam hardening, scatter, noise, blur and saturation (:mod:`PolyPoseLib.simulation.xray_physics`), a smooth veil,
    foreign bodies, an unknown contrast curve, collimation and crops.

    Parameters
    ----------
    image : (S, S) array
        Line integrals.
    mask : (S, S) array of bool
        Pixels that are known.
    rng : np.random.Generator
        The generator of every random number.

    Returns
    -------
    (S, S) array of float32
        The image as measured.
    (S, S) array of bool
        Pixels that count.

    """
    measured = measure(np.maximum(image + _foreign(image.shape, rng), 0), _physics(rng), rng)
    measured = _contrast(measured + _veil(image.shape, rng), rng)
    return measured, mask & _field(image.shape, rng)


def _physics(rng: np.random.Generator) -> XrayPhysics:
    """A random detector and exposure; one pixel stands for many of a detector, so it counts many photons."""
    return XrayPhysics(
        photons=10 ** rng.uniform(5.5, 7.5),
        scatter_to_primary=rng.uniform(0, 1.5),
        scatter_width=rng.uniform(0.05, 0.18),
        beam_hardening=rng.uniform(0, 0.04),
        blur_px=rng.uniform(0, 1.0),
        saturation=rng.uniform(0, 0.6),
        bits=0,
    )


def _veil(shape: tuple[int, int], rng: np.random.Generator) -> np.ndarray:
    """A smooth random field: 4 x 4 normal numbers, interpolated."""
    coarse = rng.normal(size=(4, 4)) * VEIL * rng.uniform()
    return np.asarray(zoom(coarse, np.array(shape) / 4, order=3, mode="nearest", grid_mode=True))


def _foreign(shape: tuple[int, int], rng: np.random.Generator) -> np.ndarray:
    """A bar across the image, as thick as instruments and edges of tables are, or nothing."""
    if rng.uniform() > FOREIGN_SHARE:
        return np.zeros(shape)
    row, column = np.meshgrid(*(np.linspace(-1, 1, n) for n in shape), indexing="ij")
    angle = rng.uniform(0, np.pi)
    across = np.cos(angle) * row + np.sin(angle) * column - rng.uniform(-1, 1)
    along = np.cos(angle) * column - np.sin(angle) * row - rng.uniform(-1, 1)
    bar = (np.abs(across) < rng.uniform(0.01, 0.06)) & (along < rng.uniform(0, 2))
    return bar * rng.uniform(0.2, 3.0)


def _contrast(image: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A monotonic curve: power, gain and offset of the line integrals."""
    low, high = float(image.min()), float(image.max())
    share = (image - low) / max(high - low, 1e-6)
    curved = share ** np.exp(rng.uniform(-0.5, 0.5)) * max(high - low, 1e-6)
    return (curved * np.exp(rng.uniform(-0.5, 0.5)) + rng.uniform(-1, 1)).astype(np.float32)


def _field(shape: tuple[int, int], rng: np.random.Generator) -> np.ndarray:
    """Where a random collimator leaves light: everything, a rectangle, or a disc."""
    field = np.ones(shape, bool)
    if rng.uniform() > LIMITED_SHARE:
        return field
    row, column = np.meshgrid(*(np.linspace(0, 1, n) for n in shape), indexing="ij")
    if rng.uniform() < 0.3:
        radius = rng.uniform(LEAST_FIELD, 1.2) / 2
        middle = 0.5 + rng.uniform(-0.1, 0.1, 2)
        return np.hypot(row - middle[0], column - middle[1]) < radius
    for axis in (row, column):
        width = rng.uniform(LEAST_FIELD, 1)
        start = rng.uniform(0, 1 - width)
        field &= (axis >= start) & (axis <= start + width)
    return field
