"""Whether two X-rays show one view: their fine detail, pixel by pixel, whatever was done to the grey levels.

Another direction moves detail by pixels, so that nothing of it is left in common; a curve of the grey levels, an
inversion or another file format leaves it where it was.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

FINE_PX, COARSE_PX = 400, 110
"""Longer sides at which pictures are compared: noise and all, and with the noise of compression averaged out."""

SAME_PICTURE = 0.85
"""Correlation of fine detail above which two pictures are one exposure. Measured on simulated pelvis and chest X-rays:
at least 0.89 for a copy with 8 bits, another gamma, inverted or in another domain; at most 0.30 for two directions 12
degrees or more apart, even without noise."""

SAME_VIEW = 0.92
"""Correlation of coarse detail above which two pictures show one direction, or nearly. Measured as above: at least 0.92
for a copy by way of JPEG of quality 75, 0.9 for directions 5 to 12 degrees apart, 0.75 beyond."""

SMALLEST_SHARE = 0.05
"""Share of the picture that both must show."""

_WIDTH_PX = 2.0
"""Structures narrower than this are detail."""


@dataclass(frozen=True, eq=False)
class Detail:
    """What of one X-ray is compared.

    Attributes
    ----------
    fine, coarse
        (h, w) detail over its local contrast, 0 outside of the mask, at the two sizes.

    """

    fine: np.ndarray
    coarse: np.ndarray


def detail_of(image: np.ndarray, mask: np.ndarray) -> Detail:
    """The detail of an X-ray.

    Parameters
    ----------
    image
        (H, W), any scale.
    mask
        (H, W) bool, pixels that show the patient.

    """
    return Detail(*(_detail(image, mask, size) for size in (FINE_PX, COARSE_PX)))


def likeness(first: Detail, second: Detail) -> tuple[float, float]:
    """Correlations of fine and of coarse detail, each from 0 to 1, of pictures that may be mirrored or inverted.

    Pictures of other sizes have 0 fine detail in common; those of another shape coarse, too.
    """
    return _correlation(first.fine, second.fine), _correlation(first.coarse, second.coarse)


def _detail(image: np.ndarray, mask: np.ndarray, size: int) -> np.ndarray:
    """Detail at a size, over its local contrast."""
    factor = max(1, -(-max(image.shape) // size))
    height, width = (side // factor * factor for side in image.shape)
    blocks = (height // factor, factor, width // factor, factor)
    values = image[:height, :width].astype(np.float64).reshape(blocks).mean(axis=(1, 3))
    inside = mask[:height, :width].reshape(blocks).all(axis=(1, 3))
    if not inside.any():
        return np.zeros_like(values)
    # Outside lies the nearest pixel of the inside, so that the mask's edge is no detail.
    nearest = ndimage.distance_transform_edt(~inside, return_distances=False, return_indices=True)
    values = values[tuple(np.asarray(nearest))]
    detail = values - ndimage.gaussian_filter(values, _WIDTH_PX)
    contrast = np.sqrt(ndimage.gaussian_filter(detail * detail, 3 * _WIDTH_PX))
    return np.where(inside, detail / (contrast + 1e-3 * detail.std() + 1e-12), 0.0)


def _correlation(first: np.ndarray, second: np.ndarray) -> float:
    """Largest absolute correlation of two details, as they are and mirrored, where both are inside of their masks."""
    if first.shape != second.shape:
        return 0.0
    found = 0.0
    for other in (second, second[:, ::-1]):
        both = (first != 0) & (other != 0)
        if both.mean() < SMALLEST_SHARE:
            continue
        a, b = first[both], other[both]
        found = max(found, abs(float(a @ b)) / max(float(np.sqrt((a @ a) * (b @ b))), 1e-12))
    return found
