"""Coefficients of the exponential of se(3) as polynomials of the squared angle (numba).

Exact to float32 up to 180 degrees, and without branches, so that loops over them become vector instructions.
"""

from __future__ import annotations

import math

import numba
import numpy as np

_TERMS = 9


def series(first: int) -> list[np.float32]:
    """Coefficients of sum_n (-x)^n / (2 n + first)!, nine terms."""
    return [np.float32((-1) ** n / math.factorial(2 * n + first)) for n in range(_TERMS)]


def slope(coefficients: list[np.float32]) -> list[np.float32]:
    """Coefficients of a power series' derivative, filled up with a zero."""
    return [*(np.float32(n * c) for n, c in enumerate(coefficients[1:], start=1)), np.float32(0)]


def polynomial(coefficients: list[np.float32]):
    """Compile Horner's rule for nine constants."""
    a, b, c, d, e, f, g, h, k = coefficients

    @numba.njit(fastmath=True)
    def value(x):
        return a + x * (b + x * (c + x * (d + x * (e + x * (f + x * (g + x * (h + x * k)))))))

    return value


sinc = polynomial(series(1))
"""sin t / t of t^2."""

versine = polynomial(series(2))
"""(1 - cos t) / t^2 of t^2."""

cubic = polynomial(series(3))
"""(t - sin t) / t^3 of t^2."""
