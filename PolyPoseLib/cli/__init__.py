"""Subcommands of the command line, one module each: add_parser(subparsers) and run(arguments) -> exit
status.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Iterator
from importlib import import_module
from types import ModuleType

ORDER = (
    "register", "cohort", "track", "view", "cameras", "train", "structures", "simulate", "evaluate", "transform",
    "project", "dicom", "benchmark", "sample", "demo",
)  # fmt: skip
"""Order in the help; a module that is not listed comes last."""


def commands() -> Iterator[ModuleType]:
    """Every module of this package that adds a subcommand; importing them loads nothing heavy."""
    names = [found.name for found in pkgutil.iter_modules(__path__) if not found.name.startswith("_")]
    for name in sorted(names, key=lambda each: (ORDER.index(each) if each in ORDER else len(ORDER), each)):
        module = import_module(f"{__name__}.{name}")
        if hasattr(module, "add_parser"):
            yield module
