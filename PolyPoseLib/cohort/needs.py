"""What a study takes of a machine: memory, estimated from the sizes of its images, and threads."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np

from PolyPoseLib.data.cohort.entries import CohortEntry
from PolyPoseLib.data.cohort.settings import StudySettings
from PolyPoseLib.data.cohort.sizes import StudySizes
from PolyPoseLib.data.options import Options
from PolyPoseLib.data.study import Study
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.io import study_schema
from PolyPoseLib.io.cohort.study_sizes import sizes_of

UNKNOWN_MIB = 2048
"""For a study whose sizes cannot be told; most such studies are refused within a second."""

MARGIN = 1.1
"""Of the memory that is set aside over what is estimated."""

REPORT_MIB = 150
"""What drawing the report takes beside what a registration does."""

_READERS = 8
"""Studies whose headers are read at a time: the time goes into waiting for the disk."""


@dataclass(frozen=True)
class _Sized:
    """Something of a size."""

    size: int


@dataclass(frozen=True)
class _SizedXray:
    image: _Sized


@dataclass(frozen=True)
class _SizedStudy:
    """What ``needed_memory`` asks of a study, without its images."""

    ct: Volume
    structures: range
    xrays: tuple[_SizedXray, ...]


def memory_needs(entries: Sequence[CohortEntry], settings: StudySettings) -> list[int]:
    """MiB to set aside for every study; ``UNKNOWN_MIB`` where the headers do not tell."""
    with ThreadPoolExecutor(_READERS) as readers:
        return list(readers.map(lambda entry: _need(entry.study, settings), entries))


def _need(study: Path, settings: StudySettings) -> int:
    sizes = sizes_of(study, settings.allow_outside)
    if sizes is None:
        return UNKNOWN_MIB
    try:
        given = study_schema.read(study).get("options") or {}
        return need_mib(sizes, {**given, **settings.options, "threads": settings.threads})
    except InputError:
        return UNKNOWN_MIB


def need_mib(sizes: StudySizes, options: Mapping[str, Any]) -> int:
    """MiB that a registration takes at its peak, with a margin; raises InputError for wrong options."""
    from PolyPoseLib.registration.memory import needed_memory  # torch is slow to import

    voxels = np.broadcast_to(np.int16(0), sizes.shape)  # as many as the CT's, in two bytes
    study = _SizedStudy(
        Volume(voxels, sizes.affine),
        range(sizes.structures),
        tuple(_SizedXray(_Sized(each)) for each in sizes.pixels),
    )
    # A worker's first study compiles its loops.
    need = needed_memory(cast(Study, study), Options.from_dict(options), compiles=True)
    return math.ceil(MARGIN * need.resident / (1 << 20) + REPORT_MIB)
