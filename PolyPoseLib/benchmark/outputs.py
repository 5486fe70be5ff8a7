"""Tables and figures of a benchmark, written again whenever rows have been added."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from PolyPoseLib.io.benchmark.row_files import Row


def write_outputs(rows: Sequence[Row], folder: Path) -> None:
    """Write the tables and figures of rows."""
