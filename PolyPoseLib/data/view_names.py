"""What X-rays are called in results, reports and logs: by their number, unless the user names them.

Names of files often hold a patient's name, so they are used in errors alone, where the user must find the file.
"""

from __future__ import annotations

import re

_NUMBERED = re.compile(r"X-ray [0-9]+")


def view_name(number: int) -> str:
    """The name of an X-ray that the user has not named; number: its place in the study, counted from 0."""
    return f"X-ray {number + 1}"


def label_of(name: str) -> str:
    """How a sentence speaks of an X-ray: X-ray 1, or X-ray "AP" by the user's name."""
    return name if _NUMBERED.fullmatch(name) else f'X-ray "{name}"'
