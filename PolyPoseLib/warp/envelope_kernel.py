"""The lower envelope of parabolas, compiled with numba (an optional dependency; imported only where it is there)."""

from __future__ import annotations

import numpy as np

from PolyPoseLib.compiled import compiled


@compiled(nogil=True)
def lower_envelope(squared: np.ndarray, step: float, places: np.ndarray, out: np.ndarray) -> None:
    """Fill out (a, p, n) with the minimum over m of squared (a, m, n) + (places[p] - m step)^2.

    P. Felzenszwalb and D. Huttenlocher, "Distance transforms of sampled functions", Theory of Computing 2012:
    one sweep over m builds the envelope, one over the ascending places (p,) reads it. squared may hold infinity.
    """
    layers, count, columns = squared.shape
    apex = np.empty(count, np.int64)
    height = np.empty(count, np.float64)
    border = np.empty(count, np.float64)
    for a in range(layers):
        for n in range(columns):
            top = -1
            for m in range(count):
                value = squared[a, m, n]
                if not np.isfinite(value):
                    continue
                position = m * step
                start = -np.inf
                while top >= 0:
                    before = apex[top] * step
                    start = ((value + position * position) - (height[top] + before * before)) / (
                        2 * (position - before)
                    )
                    if start > border[top]:
                        break
                    top -= 1
                if top < 0:
                    start = -np.inf
                top += 1
                apex[top], height[top], border[top] = m, value, start
            if top < 0:
                for p in range(len(places)):
                    out[a, p, n] = np.inf
                continue
            current = 0
            for p in range(len(places)):
                while current < top and border[current + 1] < places[p]:
                    current += 1
                offset = places[p] - apex[current] * step
                out[a, p, n] = height[current] + offset * offset
