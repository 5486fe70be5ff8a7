"""From which slices of a CT a slice of the warped CT was computed."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.io.dicom_export.source import SourceImage, SourceSeries

LATTICE_MM = 8.0
"""Distance of the points of a slice at which it is asked; displacements are smooth."""

SlicesBehind = Callable[[int], Sequence[SourceImage]]
"""The slices of the CT behind a warped slice, by its number k from 0."""


def slices_behind(source: SourceSeries, warped: Volume, transform: DisplacementField) -> SlicesBehind:
    """The slices that the transform reaches from each slice of the warped CT, and one more on either side.

    Parameters
    ----------
    source
        The CT's series.
    warped
        The grid of the warped CT.
    transform
        From fixed to moving points, LPS mm.

    Returns
    -------
    callable
        Gives the slices by k, in ascending order along the CT's normal; none where the transform leaves the CT.

    """
    places = np.array([each.along_mm for each in source.images])
    columns, rows = (_lattice(n, s) for n, s in zip(warped.shape[:0:-1], warped.spacing[:2], strict=True))
    across = np.stack(np.meshgrid(columns, rows, indexing="ij"), axis=-1).reshape(-1, 2)

    def behind(k: int) -> Sequence[SourceImage]:
        points = warped.to_world(np.column_stack([across, np.full(len(across), k)]))
        along = transform(points) @ source.normal
        margin = 1.001 * source.step_mm
        first, last = np.searchsorted(places, [along.min() - margin, along.max() + margin])
        return source.images[first:last]

    return behind


def _lattice(count: int, spacing_mm: float) -> np.ndarray:
    """Indices along an axis, both ends among them, no farther apart than LATTICE_MM."""
    steps = max(2, int(np.ceil((count - 1) * spacing_mm / LATTICE_MM)) + 1)
    return np.linspace(0, count - 1, steps)
