"""A child process that works on a study of the scene: write the study, run PolyPoseLib, take what it made."""

from __future__ import annotations

import enum
import logging
import os
import re
import shutil
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import slicer
from slicer.i18n import tr as _

from PolyPoseLib.data.progress import Progress, ProgressCallback
from PolyPoseLib.errors import CancelledError, InputError, PolyPoseError

from ..study.writer import StudyData, write_study
from .environment import child_environment
from .job import Job, Step

WAIT_SECONDS = 0.02
"""How long `StudyRun.wait_for_end` rests between polls."""

POLL_SECONDS = 0.02
"""A poll on the main thread lasts about this long at most; no single step of it takes as long."""

TEMPORARY_PREFIX = "PolyPose-"
_PREFIX = re.compile(r"^(polypose|error)\s*:\s*", re.IGNORECASE)
_LOG_LINE = re.compile(r"^(DEBUG|INFO|WARNING|ERROR|CRITICAL): ")
_LAUNCHER_SAW_CRASH = "exit abnormally"
"""In the last line of Slicer's launcher, which then ends with the status 1 itself."""

_MISSING_MODULE = re.compile(r"No module named '?([\w.]+)'?")


class RunError(PolyPoseError):
    """The run ended without a result; the sentence says why."""


class State(enum.Enum):
    """The stages of a run."""

    WRITING = "writing"
    RUNNING = "running"
    LOADING = "loading"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"

    @property
    def ended(self) -> bool:
        """Whether nothing more will come."""
        return self in (State.DONE, State.FAILED, State.CANCELLED)


class StudyRun:
    """A run: call `poll` from time to time, on the main thread, until `state.ended`.

    `progress` is the last step, `error` why it failed (None otherwise). A subclass says how the child is called
    (`_arguments`), what becomes of its steps (`_took`) and of its end (`_child_ended`, `_poll_loading`), and what
    has to be taken back when there is no result (`_take_back`).
    """

    def __init__(self, study: StudyData, command: list[str], what: str) -> None:
        """Start it. The study holds no nodes. command: the program. what: its name in sentences."""
        self.state = State.WRITING
        self.progress: Progress | None = None
        self.error: PolyPoseError | None = None
        self._study, self._command, self._what = study, command, what
        self._folder = Path(tempfile.mkdtemp(prefix=TEMPORARY_PREFIX, dir=slicer.app.temporaryPath))
        self._job: Job | None = None
        self._cancelling = False
        self._thread_result: Any = None
        self._thread = self._start_thread(self._write)

    @property
    def cancelling(self) -> bool:
        """Whether it was asked to stop and has not ended yet."""
        return self._cancelling and not self.state.ended

    @property
    def log(self) -> list[str]:
        """The last lines of the child's log."""
        return self._job.log if self._job is not None else []

    def poll(self) -> State:
        """Do what is due, for about 20 ms at most, and return the state; never raises for the run's failures."""
        steps = {
            State.WRITING: self._poll_writing,
            State.RUNNING: self._poll_running,
            State.LOADING: self._poll_loading,
        }
        try:
            if self.state in steps:
                steps[self.state]()
        except PolyPoseError as error:
            self._end(State.CANCELLED if isinstance(error, CancelledError) else State.FAILED, error)
        except Exception as error:
            logging.exception("PolyPose: an unexpected fault")
            fault = f"{type(error).__name__}: {error}"
            self._end(State.FAILED, RunError(_("An unexpected error occurred: {fault}.").format(fault=fault)))
        return self.state

    def wait_for_end(self, progress: ProgressCallback | None = None) -> None:
        """Block until it has ended; raises its error, when there is one.

        progress: called with each new Progress; an exception in it, KeyboardInterrupt included, stops the run.
        """
        seen = None
        try:
            while not self.poll().ended:
                if progress is not None and self.progress is not None and self.progress is not seen:
                    seen = self.progress
                    progress(seen)
                time.sleep(WAIT_SECONDS)
        finally:
            self.close()
        if self.error is not None:
            raise self.error

    def cancel(self) -> None:
        """Ask it to stop and return at once; the child's whole tree has ended within two seconds."""
        if not self.state.ended:
            self._cancelling = True
            if self._job is not None:
                self._job.cancel()

    def close(self) -> None:
        """Stop it now and remove its files; for quitting, closing the scene, and unloading the module."""
        if not self.state.ended:
            self._cancelling = True
            self._end(State.CANCELLED, self._cancelled())

    def _write(self) -> Path:
        """Write what the child reads and return the study's file; called in a thread, touches no node."""
        return write_study(self._study, self._folder)

    def _arguments(self, study_file: Path) -> list[str]:
        """The subcommand and its arguments."""
        raise NotImplementedError

    def _took(self, steps: list[Step]) -> None:
        """Steps that came since the last poll; the last one is `progress` already."""

    def _load_preview(self, path: str) -> Any:
        """What a preview's file holds; called in a thread."""
        return None

    def _child_ended(self, job: Job) -> None:
        """Take the result or raise its error; changes the state."""
        raise NotImplementedError

    def _is_finished(self) -> bool:
        """Whether the child's work was done before it was cancelled, and is to be taken all the same."""
        return False

    def _poll_loading(self) -> None:
        """Continue the work that remains once the child has ended."""

    def _take_back(self) -> None:
        """Undo what was done to the scene: there is no result."""

    def _cancelled(self) -> CancelledError:
        return CancelledError(_("The {what} was cancelled.").format(what=self._what))

    def _start_thread(self, work: Callable[[], Any]) -> threading.Thread:
        """Do something that touches no node in a thread; its value or exception comes to _take_thread."""
        self._thread_result = None

        def run() -> None:
            try:
                self._thread_result = (work(), None)
            except Exception as error:
                self._thread_result = (None, error)
            finally:
                if self.state.ended:
                    shutil.rmtree(self._folder, ignore_errors=True)

        thread = threading.Thread(target=run, daemon=True)
        thread.start()
        return thread

    def _take_thread(self) -> Any:
        """The value of the finished thread; raises its exception as one sentence."""
        value, error = self._thread_result
        if error is None:
            return value
        if isinstance(error, PolyPoseError):
            raise error
        if isinstance(error, OSError):
            raise RunError(error.strerror if error.filename is None else str(error)) from error
        if isinstance(error, MemoryError):
            raise RunError(_("Memory ran out: crop the CT or use a coarser one.")) from error
        raise error

    def _poll_writing(self) -> None:
        if self._thread.is_alive():
            return
        study_file = self._take_thread()
        self._refuse_when_cancelled()
        arguments = [*self._command, *self._arguments(study_file)]
        try:
            self._job = Job(arguments, child_environment(), str(self._folder), self._load_preview)
        except OSError as error:
            raise RunError(
                _("{program} could not be started ({reason}): install Slicer again.").format(
                    program=arguments[0], reason=error.strerror
                )
            ) from error
        self.state = State.RUNNING

    def _poll_running(self) -> None:
        job = self._job
        if job is None:
            return
        steps = job.poll(POLL_SECONDS / 2)
        if steps:
            self.progress = steps[-1].progress
            self._took(steps)
        if job.finished:
            if not self._is_finished():
                self._refuse_when_cancelled()
            self._child_ended(job)

    def _refuse_when_cancelled(self) -> None:
        if self._cancelling:
            raise self._cancelled()

    def _end(self, state: State, error: PolyPoseError | None) -> None:
        """Leave no process, no file and, without a result, nothing in the scene behind."""
        self.state, self.error = state, error
        if self._job is not None and not self._job.finished:
            self._job.close()
        if state is not State.DONE:
            self._take_back()
        shutil.rmtree(self._folder, ignore_errors=True)


def error_of(status: int | None, log: list[str], what: str = "") -> PolyPoseError:
    """The child's own sentence as an exception of the kind that its exit status means; what: its name."""
    what = what or _("registration")
    sentence = child_sentence(log)
    if status == InputError.exit_status:
        return InputError(
            sentence or _("The {what} rejected its input without giving a reason.").format(what=what)
        )
    if status == CancelledError.exit_status:
        return CancelledError(_("The {what} was interrupted from outside.").format(what=what))
    end = _end_by_system(status, log)
    if end:
        return RunError(
            _(
                "The {what}'s process was ended by the system ({end}), most often because memory ran out: use "
                "the fast preset, or crop the CT."
            ).format(what=what, end=end)
        )
    missing = _MISSING_MODULE.search(log[-1]) if log else None
    if missing:
        return RunError(
            _("The Python package '{name}' is missing: let PolyPose install what it needs.").format(
                name=missing[1]
            )
        )
    if sentence:
        return RunError(sentence)
    return RunError(
        _("The {what} ended without a result (exit status {status}).").format(what=what, status=status)
    )


def _end_by_system(status: int | None, log: list[str]) -> str:
    """How the child crashed or was killed, itself or below Slicer's launcher; empty when it was not."""
    if status is not None and status < 0:
        return _("signal {number}").format(number=-status)
    if status in (137, 139):
        return _("signal {number}").format(number=status - 128)
    return _("a crash") if status == 1 and _LAUNCHER_SAW_CRASH in "".join(log[-1:]) else ""


def child_sentence(log: list[str]) -> str:
    """The sentence in which the child says why it ended: its last line with its name, else the last at all."""
    for line in reversed(log):
        if _PREFIX.match(line):
            return _PREFIX.sub("", line)
    last = next((line for line in reversed(log) if line.strip() and not _LOG_LINE.match(line)), "")
    return last.strip()


def leftover_folders() -> list[str]:
    """Temporary folders of runs that exist now, for tests and the log."""
    root = slicer.app.temporaryPath
    return [name for name in os.listdir(root) if name.startswith(TEMPORARY_PREFIX)]
