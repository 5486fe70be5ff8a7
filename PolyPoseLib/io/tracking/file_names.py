"""Names of files that are called after structures, whatever a structure is called."""

from __future__ import annotations

import re
from collections.abc import Sequence

LONGEST = 80
"""Characters of such a name."""

_OTHERS = re.compile(r"[^A-Za-z0-9._+-]+")

_RESERVED = re.compile(r"(con|prn|aux|nul|com[0-9]|lpt[0-9])(\..*)?", re.IGNORECASE)
"""Names that Windows gives to devices."""


def file_stems(names: Sequence[str]) -> tuple[str, ...]:
    """A file's name without its ending for every structure, all different, also where capitals do not count.

    Letters, digits, dots, plus, minus and underscores stay, everything else becomes an underscore.
    """
    stems: list[str] = []
    taken: set[str] = set()
    for name in names:
        stem = _OTHERS.sub("_", name)[:LONGEST].strip(".") or "_"
        if _RESERVED.fullmatch(stem) or stem.startswith("-"):
            stem = f"_{stem}"
        unique, number = stem, 1
        while unique.lower() in taken:
            number += 1
            unique = f"{stem}-{number}"
        taken.add(unique.lower())
        stems.append(unique)
    return tuple(stems)
