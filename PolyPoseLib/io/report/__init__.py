"""The report of a result: one picture (report.png), and one page that opens offline (report.html)."""

from __future__ import annotations

from pathlib import Path

from PolyPoseLib.io.report.figure import draw_figure
from PolyPoseLib.io.report.page import page_of
from PolyPoseLib.io.report.pictures import overlay
from PolyPoseLib.io.report.summary import Summary, summary_of

__all__ = ["Summary", "draw_figure", "overlay", "page_of", "summary_of", "write_page", "write_picture"]


_COMPRESSION = 1
"""Of zlib: twice as fast as the usual 6, for a file 5 % larger."""


def write_picture(summary: Summary, path: str | Path) -> None:
    """Draw the report into a PNG file; raises InputError when matplotlib is missing."""
    figure = draw_figure(summary)
    figure.savefig(
        path, dpi=figure.dpi, facecolor=figure.get_facecolor(), pil_kwargs={"compress_level": _COMPRESSION}
    )


def write_page(summary: Summary, path: str | Path) -> None:
    """Write the report as an HTML page."""
    Path(path).write_text(page_of(summary), encoding="utf-8")
