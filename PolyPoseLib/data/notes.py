"""What reading one X-ray reports to people: the origin of every number, and what is uncertain."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field


@dataclass
class Notes:
    """Sentences collected while one X-ray is read; they never hold a patient's name or number.

    Attributes
    ----------
    where
        The X-ray and its file, the opening of every sentence that reports an error.
    entry
        Where the user corrects it, for example "study.json".
    provenance
        One line for each number or decision, with its origin.
    warnings
        One line for each uncertainty, with the field that settles it.

    """

    where: str
    entry: str = "study.json"
    provenance: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)

    def say(self, line: str) -> None:
        """Record the origin of a number."""
        self.provenance.append(line)

    def warn(self, line: str) -> None:
        """Record an uncertainty."""
        self.warnings.append(line)


def shown(value: float | Iterable[float]) -> str:
    """Numbers as people write them: 1020, 0.4 x 0.4."""
    if isinstance(value, int | float):
        return f"{value:.6g}"
    return " x ".join(f"{part:.6g}" for part in value)
