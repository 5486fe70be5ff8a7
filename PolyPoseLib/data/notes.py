"""What reading one X-ray leaves behind for people: where every number came from, and what looks doubtful."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field


@dataclass
class Notes:
    """Sentences collected while one X-ray is read; they never hold a patient's name or number.

    Attributes:
        where: the X-ray and its file, the opening of every sentence that reports an error.
        entry: where the user mends it, for example "study.json".
        provenance: one line a number or decision, with its origin.
        warnings: one line a doubt, with the field that settles it.

    """

    where: str
    entry: str = "study.json"
    provenance: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)

    def say(self, line: str) -> None:
        """Record where a number came from."""
        self.provenance.append(line)

    def warn(self, line: str) -> None:
        """Record a doubt."""
        self.warnings.append(line)


def shown(value: float | Iterable[float]) -> str:
    """Numbers as people write them: 1020, 0.4 x 0.4."""
    if isinstance(value, int | float):
        return f"{value:.6g}"
    return " x ".join(f"{part:.6g}" for part in value)
