"""The report's files in the folder of a result."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from PolyPoseLib.data.result import Result
from PolyPoseLib.errors import InputError

_LOG = logging.getLogger(__name__)

REPORT = "report.png"
"""The report's picture; a result may lack it."""

PAGE = "report.html"
"""The report as a page that opens offline; a result may lack it."""


def write_report(result: Result, folder: Path) -> None:
    """Write the report as a page and as a picture: what cannot be made is left out with a warning.

    It is no reason to lose hours of computation. Raises OSError when the system refuses to write.
    """
    from PolyPoseLib.io import report

    page, picture = folder / PAGE, folder / REPORT
    summary = None
    with _left_out_if_it_fails(page, picture):
        summary = report.summary_of(result)
    if summary is None:
        return
    with _left_out_if_it_fails(page):
        report.write_page(summary, page)
    with _left_out_if_it_fails(picture):
        report.write_picture(summary, picture)


@contextmanager
def _left_out_if_it_fails(*paths: Path) -> Iterator[None]:
    """Turn a failure to draw files into a warning and remove them; raises OSError when the system refuses to write."""
    try:
        yield
        return
    except InputError as error:
        reason = str(error)
    except OSError as error:
        if error.errno is not None:
            raise
        reason = (
            f"The report could not be drawn ({error})."  # matplotlib's own, where it can write no settings
        )
    except Exception as error:  # drawing can fail in ways of its own, such as a picture of too many pixels
        reason = f"The report could not be drawn ({type(error).__name__}: {error})."
    for path in paths:
        path.unlink(missing_ok=True)
    names = " and ".join(path.name for path in paths)
    _LOG.warning("%s The result is saved without %s.", " ".join(reason.split())[:400], names)
