"""From all that lies in the beam to the stored image: leaves, scatter, noise, starvation and bits."""

from __future__ import annotations

import zlib
from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter

from PolyPoseLib.simulation.degradations.degraded_case import DegradedCase, View
from PolyPoseLib.simulation.xray_physics import XrayPhysics

LEAF_TRANSMISSION = 2e-3
"""Share of the beam that passes a collimator's lead."""

ELECTRONIC_NOISE = 4.0
"""Standard deviation of the read-out, in photons: what remains behind metal that lets nothing through."""


def exposed(degraded: DegradedCase) -> DegradedCase:
    """The case with every view measured anew from what lies in its beam."""
    rng = np.random.default_rng([degraded.case.seed, zlib.crc32(b"detector")])
    return degraded.with_views(lambda view, _: replace(view, image=measure_view(view, degraded.physics, rng)))


def measure_view(view: View, physics: XrayPhysics, rng: np.random.Generator) -> np.ndarray:
    """Line integrals (H, W) float32 as the detector stores them.

    As :func:`PolyPoseLib.simulation.xray_physics.measure`, with what that has no need of: scatter comes only from
    where the collimator lets the beam through, its strength is that of the patient without metal, and behind metal
    that lets nothing through there remain scatter and electronic noise.

    Parameters
    ----------
    view : View
        Its body, line and leaves are used.
    physics : XrayPhysics
        Of the detector.
    rng : Generator
        Of the noise.

    """
    leaves = np.ones_like(view.line) if view.leaves is None else view.leaves
    line = view.line / (1 + physics.beam_hardening * view.line)
    primary = np.exp(-line) * leaves
    intensity = primary + _scatter(view, physics, leaves)
    if physics.blur_px:
        intensity = gaussian_filter(intensity, physics.blur_px, mode="nearest")
    counts = rng.poisson(np.minimum(intensity * physics.photons, 1e15)) + rng.normal(
        0, ELECTRONIC_NOISE, intensity.shape
    )
    measured = -np.log(np.maximum(counts, 1.0) / physics.photons)
    return _stored(np.maximum(measured, physics.saturation), physics).astype(np.float32)


def _scatter(view: View, physics: XrayPhysics, leaves: np.ndarray) -> np.ndarray:
    """The veil (H, W): first-order scatter of the patient, spread widely (Ohnesorge et al., Eur Radiol 9, 1999)."""
    if physics.scatter_to_primary == 0:
        return np.zeros_like(view.line)
    width = physics.scatter_width * max(view.line.shape)
    body = view.body / (1 + physics.beam_hardening * view.body)
    open_field = gaussian_filter(body * np.exp(-body), width, mode="nearest")
    behind = body > 0.5 * min(1.0, float(body.max()))
    if not behind.any() or not open_field.any():
        return np.zeros_like(view.line)
    strength = physics.scatter_to_primary / np.median(open_field[behind] * np.exp(body[behind]))
    # Metal between patient and detector takes scatter as well; most lies above or within, and half of it stays.
    shadow = np.exp(-0.5 * np.minimum(np.maximum(view.line - view.body, 0), 2.0))
    source = np.maximum(body, 0) * np.exp(-body) * shadow * leaves
    return strength * gaussian_filter(
        source, width, mode="constant" if view.leaves is not None else "nearest"
    )


def _stored(line: np.ndarray, physics: XrayPhysics) -> np.ndarray:
    """Rounded to the levels that the bits allow, in line integrals."""
    if physics.bits == 0:
        return line
    top = max(float(line.max()), physics.saturation + 1e-6)
    step = (top - physics.saturation) / (2**physics.bits - 1)
    return physics.saturation + np.rint((line - physics.saturation) / step) * step
