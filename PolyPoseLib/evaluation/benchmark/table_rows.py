"""Which rows of a benchmark stand in which table: one for each data set and set of views."""

from __future__ import annotations

import re
from collections.abc import Sequence

from PolyPoseLib.evaluation.benchmark.columns import Row

OWN = "own"
"""Views of a simulated case: the X-rays that it holds; "own-2x60" once their number and angles are known."""

_FRAMES = re.compile(r"[0-9]+(\+[0-9]+)*", re.ASCII)


def table_rows(rows: Sequence[Row]) -> dict[tuple[str, str], list[Row]]:
    """{(data set, set of views): its rows}, in the order in which they appear.

    Of X-rays that a case holds and that could not be read nobody knows the number: such a row counts in every table of
    its data set that it may belong to, so that no table passes it over in silence.
    """
    found: dict[tuple[str, str], list[Row]] = {(row["dataset"], view_set(row)): [] for row in rows}
    places = {
        dataset: [views for other, views in found if other == dataset and views.startswith(f"{OWN}-")]
        for dataset, _ in found
    }
    for row in rows:
        dataset, views = row["dataset"], view_set(row)
        for each in (places[dataset] or [OWN]) if views == OWN else [views]:
            found[dataset, each].append(row)
    return {place: its for place, its in found.items() if its}


def view_set(row: Row) -> str:
    """The views of a row as its table has them.

    Real X-rays are named by their frames, "10+9", which differ from subject to subject: what they share is their
    number, "2-frames".
    """
    views = str(row["views"])
    return f"{views.count('+') + 1}-frames" if _FRAMES.fullmatch(views) else views
