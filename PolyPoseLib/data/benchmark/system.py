"""The protocol of every system that is compared: a study in, a motion out."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.options import Weighting
from PolyPoseLib.data.study import Study


@dataclass(frozen=True)
class SystemSetting:
    """What a system may use besides the study.

    Attributes
    ----------
    threads
        Of the processor.
    device
        "cpu" or "cuda".
    seed
        Of whatever is random in it.
    weights
        {system: file of its trained weights}, for those that need one; nothing is downloaded.
    progress
        Called with (iteration, of, similarity or None).
    cancelled
        Asked at every iteration; True stops the fit, by CancelledError.
    case
        Name of the case, by which what is drawn at random differs from case to case; empty outside of benchmarks.

    """

    threads: int = 1
    device: str = "cpu"
    seed: int = 0
    weights: Mapping[str, Path] = dataclasses.field(default_factory=dict)
    progress: Callable[[int, int, float | None], None] = lambda iteration, of, similarity: None
    cancelled: Callable[[], bool] = lambda: False
    case: str = ""


@dataclass(frozen=True, eq=False)
class Motion:
    """What a system found.

    Attributes
    ----------
    field
        From fixed to moving points, LPS mm, on a grid of at most 4 mm that covers the CT.
    poses
        {structure: (4, 4)} fixed to moving, LPS mm; empty where the system knows no rigid bodies.
    notes
        One line each: versions of the packages that ran, what was left out.
    weighting
        How the poses make the field; None where they do not, as of one body for the whole patient.

    """

    field: DisplacementField
    poses: Mapping[str, np.ndarray] = dataclasses.field(default_factory=dict)
    notes: tuple[str, ...] = ()
    weighting: Weighting | None = None


class System(Protocol):
    """A method of registration under comparison."""

    name: str
    """As --methods and the tables have it: "dense-r3"."""

    needs: tuple[str, ...]
    """Packages that it imports, by their names for pip; empty when it needs nothing beyond PolyPoseLib's own."""

    def fit(self, study: Study, setting: SystemSetting) -> Motion:
        """Find the motion between the CT and the X-rays, whose cameras are in the study.

        Raises InputError when a package or a file of weights is missing (the sentence says how to get it), or the
        study is not for this system; CancelledError when it was cancelled.
        """
        ...
