"""Local normalisation of an image and of its changes, one pass over its patches each.

See :class:`PolyPoseLib.similarity.local_contrast.LocalContrast`, which runs these loops where numba is installed.
"""

import numba
import numpy as np

from PolyPoseLib.compiled import compiled
from PolyPoseLib.similarity.patch_kernels import box_sums

FAST = {"nsz", "arcp", "contract", "afn", "reassoc"}
"""Fast arithmetic in which what is not a number stays so."""


@compiled(fastmath=FAST)
def normalise(image, mask, share, support, least_variance, size, values, centred, mean, deviation):
    """Normalise an image.

    Parameters
    ----------
    image
        (H, W) float32 line integrals.
    mask, share, support
        (H, W) float32, as in LocalContrast.
    least_variance
        (H, W) float64, added to the variance of every patch.
    size
        Odd patch width in pixels.
    values, centred, mean, deviation
        (H, W) float32, overwritten.

    """
    height, width = image.shape
    total, count = 0.0, 0.0
    for r in range(height):
        for c in range(width):
            if mask[r, c] > 0:
                total += image[r, c]
                count += mask[r, c]
    average = total / max(count, 1.0)
    # Outside the mask the image is 0, which is -average once centred, and patches leave it out.
    part, squares = np.empty((height, width)), np.empty((height, width))
    for r in range(height):
        for c in range(width):
            value = image[r, c] - average if mask[r, c] > 0 else 0.0
            part[r, c] = value
            squares[r, c] = value * value
            centred[r, c] = value if mask[r, c] > 0 else -average
    sums, square_sums = np.empty((height, width)), np.empty((height, width))
    between = np.empty((height, width))
    window = (0, height, 0, width)
    box_sums(part, (0, 0), size // 2, window, between, sums)
    box_sums(squares, (0, 0), size // 2, window, between, square_sums)
    area = float(size * size)
    for r in range(height):
        for c in range(width):
            scale = 1.0 / (area * share[r, c])
            middle = sums[r, c] * scale
            spread = np.sqrt(max(square_sums[r, c] * scale - middle * middle, 0.0) + least_variance[r, c])
            values[r, c] = (part[r, c] - middle) / spread * support[r, c]
            mean[r, c], deviation[r, c] = middle, spread


@compiled(parallel=True, fastmath=FAST)
def differentiate(image, changes, window, mask, share, support, size, grown, changed):
    """Derivatives of a normalised image by changes of the image.

    Parameters
    ----------
    image
        (values, centred, mean, deviation), (H, W) float32 each, as :func:`normalise` fills them.
    changes
        (C, h, w) float32, inside a window, zero elsewhere.
    window
        Row 0, row 1, column 0, column 1 of it.
    mask, share, support
        (H, W) float32, as in LocalContrast.
    size
        Odd patch width in pixels.
    grown
        The window grown by half a patch, inside the image.
    changed
        (C, rows, columns) float32 of the grown window, overwritten.

    """
    values, centred, mean, deviation = image
    rows, columns = changed.shape[1:]
    height, width = changes.shape[1:]
    area = float(size * size)
    first = (window[0], window[2])
    for n in numba.prange(len(changes)):
        change, product = np.empty((height, width)), np.empty((height, width))
        for r in range(height):
            for c in range(width):
                row, column = window[0] + r, window[2] + c
                change[r, c] = changes[n, r, c] * mask[row, column]
                product[r, c] = change[r, c] * centred[row, column]
        between = np.empty((height, columns))
        averages, products = np.empty((rows, columns)), np.empty((rows, columns))
        box_sums(change, first, size // 2, grown, between, averages)
        box_sums(product, first, size // 2, grown, between, products)
        for r in range(rows):
            for c in range(columns):
                row, column = grown[0] + r, grown[2] + c
                inside = window[0] <= row < window[1] and window[2] <= column < window[3]
                own = changes[n, row - window[0], column - window[2]] if inside else 0.0
                scale, spread = 1.0 / (area * share[row, column]), deviation[row, column]
                average = averages[r, c] * scale
                slope = (products[r, c] * scale - mean[row, column] * average) / (spread * spread)
                result = (own - average) / spread - values[row, column] * slope
                changed[n, r, c] = result * support[row, column]
