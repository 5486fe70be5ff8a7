"""Bursts of changes that the views draw once: while Python runs, every change may draw every view anew."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import ParamSpec, TypeVar

import slicer

_P = ParamSpec("_P")
_T = TypeVar("_T")


def drawn_once(function: Callable[_P, _T]) -> Callable[_P, _T]:
    """Let the views draw when the function has ended, and not meanwhile."""

    @functools.wraps(function)
    def within(*arguments: _P.args, **named: _P.kwargs) -> _T:
        with slicer.util.RenderBlocker():
            return function(*arguments, **named)

    return within
