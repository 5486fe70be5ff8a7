"""Reading and writing ctkPathLineEdit, whose own signal keeps silent about an empty path and unusual endings."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def follow_path(edit: Any, changed: Callable[[str], None]) -> None:
    """Call `changed` with every new text of a ctkPathLineEdit, the empty one too."""
    edit.comboBox().connect("editTextChanged(QString)", changed)


def show_path(edit: Any, path: str) -> None:
    """Show a path; one that is shown already is left alone, for the cursor of somebody who is typing."""
    if edit.currentPath != path:
        edit.currentPath = path
