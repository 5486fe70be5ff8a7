"""Pixels that a display window or a saturated detector clipped: all black or all white, whatever lies there.

The rendering has detail where such pixels have none, and the fit would move bones to make it vanish: they are left out.
Nothing in a patient is that uniform, but the direct beam is: it looks the same in the rendering and bounds the patient.
A plateau is therefore clipped where it reaches into the patient.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.ndimage import maximum_filter, minimum_filter

from PolyPoseLib.registration.fit.levels import Level, Observation, enlarged, pixel_size_mm
from PolyPoseLib.registration.fit.views import LevelViews
from PolyPoseLib.registration.run import Run

LEVEL = Level(4.0, 14.0, 0)
"""Resolution at which tissue is looked for."""

TOLERANCE = 1e-4
"""Of the range of values, within which one equals the extreme."""

LEAST_DENSE, LEAST_LIGHT = 0.01, 0.04
"""Shares of an X-ray inside the patient that are clipped at the dense end and at the other. Windows clipped 1.8 % or
more and 4.6 % or more, unsharp masking up to 0.8 % at the dense end; up to 2.6 % was direct beam beside an arm that is
not where the CT has it."""

LARGEST_SHARE = 0.6
"""Of an X-ray; where more seems to be clipped, nothing is left out."""

TISSUE, REACH_MM = 0.5, 20.0
"""Line integral that shows the patient (some 25 mm of soft tissue), and how far the camera may put the patient from
where it is."""

FINEST = 400
"""Pixels along an X-ray's longer side at which a plateau is at least 3 x 3 pixels large; smaller parts are noise."""


def clipped_pixels(run: Run, observation: Observation) -> np.ndarray:
    """Where an X-ray's values are clipped.

    Parameters
    ----------
    run : Run
        The patient, at rest, and the renderer.
    observation : Observation
        The X-ray with its camera.

    Returns
    -------
    (H, W) ndarray
        bool, True where a pixel is to be left out.

    """
    image, mask = observation.image, observation.mask
    clipped = np.zeros(image.shape, bool)
    low, high = float(image[mask].min()), float(image[mask].max())
    tolerance = TOLERANCE * (high - low)
    inside: np.ndarray | None = None
    for extreme, share in ((high, LEAST_DENSE), (low, LEAST_LIGHT)):
        least = share * mask.sum()
        plateau = mask & (np.abs(image - extreme) <= tolerance)
        if plateau.sum() < least:
            continue
        uniform = _opened(plateau)
        if uniform.sum() < least:
            continue
        if inside is None:  # rendered once, and only where there is a plateau
            inside = _inside_patient(run, observation)
        if (uniform & inside).sum() >= least:
            clipped |= plateau
    if clipped.sum() > LARGEST_SHARE * mask.sum():
        clipped[:] = False
    return clipped


def without_clipped(run: Run, observation: Observation) -> Observation:
    """The X-ray with clipped pixels left out of its mask, and told apart in ``clipped``."""
    found = clipped_pixels(run, observation)
    if not found.any():
        return observation
    return replace(observation, mask=observation.mask & ~found, clipped=found)


def _opened(plateau: np.ndarray) -> np.ndarray:
    """(H, W) bool: the parts of a plateau into which a square of pixels fits."""
    size = 2 * max(1, round(max(plateau.shape) / FINEST)) + 1
    return maximum_filter(minimum_filter(plateau, size), size)


def _inside_patient(run: Run, observation: Observation) -> np.ndarray:
    """(H, W) bool: where the CT at rest has tissue, wherever within reach the camera is."""
    level = LevelViews(run, [observation], LEVEL)
    whole = level.whole_ct()
    rendered, _ = whole.render(level.at_rest(1), 0)
    pixel_mm = pixel_size_mm(level.views[0].camera, run.scene.anchor_centre)
    size = 2 * round(REACH_MM / pixel_mm) + 1
    inside = minimum_filter(rendered > TISSUE, size)
    return enlarged(inside, observation.image.shape[0] // inside.shape[0], observation.image.shape)
