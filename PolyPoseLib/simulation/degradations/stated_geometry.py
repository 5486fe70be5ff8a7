"""Distances and spacings that the study states wrongly; the pictures are sound."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from PolyPoseLib.simulation.degradations.degraded_case import DegradedCase, View
from PolyPoseLib.simulation.simulate import structures_centre

DISTANCE_ERROR = 0.12


def distance_wrong(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """The distance from the source to the detector is 12 % too large."""

    def lengthen(view: View, _: int) -> View:
        distance = view.stated.source_to_detector_mm * (1 + DISTANCE_ERROR)
        return replace(view, stated=replace(view.stated, source_to_detector_mm=distance))

    return degraded.with_views(lengthen)


def spacing_at_isocentre(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """The pixel spacing is that at the patient, as calibration by a ball gives it, but stated as the detector's."""
    centre = structures_centre(degraded.case.structures, degraded.case.ct.affine)

    def shrink(view: View, _: int) -> View:
        share = float(view.camera.depth(centre)) / view.stated.source_to_detector_mm
        rows, columns = (spacing * share for spacing in view.stated.pixel_spacing_mm)
        return replace(view, stated=replace(view.stated, pixel_spacing_mm=(rows, columns)))

    return degraded.with_views(shrink)
