"""What a running registration tells its caller."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Progress:
    """One step of a run.

    stage: name of the step of the registration, such as "camera ap" or "joint 4 mm".
    iteration, of: how far the stage is, 0 <= iteration <= of.
    similarity: mean similarity over the views in [-1, 1], or None while there is none.
    seconds: since the run began.
    preview: path of the coarse displacement field that was just written, or None.
    """

    stage: str
    iteration: int
    of: int
    similarity: float | None
    seconds: float
    preview: str | None = None

    def to_json(self) -> str:
        """One JSON object on one line; similarity is null where it is unknown or not finite."""
        known = self.similarity is not None and math.isfinite(self.similarity)
        fields: dict[str, object] = {
            "stage": self.stage,
            "iteration": int(self.iteration),
            "of": int(self.of),
            "similarity": round(float(self.similarity), 6) if known else None,
            "seconds": round(float(self.seconds), 3),
        }
        if self.preview is not None:
            fields["preview"] = self.preview
        return json.dumps(fields)


ProgressCallback = Callable[[Progress], None]
"""Called after every iteration, on the thread that registers."""

CancelQuery = Callable[[], bool]
"""Asked at every iteration; True stops the registration with CancelledError."""
