"""Costs and normal equations of many images that differ from one background inside a window each.

The residual is that of :class:`PolyPoseLib.similarity.local_contrast.LocalContrast`. Outside of its window, grown by
half a patch, an image is normalised as the background is: only the window is gone through, image by image.
"""

import numba
import numpy as np

from PolyPoseLib.compiled import compiled
from PolyPoseLib.similarity.patch_kernels import differentiate_patches, normalise_patches

UNKNOWNS = 6


@numba.njit(fastmath=True)
def _grown(window, by, shape):
    """A window grown to all sides, inside an image."""
    return (
        max(window[0] - by, 0),
        min(window[1] + by, shape[0]),
        max(window[2] - by, 0),
        min(window[3] + by, shape[1]),
    )


@numba.njit(fastmath=True)
def _normalised(image, view, outer, inner, values, mean, deviation):
    """Fill the normalised values, patch means and standard deviations of a window.

    image: (H, W); outer: the part of it that inner's patches reach, whose masked values are returned.
    """
    part = np.empty((outer[1] - outer[0], outer[3] - outer[2]))
    for r in range(outer[0], outer[1]):
        for c in range(outer[2], outer[3]):
            inside = view.mask[r, c] > 0
            part[r - outer[0], c - outer[2]] = view.background[r, c] + image[r, c] if inside else 0.0
    rows, columns = slice(inner[0], inner[1]), slice(inner[2], inner[3])
    normalise_patches(
        part, (outer[0], outer[2]), inner, view.share[rows, columns], view.support[rows, columns],
        view.least_variance[rows, columns], view.size, values, mean, deviation,
    )  # fmt: skip
    return part


@numba.njit(fastmath=True)
def _window_cost(view, inner, values):
    """Cost of the window less what the background costs there."""
    cost = 0.0
    for r in range(inner[1] - inner[0]):
        for c in range(inner[3] - inner[2]):
            row, column = inner[0] + r, inner[2] + c
            residual = values[r, c] - view.target[row, column]
            cost += view.weight[row, column] * residual * residual - view.background_cost[row, column]
    return cost


@compiled(parallel=True, fastmath=True)
def costs_of_images(images, windows, view, costs):
    """Sums of weighted squared residuals.

    Parameters
    ----------
    images
        (S, H, W) float32 line integrals that are added to the background.
    windows
        (S, 4) row 0, row 1, column 0, column 1 outside of which an image is zero.
    view
        :class:`PolyPoseLib.similarity.contrast_kernel_arguments.ContrastView`.
    costs
        (S,), added to.

    """
    for n in numba.prange(len(images)):
        window = windows[n]
        if window[1] <= window[0] or window[3] <= window[2]:
            costs[n] += view.total
            continue
        half = view.size // 2
        inner = _grown(window, half, view.mask.shape)
        outer = _grown(inner, half, view.mask.shape)
        shape = (inner[1] - inner[0], inner[3] - inner[2])
        values, mean, deviation = np.empty(shape), np.empty(shape), np.empty(shape)
        _normalised(images[n], view, outer, inner, values, mean, deviation)
        costs[n] += view.total + _window_cost(view, inner, values)


@compiled(parallel=True, fastmath=True)
def normals_of_images(images, jacobians, windows, view, costs, matrices, gradients):
    """As :func:`costs_of_images`, with the Gauss-Newton normal equations of half the cost.

    jacobians: (S, 6, H, W) float32 derivatives of the images, zero outside the windows; matrices: (S, 6, 6) and
    gradients: (S, 6), added to.
    """
    for n in numba.prange(len(images)):
        window = windows[n]
        if window[1] <= window[0] or window[3] <= window[2]:
            costs[n] += view.total
            continue
        half = view.size // 2
        inner = _grown(window, half, view.mask.shape)
        outer = _grown(inner, half, view.mask.shape)
        rows, columns = inner[1] - inner[0], inner[3] - inner[2]
        shape = (rows, columns)
        values, mean, deviation = np.empty(shape), np.empty(shape), np.empty(shape)
        part = _normalised(images[n], view, outer, inner, values, mean, deviation)
        costs[n] += view.total + _window_cost(view, inner, values)
        changes = np.empty((UNKNOWNS, rows, columns), np.float32)
        mask = view.mask[window[0] : window[1], window[2] : window[3]]
        share = view.share[inner[0] : inner[1], inner[2] : inner[3]]
        support = view.support[inner[0] : inner[1], inner[2] : inner[3]]
        centred = part[
            window[0] - outer[0] : window[1] - outer[0], window[2] - outer[2] : window[3] - outer[2]
        ]
        for a in range(UNKNOWNS):
            differentiate_patches(
                jacobians[n, a, window[0] : window[1], window[2] : window[3]], mask, centred,
                (window[0], window[2]), inner, share, support, view.size, values, mean, deviation, changes[a],
            )  # fmt: skip
        _add_products(changes, values, view, inner, matrices[n], gradients[n])


@numba.njit(fastmath=True)
def _add_products(changes, values, view, inner, matrix, gradient):
    """Add the sums over pixels of weighted products of derivatives with each other and with the residual."""
    sums = np.zeros((UNKNOWNS, UNKNOWNS + 1))
    own = np.empty(UNKNOWNS)
    for r in range(values.shape[0]):
        for c in range(values.shape[1]):
            row, column = inner[0] + r, inner[2] + c
            weight = view.weight[row, column]
            if weight == 0.0:
                continue
            for a in range(UNKNOWNS):
                own[a] = changes[a, r, c]
            residual = values[r, c] - view.target[row, column]
            for a in range(UNKNOWNS):
                weighted = weight * own[a]
                sums[a, UNKNOWNS] += weighted * residual
                for b in range(a + 1):
                    sums[a, b] += weighted * own[b]
    for a in range(UNKNOWNS):
        gradient[a] += sums[a, UNKNOWNS]
        for b in range(a + 1):
            matrix[a, b] += sums[a, b]
            if a != b:
                matrix[b, a] += sums[a, b]
