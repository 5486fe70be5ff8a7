"""Runs one unittest module on the harness, as Slicer's own runner does in the application."""

from __future__ import annotations

import sys
import unittest
from pathlib import Path


def main(folder: str, name: str) -> int:
    """Run the tests of a module in a folder; returns 0 when all passed and there was at least one."""
    testing = Path(__file__).resolve().parents[1]
    sys.path[:0] = [folder, str(testing / "Slicer"), str(testing)]
    import slicer_case  # noqa: F401 - installs the harness

    if Path(folder).name == name:
        from harness import modules

        modules.load(Path(folder) / f"{name}.py")
    suite = unittest.TestLoader().loadTestsFromName(name)
    result = unittest.TextTestRunner(verbosity=2).run(suite)
    return 0 if result.wasSuccessful() and result.testsRun else 1


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
