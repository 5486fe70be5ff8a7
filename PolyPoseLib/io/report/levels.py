"""The history of the similarity, taken apart into what compares with each other: one curve per resolution level."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

LEAST_SPAN = 0.002
"""Of a panel's scale: less would blow up rounding into curves."""


@dataclass(frozen=True)
class LevelCurve:
    """The similarity during one level.

    Attributes
    ----------
    stage : str
        As the progress names it.
    level_mm : float or None
        Size of the level's pixels in the patient, None where it is not known.
    values : (N,) array
        One or more similarities, finite.

    """

    stage: str
    level_mm: float | None
    values: np.ndarray

    @property
    def title(self) -> str:
        """Stage and level."""
        return self.stage if self.level_mm is None else f"{self.stage}, {self.level_mm:.2g} mm"

    @property
    def summary(self) -> str:
        """First and last value, in words."""
        first, last, steps = self.values[0], self.values[-1], len(self.values)
        if steps == 1:
            return f"{first:.4f}, 1 iteration"
        return f"{first:.4f} to {last:.4f}, {steps} iterations"

    @property
    def limits(self) -> tuple[float, float]:
        """Lower and upper end of the panel's scale."""
        low, high = float(self.values.min()), float(self.values.max())
        span = max(high - low, LEAST_SPAN)
        middle = (low + high) / 2
        return middle - 0.6 * span, middle + 0.6 * span


def level_curves(history: Iterable[Mapping[str, Any]]) -> list[LevelCurve]:
    """One curve for each level of a result's history, in order.

    Results of earlier versions do not name levels; there, a level begins where iterations are skipped or start anew.
    """
    runs: list[tuple[tuple[str, Any], list[float]]] = []
    previous: tuple[Any, Any] = (None, None)
    for step in history:
        stage, value = str(step.get("stage", "")), step.get("similarity")
        if stage == "done":
            continue
        key, at = (stage, step.get("level_mm")), step.get("iteration")
        goes_on = previous[0] == key
        if goes_on and key[1] is None and isinstance(at, int) and isinstance(previous[1], int):
            goes_on = at == previous[1] + 1
        if not goes_on:
            runs.append((key, []))
        previous = (key, at)
        if value is not None and np.isfinite(value):
            runs[-1][1].append(float(value))
    return [LevelCurve(stage, level, np.array(values)) for (stage, level), values in runs if values]
