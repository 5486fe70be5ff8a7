"""The data sets that can be read, by the names that the command and the tables have for them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from PolyPoseLib.data.benchmark.case import BenchmarkCase
from PolyPoseLib.errors import InputError, unknown_name
from PolyPoseLib.io.benchmark import deepfluoro, headneck, simulated, thoraxcbct
from PolyPoseLib.io.benchmark.view_sets import PAPER_VIEWS, view_name


@dataclass(frozen=True)
class Reader:
    """How one data set is read.

    Attributes
    ----------
    name
        "deepfluoro".
    subjects
        Of a root, the names of its subjects, sorted; raises InputError, with where the data are to be had, when the
        root is no whole copy.
    cases
        Of (root, subject, views), one case for every set of views, each made when it is asked for; no views stand for
        `default_views`. Raises InputError.
    files
        Of (root, subject), the files that its cases are made of, and perhaps others beside them; raises InputError.
    default_views
        What is read when no views are named.
    view_name
        The one spelling of a set of views; raises InputError for what is none of this data set.
    row_names
        Of (subject, views), both as the rows of such a case have them, as far as that is known without reading it.
    where
        What the root must be and where it is to be had, as a part of a sentence.
    two_scans
        Whether the CT in the posture of the X-rays is a second scan of the subject, and not simulated or unknown.

    """

    name: str
    subjects: Callable[[Path], list[str]]
    cases: Callable[[Path, str, Sequence[str]], Iterator[BenchmarkCase]]
    files: Callable[[Path, str], list[Path]]
    default_views: tuple[str, ...]
    view_name: Callable[[str], str]
    row_names: Callable[[str, str], tuple[str, str]]
    where: str
    two_scans: bool = False


def _rendered(dataset: str) -> Callable[[str], str]:
    """How views are named whose X-rays are rendered."""
    return lambda name: view_name(name, dataset)


def _as_listed(subject: str, views: str) -> tuple[str, str]:
    """The names of rows where a subject is a case for every set of views."""
    return subject, views


READERS: dict[str, Reader] = {
    each.name: each
    for each in (
        Reader(
            deepfluoro.DATASET,
            deepfluoro.subjects,
            deepfluoro.cases,
            deepfluoro.files,
            (deepfluoro.PAPER,),
            deepfluoro.view_name,
            deepfluoro.row_names,
            deepfluoro.WHERE,
        ),
        Reader(
            headneck.DATASET,
            headneck.subjects,
            headneck.cases,
            headneck.files,
            PAPER_VIEWS,
            _rendered(headneck.DATASET),
            _as_listed,
            headneck.WHERE,
            two_scans=True,
        ),
        Reader(
            thoraxcbct.DATASET,
            thoraxcbct.subjects,
            thoraxcbct.cases,
            thoraxcbct.files,
            PAPER_VIEWS,
            _rendered(thoraxcbct.DATASET),
            thoraxcbct.row_names,
            thoraxcbct.WHERE,
            two_scans=True,
        ),
        Reader(
            simulated.DATASET,
            simulated.subjects,
            simulated.cases,
            simulated.files,
            (simulated.OWN,),
            simulated.view_name,
            _as_listed,
            simulated.WHERE,
        ),
    )
}


def reader(name: str) -> Reader:
    """The reader of a data set; raises InputError for an unknown name."""
    if name not in READERS:
        raise InputError(unknown_name("data set", name, tuple(READERS)))
    return READERS[name]
