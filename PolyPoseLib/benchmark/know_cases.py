"""A process that reads cases once: ``python -m PolyPoseLib.benchmark.know_cases SOURCE FILE STAMP``."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from PolyPoseLib.benchmark.case_reading import known_cases
from PolyPoseLib.benchmark.child_start import begin
from PolyPoseLib.benchmark.hidden_names import HiddenNames
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.benchmark.jobs import parse_source_text, write_cases


def main(argv: Sequence[str]) -> int:
    """Read the cases and keep what they are; 2, with a sentence as the last line, when the data are damaged."""
    begin()
    text, path, stamp = argv
    source = parse_source_text(text)
    try:
        write_cases(Path(path), stamp, known_cases(source))
    except InputError as error:
        print(f"polypose: {HiddenNames(source)(str(error))}", file=sys.stderr, flush=True)
        return error.exit_status
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
