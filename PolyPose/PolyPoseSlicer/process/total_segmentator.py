"""Segments bones with the extension TotalSegmentator, whose logic waits until its child process has ended."""

from __future__ import annotations

import contextlib
import importlib
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import slicer

from .responsive_process import ResponsiveProcess
from .segmentation_task import SegmentationTask

_TASK = "total"
"""The task with all bones of the trunk, shoulders and thighs; it needs no licence."""


class TotalSegmentator:
    """The extension's own logic; its wait for the child process lets the application go on and can be cancelled."""

    name = "TotalSegmentator"

    def __init__(self) -> None:
        """Import the extension's module."""
        self._logic: Any = importlib.import_module("TotalSegmentator").TotalSegmentatorLogic()
        self._task: SegmentationTask | None = None
        self._process: ResponsiveProcess | None = None

    def prepare(self, tell: Callable[[str], None]) -> None:
        """Let the extension install its Python packages; it asks first."""
        self._logic.logCallback = tell
        self._logic.setupPythonRequirements()

    def run(self, task: SegmentationTask, ended: Callable[[Exception | None], None]) -> None:
        """Segment, and return when it has ended; the weights are downloaded by the child process."""
        self._task = task
        logic = self._logic
        logic.logCallback = task.tell
        read = logic.logProcessOutput
        logic.logProcessOutput = lambda process, *others, **named: read(
            self._responsive(process, task), *others, **named
        )
        error: Exception | None = None
        try:
            # Standard names are those that structures are proposed from, and that people read in Slicer.
            logic.useStandardSegmentNames = True
            logic.process(task.ct, task.segmentation, quality="normal", task=_TASK, interactive=True)
            task.check()
        except Exception as raised:
            error = raised
            self._remove_files()
        finally:
            logic.logProcessOutput = read
            self._process = None
        ended(error)

    def cancel(self) -> None:
        """Kill the child process; the run ends when its output is read next."""
        if self._task is not None:
            self._task.cancelled = True
        if self._process is not None:
            self._process.kill()

    def _responsive(self, process: Any, task: SegmentationTask) -> ResponsiveProcess:
        self._process = ResponsiveProcess(process, task.check)
        return self._process

    def _remove_files(self) -> None:
        """Remove the CT that the extension wrote for its child, which it does itself after a success only."""
        if self._process is None:
            return
        arguments = [str(each) for each in self._process.args]
        with contextlib.suppress(ValueError, IndexError, OSError):
            folder = Path(arguments[arguments.index("-i") + 1]).parent.resolve()
            if Path(slicer.app.temporaryPath).resolve() in folder.parents:
                shutil.rmtree(folder, ignore_errors=True)
