"""From pixel values to line integrals: what a value means, and the conversion.

A line integral is -log(I / I0), unitless: 0 where nothing stood in the beam, larger behind bone. A pixel
value v has one of five meanings (the first four may be given as the field "intensity"):

- "transmission": v is proportional to the beam's intensity. I0 is the field "unattenuated", or the
  99.9th percentile of the usable pixels, which is the direct beam where the image shows any and otherwise
  only the brightest tissue: then every line integral is too low by one constant, which similarities ignore.
  I is clamped from half a stored step to I0.
- "log_transmission": v falls linearly with the line integral. Its scale is unknown: the 0.1th to
  99.9th percentiles are mapped to 5 to 0.
- "attenuation": v rises linearly with the line integral, mapped from 0 to 5 likewise.
- "line_integral": v is the line integral.
- "inverse_transmission" (from tags only): the largest value minus v is proportional to the intensity.
"""

from __future__ import annotations

import numpy as np

from PolyPoseLib.data.notes import Notes
from PolyPoseLib.errors import InputError

INTENSITIES = ("attenuation", "transmission", "log_transmission", "line_integral")
"""Values of the field "intensity" (or "polarity")."""

NOMINAL_SPAN = 5.0
"""Line integral that the brightest bone of an image without a physical scale is given."""


def line_integrals(
    values: np.ndarray,
    usable: np.ndarray,
    meaning: str,
    notes: Notes,
    *,
    unattenuated: float | None = None,
    step: float = 0.0,
    largest: float | None = None,
) -> np.ndarray:
    """Convert pixel values to line integrals (H, W) float32, unitless.

    Parameters
    ----------
    values
        (H, W) pixel values.
    usable
        (H, W) bool, pixels inside shutters and borders; only they count.
    meaning
        One of the meanings in this module's description.
    notes
        Receives I0 or the scale.
    unattenuated
        I0, the value of the direct beam, for "transmission".
    step
        Difference between neighbouring stored values; 0 for real numbers.
    largest
        Value that "inverse_transmission" counts from; the largest usable one when None.

    Raises
    ------
    InputError
        A constant image, no positive intensity, or I0 that is not above 0.

    """
    seen = values[usable]
    if seen.size == 0 or np.ptp(seen) == 0:
        raise InputError(
            f"{notes.where} is constant: it shows nothing; give the image that shows the patient."
        )
    if meaning == "line_integral":
        notes.say("line integrals: the values themselves")
        if seen.max() > 50 or seen.min() < -5:
            notes.warn(
                f"values from {seen.min():.4g} to {seen.max():.4g} are unusual for line integrals (0 to about 15); "
                'if they are gray values, add "intensity": "attenuation" or "transmission".'
            )
        return values.astype(np.float32)
    if meaning in ("attenuation", "log_transmission"):
        return _affine(values, seen, meaning, notes)
    if meaning == "inverse_transmission":
        top = float(seen.max()) if largest is None else largest
        notes.say(f"intensity counted down from {top:g}")
        values, seen = top - values, top - seen
    return _negative_log(values, seen, notes, unattenuated, step)


def _affine(values: np.ndarray, seen: np.ndarray, meaning: str, notes: Notes) -> np.ndarray:
    """Scale values that are linear in the line integral but without a unit."""
    low, high = (float(edge) for edge in np.percentile(seen, (0.1, 99.9)))
    if high <= low:
        low, high = float(seen.min()), float(seen.max())
    notes.say(
        f"line integrals: affine, {low:g} to {high:g} as {'0 to 5' if meaning == 'attenuation' else '5 to 0'}"
    )
    scaled = (values - low) if meaning == "attenuation" else (high - values)
    return (scaled * (NOMINAL_SPAN / (high - low))).astype(np.float32)


def _negative_log(
    values: np.ndarray, seen: np.ndarray, notes: Notes, unattenuated: float | None, step: float
) -> np.ndarray:
    """-log(I / I0), I clamped from half a step to I0."""
    direct = float(np.percentile(seen, 99.9)) if unattenuated is None else unattenuated
    if not direct > 0:
        raise InputError(
            f"{notes.where} has no positive intensity to take a logarithm of; if its bone is bright, add "
            '"intensity": "attenuation".'
        )
    source = "99.9th percentile, an estimate" if unattenuated is None else "given"
    notes.say(f"line integrals: -log(I / I0), I0 = {direct:.6g} ({source})")
    floor = max(step / 2, direct * np.exp(-12.0))
    starved = float(np.mean(seen < floor))
    if starved > 0.01:
        notes.warn(f"{starved:.0%} of the usable pixels hold no signal; their line integrals are clamped.")
    return -np.log(np.clip(values, floor, direct).astype(np.float64) / direct).astype(np.float32)
