"""Metal and instruments over bones that the X-rays contradict: thin bright objects that the rendering does not have.

Before any bone is placed an object must be brighter than all that the anatomy could show there
(:mod:`PolyPoseLib.registration.fit.foreign_objects`); thin screws and wires over dense anatomy are not. Once the bones
are placed, an object stands out by its own local contrast from what the rendering has nearby. Where bones are found
all the same it is left where it is, as the robust weights do without it: leaving it out would cost the bone's outline.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from scipy.ndimage import (
    binary_erosion,
    gaussian_filter,
    gaussian_gradient_magnitude,
    maximum_filter,
    white_tophat,
)

from PolyPoseLib.registration.fit.foreign_objects import (
    LEVEL,
    THIN_MM,
    grown,
    in_line_integrals,
    left_out,
    sharp_pieces,
)
from PolyPoseLib.registration.fit.levels import Observation, binned, enlarged, pixel_size_mm
from PolyPoseLib.registration.fit.views import LevelViews
from PolyPoseLib.registration.fit.weighting import dilated, mark_shown
from PolyPoseLib.registration.run import Run

REACH_MM = 8.0
"""How far anatomy may be from where it is rendered."""

BONE_REACH_MM = 10.0
"""How far the bones may be from where they are rendered."""

AROUND_MM = 30.0
"""Objects count so far from the bones' projections."""

MARGIN = 1.3
"""How many times the rendering's own thin contrast anatomy may have."""

SURE, POSSIBLE = 0.3, 0.05
"""Local contrasts (line integral) beyond the rendering's from which a pixel starts an object, and continues one. In
clean X-rays they stay below 0.16 anywhere; screws and wires reach 0.3 to 1.2, less where scatter and hardening of the
beam flatten them."""

GAIN_QUANTILE = 95.0
"""Percentile of thin contrasts by which a processed picture's amplification is measured."""

FLAT_GRADIENT = 0.05
"""Change of the line integral from pixel to pixel that any rendering may have."""

SMOOTHING_PX = 0.7


def unexplained_objects(
    run: Run, observation: Observation, poses: np.ndarray, bones: Collection[int]
) -> np.ndarray:
    """Where an X-ray shows thin metal or instruments around some bones.

    Parameters
    ----------
    run : Run
        The patient and the renderer.
    observation : Observation
        The X-ray with its camera.
    poses : (K, 4, 4) ndarray
        Fixed to moving, to within a few millimetres.
    bones : collection of int
        Those that the X-rays contradict.

    Returns
    -------
    (H, W) ndarray
        bool, True where a pixel is to be left out.

    """
    nothing = np.zeros(observation.image.shape, bool)
    if not bones or run.scene.bare:  # it does not explain soft tissue either
        return nothing
    level = LevelViews(run, [observation], LEVEL)
    problem, state = level.posed_structures(poses)
    rendered, parts = problem.render(state, 0)
    pixel_mm = pixel_size_mm(level.views[0].camera, run.scene.anchor_centre)
    factor = observation.image.shape[0] // rendered.shape[0]
    image, mask = binned(observation.image, observation.mask, factor)
    measured = in_line_integrals(image, mask, rendered)
    inner = np.asarray(binary_erosion(mask, iterations=2), dtype=bool)
    if measured is None or not inner.any():
        return nothing
    measured = np.where(mask, measured, np.median(measured[mask]))
    reach, far, thin = (max(1, round(each / pixel_mm)) for each in (REACH_MM, BONE_REACH_MM, THIN_MM))
    contrast, expected = (_thin_contrast(each, thin) for each in (measured, rendered))
    explained = maximum_filter(expected, 2 * reach + 1)
    shows = np.zeros_like(mask)
    for k in bones:
        mark_shown(shows, parts[k])
        alone = np.zeros_like(rendered)
        alone[parts[k].slices] = parts[k].image
        explained = np.maximum(explained, maximum_filter(_thin_contrast(alone, thin), 2 * far + 1))
    amplified, usual = (np.percentile(each[inner], GAIN_QUANTILE) for each in (contrast, expected))
    gain = max(float(amplified / max(usual, 1e-6)), 1.0)
    excess = np.where(inner, contrast / gain - MARGIN * explained, -1.0)
    steepest = maximum_filter(gaussian_gradient_magnitude(rendered, SMOOTHING_PX), 2 * reach + 1)
    edges = gaussian_gradient_magnitude(measured, SMOOTHING_PX) / gain / np.maximum(steepest, FLAT_GRADIENT)
    found = np.zeros_like(mask)
    for where, piece in sharp_pieces(grown(excess > SURE, excess > POSSIBLE), np.where(inner, edges, 0)):
        found[where] |= piece
    found &= dilated(shows, AROUND_MM / pixel_mm)
    return enlarged(left_out(found, mask, pixel_mm), factor, observation.image.shape)


def _thin_contrast(image: np.ndarray, thin_px: int) -> np.ndarray:
    """(H, W) how much brighter a pixel is than what lies on both sides of it."""
    return np.asarray(white_tophat(gaussian_filter(image, SMOOTHING_PX), 2 * thin_px + 1))
