"""Lets pytest run the Slicer tests; a real Slicer runs the same files with its own runner."""

from __future__ import annotations

import importlib.util
import os
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

NEEDED = ("slicer", "vtk", "PySide6")
MISSING = [name for name in NEEDED if importlib.util.find_spec(name) is None]
collect_ignore_glob = ["test_*.py"] if MISSING else []


def pytest_addoption(parser: pytest.Parser) -> None:
    """The folder Base/Python of Slicer's source, to run on Slicer's own Python classes."""
    parser.addoption("--slicer-python", default=None, help="folder Base/Python of Slicer's source")


def pytest_configure(config: pytest.Config) -> None:
    """Make the harness before a test file is imported."""
    # pytest reads the option only when this folder is named on its command line.
    folder = config.getoption("--slicer-python", default=None)
    if folder:
        os.environ["POLYPOSE_SLICER_PYTHON"] = folder
    if not MISSING:
        import slicer_case  # noqa: F401


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark tests of classes that say `LONG`: Slicer's own runner, which runs the same files, knows no marks."""
    for item in items:
        if getattr(getattr(item, "cls", None), "LONG", False):
            item.add_marker(pytest.mark.long)


def pytest_report_header() -> str:
    """Say which tests are left out, and why."""
    return f"Slicer tests: left out, {', '.join(MISSING)} not installed" if MISSING else "Slicer tests: on"
