"""Tables and figures of a benchmark, written again whenever rows have been added."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Sequence
from pathlib import Path

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.benchmark.benchmark_folder import FIGURES, TABLES
from PolyPoseLib.io.benchmark.figures import write_figures
from PolyPoseLib.io.benchmark.row_files import Row
from PolyPoseLib.io.benchmark.tables import write_tables

_LOG = logging.getLogger(__name__)

_OURS = {
    TABLES: ("table-*.md", "table-*.csv", "table-*.tex", "scores.csv"),
    FIGURES: ("figure-*.png", "figure-*.svg"),
}
"""What earlier runs have written there, by folder."""


def write_outputs(rows: Sequence[Row], folder: Path) -> None:
    """Write the tables and figures of rows, at least one, into the benchmark's folder.

    Those of earlier runs that these rows do not give any more are removed. Without matplotlib there are no figures,
    which is logged. Raises OSError where the system refuses.
    """
    (folder / TABLES).mkdir(exist_ok=True)
    _remove_others(folder / TABLES, write_tables(rows, folder / TABLES))
    (folder / FIGURES).mkdir(exist_ok=True)
    try:
        names = write_figures(rows, folder / FIGURES)
    except InputError as error:
        _LOG.warning("There are no figures: %s", error)
        names = []
    _remove_others(folder / FIGURES, names)


def _remove_others(folder: Path, names: Sequence[str]) -> None:
    """Remove what earlier runs wrote and this one did not."""
    for pattern in _OURS[folder.name]:
        for path in folder.glob(pattern):
            if path.name not in names:
                with contextlib.suppress(OSError):
                    path.unlink()
