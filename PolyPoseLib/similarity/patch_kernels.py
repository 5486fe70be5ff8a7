"""Local normalisation of a part of an image, and its derivative, for the compiled loops that need either.

Of a part of an image, what is written to is the rows and columns of a window, within half a patch around it.
"""

import numba
import numpy as np

FAST = {"nsz", "arcp", "contract", "afn", "reassoc"}
"""Fast arithmetic in which what is not a number stays so."""


@numba.njit(fastmath=True)
def box_sums(values, first, half, window, between, sums):
    """Sums over patches of 2 half + 1 pixels a side, zeros beyond the border.

    values: of the image's part that begins at the row and column ``first``; window: rows and columns of the image for
    which sums are wanted, no more than half a patch away from that part's border unless that is the image's; between:
    scratch like values; sums: (rows, columns) of the window, overwritten.
    """
    height, width = values.shape
    row0, column0 = window[0] - first[0], window[2] - first[1]
    rows, columns = window[1] - window[0], window[3] - window[2]
    for r in range(height):
        total = 0.0
        for c in range(max(column0 - half, 0), min(column0 + half, width)):
            total += values[r, c]
        for c in range(columns):
            entering, leaving = column0 + c + half, column0 + c - half - 1
            if entering < width:
                total += values[r, entering]
            if leaving >= 0:
                total -= values[r, leaving]
            between[r, c] = total
    for c in range(columns):
        sums[0, c] = 0.0
    for r in range(max(row0 - half, 0), min(row0 + half + 1, height)):
        for c in range(columns):
            sums[0, c] += between[r, c]
    for r in range(1, rows):
        entering, leaving = row0 + r + half, row0 + r - half - 1
        for c in range(columns):
            total = sums[r - 1, c]
            if entering < height:
                total += between[entering, c]
            if leaving >= 0:
                total -= between[leaving, c]
            sums[r, c] = total


@numba.njit(fastmath=FAST)
def normalise_patches(part, first, window, share, support, least_variance, size, values, mean, deviation):
    """Fill the normalised values, patch means and standard deviations (float64) of a window.

    part: masked values of the image's part that begins at the row and column ``first``, see :func:`box_sums`; share,
    support, least_variance: of the window; size: odd patch width.
    """
    between = np.empty(part.shape)
    box_sums(part, first, size // 2, window, between, mean)
    box_sums(part * part, first, size // 2, window, between, deviation)
    area = float(size * size)
    for r in range(values.shape[0]):
        for c in range(values.shape[1]):
            scale = 1.0 / (area * share[r, c])
            average = mean[r, c] * scale
            variance = max(deviation[r, c] * scale - average * average, 0.0)
            spread = np.sqrt(variance + least_variance[r, c])
            mean[r, c], deviation[r, c] = average, spread
            own = part[window[0] - first[0] + r, window[2] - first[1] + c]
            values[r, c] = (own - average) / spread * support[r, c]


@numba.njit(fastmath=FAST)
def differentiate_patches(
    change, mask, centred, first, window, share, support, size, values, mean, deviation, changed
):  # fmt: skip
    """Fill the changes of a window's normalised values.

    change, mask, centred: the image's change, its mask, and its values less a constant, of the part that begins at the
    row and column ``first`` and outside of which nothing changes; share, support, and values, mean, deviation as
    :func:`normalise_patches` fills them: of the window, which is the part grown by half a patch inside the image.
    """
    height, width = change.shape
    masked, product = np.empty((height, width)), np.empty((height, width))
    for r in range(height):
        for c in range(width):
            masked[r, c] = change[r, c] * mask[r, c]
            product[r, c] = masked[r, c] * centred[r, c]
    rows, columns = changed.shape
    between = np.empty((height, columns))
    averages, products = np.empty((rows, columns)), np.empty((rows, columns))
    box_sums(masked, first, size // 2, window, between, averages)
    box_sums(product, first, size // 2, window, between, products)
    area = float(size * size)
    for r in range(rows):
        for c in range(columns):
            row, column = window[0] - first[0] + r, window[2] - first[1] + c
            own = change[row, column] if 0 <= row < height and 0 <= column < width else 0.0
            scale, spread = 1.0 / (area * share[r, c]), deviation[r, c]
            average = averages[r, c] * scale
            slope = (products[r, c] * scale - mean[r, c] * average) / (spread * spread)
            changed[r, c] = ((own - average) / spread - values[r, c] * slope) * support[r, c]
