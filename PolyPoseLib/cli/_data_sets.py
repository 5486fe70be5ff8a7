"""Which subjects and views of a data set are meant, for the subcommands that read one."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from PolyPoseLib.errors import InputError, unknown_name

if TYPE_CHECKING:
    from PolyPoseLib.io.benchmark.readers import Reader


def chosen_views(reader: Reader, wanted: Sequence[str] | None) -> tuple[str, ...]:
    """The sets of views by their one spelling, each once, the reader's own for None; raises InputError."""
    try:
        return tuple(dict.fromkeys(map(reader.view_name, wanted or reader.default_views)))
    except InputError as error:
        raise InputError(f"--views: {error}") from error


def chosen_subjects(reader: Reader, data: Path, wanted: Sequence[str] | None) -> tuple[str, ...]:
    """The subjects that are wanted, in the reader's order, all for None.

    Parameters
    ----------
    reader : Reader
        Of the data set.
    data : Path
        Where it lies.
    wanted : sequence of str, optional
        Names of subjects.

    Raises
    ------
    InputError
        The data are no whole copy, hold no subject, or none of a name.

    """
    subjects = reader.subjects(data)
    if not subjects:
        raise InputError(
            f"{data}: it holds no subject of the layout {reader.name}: see the page on its data."
        )
    for name in wanted or ():
        if name not in subjects:
            raise InputError(f"--subjects: {unknown_name('subject', name, subjects)}")
    return tuple(name for name in subjects if wanted is None or name in wanted)
