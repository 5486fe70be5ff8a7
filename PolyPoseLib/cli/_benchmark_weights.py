"""The argument --weights of the subcommand benchmark."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from PolyPoseLib.data.benchmark.job import CaseSource
from PolyPoseLib.errors import InputError, one_line, unknown_name

if TYPE_CHECKING:
    from PolyPoseLib.benchmark.systems import NamedSystem


def weight_files(
    words: Sequence[str], systems: Sequence[NamedSystem], sources: Sequence[CaseSource]
) -> dict[str, Path]:
    """{system, system@views or system@subject: its file} of --weights; raises InputError.

    Parameters
    ----------
    words : sequence of str
        As they were given.
    systems : sequence of NamedSystem
        Those that run.
    sources : sequence of CaseSource
        What they run on, at least one.

    """
    from PolyPoseLib.benchmark.weight_checks import require_weights
    from PolyPoseLib.benchmark.weights_given import AT

    found: dict[str, Path] = {}
    for word in words:
        key, equals, path = word.partition("=")
        if not equals or not path:
            raise InputError(f'--weights: "{one_line(word)[:80]}" gives no file: write SYSTEM=FILE.')
        name, at, part = key.partition(AT)
        _require_system(name, systems)
        key = f"{name}{AT}{_known_part(part, sources)}" if at else name
        if key in found:
            raise InputError(f'--weights: "{key}" has two files: give one.')
        try:
            require_weights(name, Path(path))
        except InputError as error:
            raise InputError(f"--weights: {error}") from error
        found[key] = Path(path).resolve()
    return found


def _require_system(name: str, systems: Sequence[NamedSystem]) -> None:
    """Raise InputError where no system that runs takes weights of this name."""
    from PolyPoseLib.benchmark.systems import SYSTEMS, weights_names

    known = list(dict.fromkeys(name for each in systems for name in weights_names(each.name)))
    if name in SYSTEMS and name not in known:
        raise InputError(
            f'--weights: "{name}" is not among the systems that run: add it to --methods, or leave its file out.'
        )
    if name not in known:
        raise InputError(f"--weights: {unknown_name('system', name, known)}")


def _known_part(part: str, sources: Sequence[CaseSource]) -> str:
    """A subject, or the one spelling of a set of views, of those that are run; raises InputError for others."""
    from PolyPoseLib.io.benchmark.readers import READERS

    subjects = dict.fromkeys(each.subject for each in sources)
    views = dict.fromkeys(each.views for each in sources)
    if part in subjects:
        return part
    try:
        spelled = READERS[sources[0].dataset].view_name(part)
    except InputError:
        spelled = part
    if spelled not in views:
        raise InputError(
            f"--weights: {unknown_name('subject or set of views', part, [*views, *subjects])} "
            "Or leave its file out, where it is none of this call."
        )
    return spelled
