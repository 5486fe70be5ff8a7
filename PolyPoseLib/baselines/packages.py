"""Packages that compared systems need and PolyPose does not bring: found, or asked for in one sentence."""

from __future__ import annotations

import contextlib
import importlib
import importlib.metadata
import importlib.util
import io
import logging
from collections.abc import Iterator

from PolyPoseLib.errors import InputError


def is_installed(module: str) -> bool:
    """Whether a module could be imported; only the packages above it are."""
    try:
        return importlib.util.find_spec(module) is not None
    except ModuleNotFoundError:
        return False


def require_package(module: str, package: str, what: str, fix: str | None = None) -> None:
    """Raise InputError unless a module can be imported, with whatever it imports itself.

    Parameters
    ----------
    module
        As it is imported: "itk.RTKPython".
    package
        As pip knows it: "itk-rtk".
    what
        Begins the sentence: "fdk-greedy".
    fix
        How to get it; the extra `baselines` by default.

    """
    fix = fix or 'pip install "polypose[baselines]"'
    if not is_installed(module):
        raise InputError(f"{what} needs the package {package}, which is not installed: {fix}.")
    if module.startswith("itk."):  # loads its libraries when it is first used, which takes long
        return
    try:
        with quiet():
            importlib.import_module(module)
    except ImportError as error:
        raise InputError(
            f"{what} needs the package {package}, which does not load ({error}): {fix}."
        ) from error


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Inside, a package prints nothing and logs errors alone; some do so when they are imported."""
    before = logging.root.manager.disable
    logging.disable(logging.WARNING)
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            yield
    finally:
        logging.disable(before)


def package_versions(*packages: str) -> tuple[str, ...]:
    """One line for each package, "itk-rtk 2.7.0", for the notes of a motion."""
    lines = []
    for package in packages:
        try:
            lines.append(f"{package} {importlib.metadata.version(package)}")
        except importlib.metadata.PackageNotFoundError:
            lines.append(f"{package} of unknown version")
    return tuple(lines)
