"""Local normalisation of an image and of its changes, one pass over its patches each.

See :class:`PolyPoseLib.similarity.local_contrast.LocalContrast`, which runs these loops where numba is installed.
"""

import numba
import numpy as np

from PolyPoseLib.compiled import compiled
from PolyPoseLib.similarity.patch_kernels import FAST, differentiate_patches, normalise_patches


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
    part = np.empty((height, width))
    for r in range(height):
        for c in range(width):
            part[r, c] = image[r, c] - average if mask[r, c] > 0 else 0.0
            centred[r, c] = part[r, c] if mask[r, c] > 0 else -average
    exact = np.empty((3, height, width))
    window = (0, height, 0, width)
    normalise_patches(
        part, (0, 0), window, share, support, least_variance, size, exact[0], exact[1], exact[2]
    )  # fmt: skip
    values[:], mean[:], deviation[:] = exact[0], exact[1], exact[2]


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
    row0, row1, column0, column1 = grown
    share, support = share[row0:row1, column0:column1], support[row0:row1, column0:column1]
    values, mean = values[row0:row1, column0:column1], mean[row0:row1, column0:column1]
    deviation = deviation[row0:row1, column0:column1]
    first = (window[0], window[2])
    mask = mask[first[0] : window[1], first[1] : window[3]]
    centred = centred[first[0] : window[1], first[1] : window[3]]
    for n in numba.prange(len(changes)):
        differentiate_patches(
            changes[n], mask, centred, first, grown, share, support, size, values, mean, deviation, changed[n]
        )
