"""Whether a trained system is scored on a patient that it was trained on."""

from __future__ import annotations

from pathlib import Path

from PolyPoseLib.data.benchmark.case import BenchmarkCase
from PolyPoseLib.data.benchmark.job import CT, NOT_SEEN, TRAINED_SYSTEMS, TRUTH, UNKNOWN
from PolyPoseLib.errors import InputError


def trained_on(system: str, weights: Path, case: BenchmarkCase) -> str:
    """Which CTs of a case a system's weights were trained on.

    Parameters
    ----------
    system : str
        Its own name.
    weights : Path
        Its file, with which it has run.
    case : BenchmarkCase
        With its truth.

    Returns
    -------
    str
        One of ``TRAINED_ON``. Systems other than TRAINED_SYSTEMS, and weights that no longer can be read, say nothing.

    """
    if system not in TRAINED_SYSTEMS:
        return NOT_SEEN
    from PolyPoseLib.baselines.trained.ct_digests import ct_digest
    from PolyPoseLib.baselines.trained.fitting import training_command
    from PolyPoseLib.baselines.trained.trained_weights import read_weights

    try:
        known = read_weights(weights, system, training_command(system)).cts
    except InputError:
        return UNKNOWN
    if known is None:
        return UNKNOWN
    if case.truth.ct is not None and ct_digest(case.truth.ct) in known:
        return TRUTH
    return CT if ct_digest(case.study.ct) in known else NOT_SEEN
