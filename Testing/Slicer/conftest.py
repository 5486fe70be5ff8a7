"""Lets pytest run the Slicer tests; a real Slicer runs the same files with its own runner."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))


def pytest_addoption(parser: pytest.Parser) -> None:
    """The folder Base/Python of Slicer's source, to run on Slicer's own Python classes."""
    parser.addoption("--slicer-python", default=None, help="folder Base/Python of Slicer's source")


def pytest_configure(config: pytest.Config) -> None:
    """Tell `slicer_case`, which has to work without pytest too."""
    folder = config.getoption("--slicer-python")
    if folder:
        os.environ["POLYPOSE_SLICER_PYTHON"] = folder
    import slicer_case  # noqa: F401 - the harness has to be there before a test file is imported
