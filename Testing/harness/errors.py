"""Collects what the application would only print: exceptions in slots and observers, VTK's errors."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from types import TracebackType

import vtk

_raised: list[BaseException] = []
_vtk_errors: list[str] = []


def install() -> None:
    """Collect from now on every uncaught exception and every VTK error message of this process."""
    sys.excepthook = _collect_exception
    window = vtk.vtkOutputWindow.GetInstance()

    def collect_vtk_error(_caller: object, _event: str, text: str) -> None:
        _vtk_errors.append(text.strip())

    collect_vtk_error.CallDataType = vtk.VTK_STRING  # type: ignore[attr-defined]
    window.AddObserver("ErrorEvent", collect_vtk_error)


def report(error: BaseException) -> None:
    """Record an exception that was raised inside a slot."""
    _raised.append(error)


def take() -> list[str]:
    """Everything collected since the last call, as text; forgets it."""
    found = [f"{type(error).__name__}: {error}" for error in _raised] + list(_vtk_errors)
    _raised.clear()
    _vtk_errors.clear()
    return found


@contextlib.contextmanager
def expected(text: str) -> Iterator[None]:
    """Expect an error whose message contains `text`; it is an AssertionError when there is none."""
    before = take()
    if before:
        raise AssertionError(f"Errors before the expected one: {before}")
    yield
    found = take()
    if not any(text in message for message in found):
        raise AssertionError(f"No collected error contains {text!r}, only {found}")


def _collect_exception(
    kind: type[BaseException], error: BaseException, traceback: TracebackType | None
) -> None:
    _raised.append(error)
    sys.__excepthook__(kind, error, traceback)
