"""Attributes of one frame of a DICOM X-ray, looked up where the standard lets them stand."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from PolyPoseLib.data.notes import Notes
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.dicom import raw_value

if TYPE_CHECKING:
    from pydicom.dataset import Dataset


class XrayTags:
    """Attributes that hold for one frame: per frame, then shared functional groups, then the file.

    Values that are empty or unreadable count as absent.
    """

    def __init__(self, dataset: Dataset, frame: int = 0) -> None:
        """Take the dataset and the frame, counted from 0."""
        self.dataset = dataset
        self.frame = frame
        self._groups = [
            group
            for name, index in (
                ("PerFrameFunctionalGroupsSequence", frame),
                ("SharedFunctionalGroupsSequence", 0),
            )
            for group in self._macro_items(name, index)
        ]

    def _macro_items(self, name: str, index: int) -> list[Dataset]:
        """First items of the macros of one functional group."""
        groups = raw_value(name, self.dataset) or []
        if index >= len(groups):
            return []
        return [element.value[0] for element in groups[index] if element.VR == "SQ" and len(element.value)]

    def value(self, keyword: str) -> Any:
        """Value that holds for the frame, or None."""
        for dataset in (*self._groups, self.dataset):
            found = raw_value(keyword, dataset)
            if found is not None:
                return found
        return None

    def text(self, keyword: str) -> str:
        """Value as upper-case text, "" when absent; the values of a list are joined by a backslash."""
        found = self.value(keyword)
        if found is None:
            return ""
        return "\\".join(self.texts(keyword)) if not isinstance(found, str) else found.strip().upper()

    def texts(self, keyword: str) -> tuple[str, ...]:
        """Values as upper-case texts."""
        found = self.value(keyword)
        if found is None:
            return ()
        parts = [found] if isinstance(found, str | int | float) else list(found)
        return tuple(str(part).strip().upper() for part in parts)

    def numbers(self, keyword: str) -> tuple[float, ...] | None:
        """Finite numbers of an attribute, None when absent or not numbers."""
        try:
            numbers = tuple(float(part) for part in self.texts(keyword))
        except ValueError:
            return None
        return numbers if numbers and all(map(math.isfinite, numbers)) else None

    def number(self, keyword: str) -> float | None:
        """First finite number of an attribute, or None."""
        numbers = self.numbers(keyword)
        return numbers[0] if numbers else None

    def positive(self, keyword: str) -> float | None:
        """First number of an attribute when it is above 0, or None."""
        number = self.number(keyword)
        return number if number is not None and number > 0 else None

    def pair(self, keyword: str) -> tuple[float, float] | None:
        """The two finite numbers of an attribute, or None."""
        numbers = self.numbers(keyword)
        return (numbers[0], numbers[1]) if numbers and len(numbers) == 2 else None

    def positive_pair(self, keyword: str) -> tuple[float, float] | None:
        """The two numbers of an attribute when both are above 0, or None."""
        pair = self.pair(keyword)
        return pair if pair is not None and min(pair) > 0 else None

    def triple(self, keyword: str) -> tuple[float, float, float] | None:
        """The three finite numbers of an attribute, or None."""
        numbers = self.numbers(keyword)
        return (numbers[0], numbers[1], numbers[2]) if numbers and len(numbers) == 3 else None

    def has(self, keyword: str) -> bool:
        """Whether the file itself (not a functional group) holds an attribute that is not empty."""
        return bool(raw_value(keyword, self.dataset))


def choose_frame(dataset: Dataset, frame: int | None, notes: Notes) -> int:
    """Frame to use, counted from 0: the one asked for, or the middle one with a warning.

    Raises
    ------
    InputError
        The frame asked for does not exist.

    """
    try:
        count = max(int(dataset.get("NumberOfFrames") or 1), 1)
    except (TypeError, ValueError):
        count = 1
    if frame is not None:
        if not 0 <= frame < count:
            raise InputError(
                f'{notes.where} has {count} frame{"s" * (count > 1)}, so "frame" {frame} does not exist; give '
                f"a number from 0 to {count - 1}."
            )
        if count > 1:
            notes.say(f"frame {frame} of {count} (counted from 0) as asked")
        return frame
    if count > 1:
        notes.say(f"frame {count // 2} of {count} (counted from 0), the middle one")
        notes.warn(
            f'{count} frames and none chosen: the middle one, {count // 2} (counted from 0), is used; add "frame" '
            "to choose another."
        )
    return count // 2 if count > 1 else 0
