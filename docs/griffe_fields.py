"""Docstrings that describe fields as lines of "name: text" become lists on the API page."""

from __future__ import annotations

import re
from typing import Any

from griffe import Extension, Object

_FIELD = re.compile(r"^(\w+(?:, \w+)*): ", re.M)


class FieldLists(Extension):
    """Rewrites the docstring of every class and function while it is loaded."""

    def on_object(self, *, obj: Object, **_: Any) -> None:
        """Begin a list item at each line that starts with names of the object's own fields or parameters."""
        if obj.docstring is None:
            return
        names = set(obj.members) | {each.name for each in getattr(obj, "parameters", None) or ()}

        def item(line: re.Match[str]) -> str:
            fields = line[1].split(", ")
            return (
                f"\n- {', '.join(f'`{name}`' for name in fields)}: " if names.issuperset(fields) else line[0]
            )

        obj.docstring.value = _FIELD.sub(item, obj.docstring.value).lstrip("\n")
