"""What a detector makes of clean line integrals: photons, scatter, blur, saturation and bits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from PolyPoseLib.errors import InputError


@dataclass(frozen=True)
class XrayPhysics:
    """Settings of the measurement; the defaults are a mid-dose C-arm exposure.

    Attributes
    ----------
    photons : float
        Expected count per pixel without any object (I0).
    scatter_to_primary : float
        Scattered over primary energy, median over the object (about 0.5 behind a grid, 2 without).
    scatter_width : float
        Standard deviation of the scatter's spread as a share of the image's width.
    beam_hardening : float
        Relative loss per unit of line integral; 0.01 lowers a line integral of 5 by 5 %.
    blur_px : float
        Standard deviation of the detector's blur in pixels.
    saturation : float
        Line integrals below this are burnt out to it.
    bits : int
        Depth of the stored image; 0 leaves real numbers.
    encoding : {"log", "linear"}
        "log" stores the line integral, "linear" the intensity (DICOM pixel intensity relationship).

    """

    photons: float = 5e4
    scatter_to_primary: float = 0.5
    scatter_width: float = 0.15
    beam_hardening: float = 0.0
    blur_px: float = 0.5
    saturation: float = 0.3
    bits: int = 12
    encoding: str = "log"

    def __post_init__(self) -> None:
        """Check the ranges; raises InputError."""
        if not self.photons > 0:
            raise InputError("photons must be positive.")
        for field in ("scatter_to_primary", "scatter_width", "beam_hardening", "blur_px", "saturation"):
            if not 0 <= getattr(self, field) < np.inf:
                raise InputError(f"{field} must be zero or positive.")
        if not 0 <= self.bits <= 16:
            raise InputError("bits must lie between 0 (no rounding) and 16.")
        if self.encoding not in ("log", "linear"):
            raise InputError('encoding must be "log" or "linear".')


def measure(clean: np.ndarray, physics: XrayPhysics, rng: np.random.Generator) -> np.ndarray:
    """Line integrals as a detector reports them.

    Beer-Lambert intensities, plus a broad scatter veil, blurred, drawn from a Poisson law, logarithm,
    clipped at the saturation and rounded to the bits.

    Parameters
    ----------
    clean : (H, W) array
        Line integrals.
    physics : XrayPhysics
        The detector and the exposure.
    rng : np.random.Generator
        Of the photons' noise.

    Returns
    -------
    (H, W) array of float32
        Line integrals.

    """
    line = np.asarray(clean, dtype=np.float64)
    line = line / (1 + physics.beam_hardening * line)
    primary = np.exp(-line)
    intensity = primary + _scatter(line, primary, physics)
    if physics.blur_px:
        intensity = gaussian_filter(intensity, physics.blur_px, mode="nearest")
    counts = rng.poisson(np.minimum(intensity * physics.photons, 1e15)).astype(np.float64)
    measured = -np.log(np.maximum(counts, 0.5) / physics.photons)
    measured = np.maximum(measured, physics.saturation)
    return _rounded(measured, physics).astype(np.float32)


def _scatter(line: np.ndarray, primary: np.ndarray, physics: XrayPhysics) -> np.ndarray:
    """The veil (H, W): first-order scatter p exp(-p) spread widely (B. Ohnesorge et al., Eur. Radiol. 9, 1999)."""
    if physics.scatter_to_primary == 0:
        return np.zeros_like(line)
    veil = gaussian_filter(line * primary, physics.scatter_width * max(line.shape), mode="nearest")
    behind = line > 0.5
    if not behind.any() or not veil.any():
        return np.zeros_like(line)
    return veil * (physics.scatter_to_primary / np.median(veil[behind] / primary[behind]))


def _rounded(line: np.ndarray, physics: XrayPhysics) -> np.ndarray:
    """Round to the levels that the bits allow, in the domain that is stored."""
    if physics.bits == 0:
        return line
    levels = 2**physics.bits - 1
    if physics.encoding == "log":
        top = max(float(line.max()), physics.saturation + 1e-6)
        step = (top - physics.saturation) / levels
        return physics.saturation + np.rint((line - physics.saturation) / step) * step
    white = np.exp(-physics.saturation)
    stored = np.maximum(np.rint(np.exp(-line) / white * levels), 1)
    return -np.log(stored / levels * white)
