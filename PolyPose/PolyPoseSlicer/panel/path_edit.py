"""Reading and writing ctkPathLineEdit, whose own signal is not emitted for an empty path or an unusual ending."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def follow_path(edit: Any, changed: Callable[[str], None]) -> None:
    """Call `changed` with every new text of a ctkPathLineEdit, the empty one too."""
    edit.comboBox().connect("editTextChanged(QString)", changed)


def show_path(edit: Any, path: str) -> None:
    """Show a path; one that is already shown is left alone, so that the cursor does not move while typing."""
    if edit.currentPath != path:
        edit.currentPath = path
