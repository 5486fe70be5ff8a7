"""Letters: of lead on the detector's cover, and burned into the picture by a workstation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from PolyPoseLib.simulation.degradations.degraded_case import DegradedCase, View, grey_levels, with_grey
from PolyPoseLib.simulation.degradations.lettering import draw_text

LETTER_MM = 22.0
LEAD_LINE = 8.0
"""Line integral of 1.6 mm of lead."""


def lead_letters(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """A side letter and a number of lead on the detector, placed anew for every exposure."""
    letter = str(rng.choice(["R", "L"]))

    def mark(view: View, number: int) -> View:
        height, width = view.line.shape
        size = LETTER_MM / view.stated.pixel_spacing_mm[0]
        side = rng.uniform(0.1, 0.22) if letter == "R" else rng.uniform(0.78, 0.9)
        place = rng.uniform(0.12, 0.3) * height, side * width
        line = draw_text((height, width), letter, place, size, rng.uniform(-12, 12))
        below = place[0] + 1.3 * size, place[1] + 0.2 * size
        line = np.maximum(
            line, draw_text((height, width), f"{10 + number}", below, 0.5 * size, rng.uniform(-8, 8))
        )
        return replace(view, line=view.line + LEAD_LINE * line)

    return degraded.with_views(mark)


def burned_text(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """Name, settings and a side letter written into the 8-bit picture, as screen captures have them."""
    minute = int(rng.integers(10, 59))

    def write(view: View, number: int) -> View:
        grey = grey_levels(view).copy()
        height, width = grey.shape
        size = 0.026 * height
        lines = [
            f"SIMULATED {100 + number}",
            f"AP {60 + 4 * number} KV 12 MAS",
            f"10:{minute + number:02d}:07",
        ]
        texts = [
            (text, (2.2 * size * (n + 1), (0.02 + 0.0115 * len(text)) * width), size)
            for n, text in enumerate(lines)
        ]
        texts += [
            ("L", (0.5 * height, 0.95 * width), 2.5 * size),
            ("IM 1 - 2", (0.97 * height, 0.88 * width), size),
        ]
        for text, place, tall in texts:
            grey = np.maximum(grey, draw_text(grey.shape, text, place, tall))
        ticks = np.arange(0.3, 0.7, 0.05) * height
        for tick in ticks.astype(int):
            grey[tick : tick + 2, int(0.015 * width) : int(0.035 * width)] = 1
        return with_grey(view, grey, 8)

    return degraded.with_views(write)
