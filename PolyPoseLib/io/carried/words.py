"""What is said of carried points, in files and on the console."""

from __future__ import annotations

from collections import Counter

import numpy as np

from PolyPoseLib.data.carried import CarriedPoints, half_axes_mm

NOT_TRUSTED = "NOT TO BE TRUSTED: see result.json"
"""Written into carried files, where they have room, if the result must not be trusted."""


def point_words(carried: CarriedPoints, n: int, warning: str = "") -> str:
    """About one point: what moved it, its 95 % ellipsoid, a warning; without commas, which some formats separate by."""
    said = f"moved by {carried.moved_by[n].replace(',', ' ')}"
    covariance = carried.covariances[n]
    if np.isfinite(covariance).all():
        axes = " x ".join(f"{each:.1f}" for each in half_axes_mm(covariance))
        upper = " ".join(f"{covariance[place]:.4g}" for place in zip(*np.triu_indices(3), strict=True))
        said += f"; 95 % ellipsoid of half axes {axes} mm; covariance xx xy xz yy yz zz (LPS mm^2) {upper}"
    said += "" if carried.inside[n] else "; outside of the transform's grid"
    return f"{said}; {warning}" if warning else said


def summary(carried: CarriedPoints, what: str = "points") -> str:
    """About all points, for the console."""
    moved = ", ".join(f"{count} by {name}" for name, count in Counter(carried.moved_by).most_common())
    said = f"{len(carried.points)} {what}: {moved}"
    axes = carried.semi_axes_mm[:, 2]
    if np.isfinite(axes).any():
        said += (
            f"; longest half axis of the 95 % ellipsoids: median {np.nanmedian(axes):.1f} mm, "
            f"largest {np.nanmax(axes):.1f} mm"
        )
    outside = int(np.count_nonzero(~carried.inside))
    return said + (f"; {outside} outside of the transform's grid, extrapolated" if outside else "")
