"""What a workstation does to grey levels: windows, curves, equalisation, sharpening. The geometry stays."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter

from PolyPoseLib.simulation.degradations.degraded_case import DegradedCase, grey_levels, with_grey


def eight_bit(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """256 grey levels, as pictures for the screen have."""
    return degraded.with_views(lambda view, _: with_grey(view, np.rint(grey_levels(view) * 255) / 255, 8))


def gamma(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """A gamma curve, brighter in one view and darker in the next."""
    first = bool(rng.integers(2))
    powers = (rng.uniform(0.45, 0.6), rng.uniform(1.7, 2.2))
    return degraded.with_views(
        lambda view, number: with_grey(view, grey_levels(view) ** powers[(number + first) % 2])
    )


def window_clipped(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """A narrow window: soft tissue is black, dense bone white."""
    low, high = rng.uniform(0.15, 0.25), rng.uniform(0.91, 0.95)

    def window(view, _):
        grey = grey_levels(view)
        inside = grey[grey > 0.05]
        bottom, top = np.quantile(inside, (low, high))
        return with_grey(view, (grey - bottom) / max(top - bottom, 1e-6), 8)

    return degraded.with_views(window)


def clahe(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """Contrast-limited adaptive histogram equalisation in 8 x 8 tiles."""
    limit = rng.uniform(0.010, 0.016)
    return degraded.with_views(lambda view, _: with_grey(view, equalized(grey_levels(view), limit)))


def unsharp(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """Unsharp masking, strong enough for dark and bright seams along edges."""
    amount, radius_mm = rng.uniform(2.0, 2.8), rng.uniform(7, 11)

    def sharpen(view, _):
        grey = grey_levels(view)
        blurred = gaussian_filter(grey, radius_mm / np.array(view.stated.pixel_spacing_mm), mode="nearest")
        return with_grey(view, blurred + (1 + amount) * (grey - blurred))

    return degraded.with_views(sharpen)


def multi_scale(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """Multi-scale contrast amplification: weak detail of every size is raised, the slow background flattened."""
    power, background = rng.uniform(0.62, 0.72), rng.uniform(0.25, 0.4)
    return degraded.with_views(
        lambda view, _: with_grey(view, amplified(grey_levels(view), power, background), 10)
    )


def equalized(grey: np.ndarray, clip_limit: float = 0.012, tiles: int = 8, levels: int = 256) -> np.ndarray:
    """CLAHE of grey levels (H, W) from 0 to 1 (S. M. Pizer et al., CVGIP 39, 1987; K. Zuiderveld, Graphics Gems IV).

    Parameters
    ----------
    grey : ndarray (H, W)
        From 0 to 1.
    clip_limit : float
        Largest share of a tile's pixels in one level; what is above is spread evenly over all levels.
    tiles : int
        Along each side.
    levels : int
        Of the histograms.

    """
    height, width = grey.shape
    level = np.clip((grey * levels).astype(int), 0, levels - 1)
    curves = np.zeros((tiles, tiles, levels))
    rows, columns = (np.linspace(0, size, tiles + 1).astype(int) for size in (height, width))
    for r in range(tiles):
        for c in range(tiles):
            tile = level[
                rows[r] : max(rows[r + 1], rows[r] + 1), columns[c] : max(columns[c + 1], columns[c] + 1)
            ]
            histogram = np.bincount(tile.ravel(), minlength=levels) / max(tile.size, 1)
            above = np.maximum(histogram - clip_limit, 0).sum()
            curves[r, c] = np.cumsum(np.minimum(histogram, clip_limit) + above / levels)
    r0, r1, down = _between(height, tiles)
    c0, c1, right = _between(width, tiles)
    down, right = down[:, None], right[None]
    out = np.zeros_like(grey, dtype=np.float64)
    for r, share in ((r0, 1 - down), (r1, down)):
        for c, portion in ((c0, 1 - right), (c1, right)):
            out += share * portion * curves[r[:, None], c[None], level]
    return out.astype(np.float32)


def amplified(grey: np.ndarray, power: float, background: float) -> np.ndarray:
    """Bands of detail raised to a power below 1, as multi-scale processing does (P. Vuylsteke and E. Schoeters,
    SPIE 2167, 1994).

    Parameters
    ----------
    grey : ndarray (H, W)
        From 0 to 1.
    power : float
        Of each band's amplitude.
    background : float
        Weight of what is left after the coarsest band.

    """
    low = grey.astype(np.float64)
    out = np.zeros_like(low)
    sigma = 1.0
    while sigma < min(grey.shape) / 6:
        blurred = gaussian_filter(low, sigma, mode="nearest")
        band, low = low - blurred, blurred
        largest = max(float(np.percentile(np.abs(band), 99.5)), 1e-6)
        fine = 0.5 if sigma < 1.5 else 1.0  # noise is not raised as much
        out += np.sign(band) * largest * (np.abs(band) / largest) ** (1 - fine * (1 - power))
        sigma *= 2
    out += background * (low - low.mean())
    bottom, top = np.percentile(out, (0.5, 99.5))
    return ((out - bottom) / max(top - bottom, 1e-6)).astype(np.float32)


def _between(size: int, tiles: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Indices of the two tiles between whose middles each row lies, and the share of the second."""
    place = np.clip((np.arange(size) + 0.5) / size * tiles - 0.5, 0, tiles - 1)
    low = np.minimum(place.astype(int), max(tiles - 2, 0))
    high = np.minimum(low + 1, tiles - 1)
    return low, high, place - low
