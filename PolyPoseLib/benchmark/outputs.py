"""Tables and figures of a benchmark, written again whenever rows have been added."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.benchmark.benchmark_folder import FIGURES, TABLES
from PolyPoseLib.io.benchmark.figures import write_figures
from PolyPoseLib.io.benchmark.row_files import Row
from PolyPoseLib.io.benchmark.tables import write_tables
from PolyPoseLib.io.benchmark.written_files import replace_written

_LOG = logging.getLogger(__name__)


def write_outputs(rows: Sequence[Row], folder: Path) -> None:
    """Write the tables and figures of rows, at least one, into the benchmark's folder.

    Those of earlier calls that these rows do not give any more are removed, and a user's own files beside them stay.
    Without matplotlib there are no figures, which is logged. Raises OSError where the system refuses.
    """
    for place in (TABLES, FIGURES):
        (folder / place).mkdir(exist_ok=True)
    tables = write_tables(rows, folder / TABLES)
    try:
        figures = write_figures(rows, folder / FIGURES)
    except InputError as error:
        _LOG.warning("There are no figures: %s", error)
        figures = []
    replace_written(folder, {TABLES: tables, FIGURES: figures})
