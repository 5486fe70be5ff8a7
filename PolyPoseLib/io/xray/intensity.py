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

from dataclasses import dataclass

import numpy as np

from PolyPoseLib.data.notes import Notes
from PolyPoseLib.errors import InputError

INTENSITIES = ("attenuation", "transmission", "log_transmission", "line_integral")
"""Values of the field "intensity" (or "polarity")."""

NOMINAL_SPAN = 5.0
"""Line integral that the brightest bone of an image without a physical scale is given."""


@dataclass(frozen=True)
class Conversion:
    """From pixel values to line integrals, with its numbers settled: images of one run are converted alike.

    Attributes
    ----------
    low, high
        The line integral is ``(value - low) * slope``, where ``direct`` is None.
    slope
        Line integral of one pixel value; below 0 where values fall behind bone.
    direct
        I0: the line integral is ``-log(I / direct)``.
    floor
        Least intensity I that is told from none.
    top
        Value from which intensity counts down; None where it rises with the values.

    """

    low: float = 0.0
    slope: float = 1.0
    direct: float | None = None
    floor: float = 0.0
    top: float | None = None

    def apply(self, values: np.ndarray) -> np.ndarray:
        """Line integrals (H, W) float32, unitless, of pixel values (H, W)."""
        if self.direct is not None:
            beam = values if self.top is None else self.top - values
            clamped = np.clip(beam, self.floor, self.direct).astype(np.float64)
            return -np.log(clamped / self.direct).astype(np.float32)
        if (self.low, self.slope) == (0.0, 1.0):
            return values.astype(np.float32)
        return ((values - self.low) * self.slope).astype(np.float32)


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
    conversion = conversion_of(
        values[usable], meaning, notes, unattenuated=unattenuated, step=step, largest=largest
    )
    return conversion.apply(values)


def conversion_of(
    seen: np.ndarray,
    meaning: str,
    notes: Notes,
    *,
    unattenuated: float | None = None,
    step: float = 0.0,
    largest: float | None = None,
) -> Conversion:
    """How pixel values become line integrals, from usable pixels (N,) of one image or of several of one run.

    The other parameters and the errors are those of `line_integrals`.
    """
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
        return Conversion()
    if meaning in ("attenuation", "log_transmission"):
        return _affine(seen, meaning, notes)
    top = None
    if meaning == "inverse_transmission":
        top = float(seen.max()) if largest is None else largest
        notes.say(f"intensity counted down from {top:g}")
        seen = top - seen
    return _negative_log(seen, top, notes, unattenuated, step)


def _affine(seen: np.ndarray, meaning: str, notes: Notes) -> Conversion:
    """Scale values that are linear in the line integral but without a unit."""
    low, high = (float(edge) for edge in np.percentile(seen, (0.1, 99.9)))
    if high <= low:
        low, high = float(seen.min()), float(seen.max())
    notes.say(
        f"line integrals: affine, {low:g} to {high:g} as {'0 to 5' if meaning == 'attenuation' else '5 to 0'}"
    )
    scale = NOMINAL_SPAN / (high - low)
    return Conversion(low, scale) if meaning == "attenuation" else Conversion(high, -scale)


def _negative_log(
    seen: np.ndarray, top: float | None, notes: Notes, unattenuated: float | None, step: float
) -> Conversion:
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
    return Conversion(direct=direct, floor=floor, top=top)
