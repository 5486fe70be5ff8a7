"""One registration from start to end: write the study, run the child, read the result, fill the nodes."""

from __future__ import annotations

import enum
import logging
import os
import re
import shutil
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import slicer
from slicer.i18n import tr as _

from PolyPoseLib.errors import CancelledError, InputError, PolyPoseError, UntrustedResultError

from .environment import child_environment, python_executable
from .grid_transform import read_field, set_grid_transform
from .job import Job, ProgressEvent
from .loading import LoadedResult, load_folder
from .results import InputStyle, OutputNodes, fill_nodes
from .study_writer import StudyData, write_study

POLL_SECONDS = 0.02
"""A poll on the main thread lasts about this long at most; no single step of it takes as long."""

TEMPORARY_PREFIX = "PolyPose-"
_WAIT_SECONDS = 0.02
_PREFIX = re.compile(r"^(polypose|error)\s*:\s*", re.IGNORECASE)
_LOG_LINE = re.compile(r"^(DEBUG|INFO|WARNING|ERROR|CRITICAL): ")
_MISSING_MODULE = re.compile(r"No module named '?([\w.]+)'?")


class RunError(PolyPoseError):
    """The registration ended without a result; the sentence says why."""


class State(enum.Enum):
    """Where a registration is."""

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


class Registration:
    """A running registration: call `poll` from time to time, on the main thread, until `state.ended`.

    `progress` is the last step, `similarities` all of them, `error` why it failed (None otherwise; a result
    that must not be trusted is an error too, but its nodes are there), `nodes` what it made.
    """

    def __init__(
        self,
        study: StudyData,
        nodes: OutputNodes,
        style: InputStyle,
        name: str,
        output_folder: str | Path | None = None,
        preview: bool = False,
        command: list[str] | None = None,
    ) -> None:
        """Start it. The study and the style of its inputs hold no nodes.

        output_folder: where to keep the result folder; None: it is read into nodes and removed.
        preview: move nodes.transform while the run goes on; it is made when it is None.
        command: another program than PolyPoseLib, for tests.
        """
        self.state = State.WRITING
        self.nodes = nodes
        self.progress: ProgressEvent | None = None
        self.similarities: list[float] = []
        self.error: PolyPoseError | None = None
        self._study, self._style, self._name = study, style, name
        self._folder = Path(tempfile.mkdtemp(prefix=TEMPORARY_PREFIX, dir=slicer.app.temporaryPath))
        self._output = Path(output_folder) if output_folder else self._folder / "result"
        self._preview = self._folder / "preview.h5" if preview else None
        self._command = command or [python_executable(), "-m", "PolyPoseLib"]
        self._job: Job | None = None
        self._steps: Iterator[None] | None = None
        self._cancelling = False
        self._before_preview: Any = None
        self._thread_result: Any = None
        self._thread = self._start_thread(lambda: write_study(study, self._folder))

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
        step = {State.WRITING: self._poll_writing, State.RUNNING: self._poll_running}
        try:
            if self.state is State.LOADING:
                self._poll_loading()
            elif self.state in step:
                step[self.state]()
        except PolyPoseError as error:
            self._end(State.CANCELLED if isinstance(error, CancelledError) else State.FAILED, error)
        except Exception as error:
            logging.exception("PolyPose: an unexpected fault")
            fault = f"{type(error).__name__}: {error}"
            self._end(State.FAILED, RunError(_("An unexpected fault: {fault}.").format(fault=fault)))
        return self.state

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
            self._end(State.CANCELLED, CancelledError(_("The registration was cancelled.")))

    def wait(self, progress: Callable[[ProgressEvent], None] | None = None) -> OutputNodes:
        """Block until it has ended and return its nodes; raises its error.

        progress: called with each new step. An exception in it, KeyboardInterrupt included, stops the run.
        """
        seen = None
        try:
            while not self.poll().ended:
                if progress is not None and self.progress is not seen:
                    seen = self.progress
                    progress(seen)
                time.sleep(_WAIT_SECONDS)
        finally:
            self.close()
        if self.error is not None:
            raise self.error
        return self.nodes

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
        arguments = [*self._command, "register", str(study_file), "--output", str(self._output)]
        arguments += ["--progress", "json", "--allow-outside", "--overwrite"]
        if self._preview is not None:
            arguments += ["--preview", str(self._preview)]
        try:
            self._job = Job(arguments, child_environment(), str(self._folder), self._load_preview)
        except OSError as error:
            raise RunError(
                _("{program} could not be started ({reason}): install Slicer again.").format(
                    program=arguments[0], reason=error.strerror
                )
            ) from error
        self.state = State.RUNNING

    def _load_preview(self, path: str) -> Any:
        """The displacement field of a preview; only a file in our own folder is read."""
        if Path(path).resolve().parent != self._folder.resolve():
            return None
        return read_field(path)

    def _poll_running(self) -> None:
        job = self._job
        fields = []
        for event in job.poll(POLL_SECONDS / 2):
            self.progress = event
            if event.similarity is not None:
                self.similarities.append(event.similarity)
            if event.preview is not None:
                fields.append(event.preview)
        if fields and not self._cancelling:
            self._show_preview(*fields[-1])
        if not job.finished:
            return
        self._refuse_when_cancelled()
        untrusted = UntrustedResultError.exit_status
        if job.exit_status not in (0, untrusted) or not (self._output / "result.json").is_file():
            raise error_of(job.exit_status, job.log)
        self.state = State.LOADING
        study_file = self._folder / "STUDY.json"
        self._thread = self._start_thread(lambda: load_folder(self._output, self._study, study_file))

    def _show_preview(self, vectors: Any, affine: Any) -> None:
        """Refresh the transform node, so that what is under it moves in the views."""
        node = self.nodes.transform
        if node is None:
            name = slicer.mrmlScene.GenerateUniqueName(_("{name} transform").format(name=self._name))
            node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLGridTransformNode", name)
            self.nodes.transform = node
            self.nodes.made.append(node)
        if node.GetScene() is not None:
            if self._before_preview is None:
                self._before_preview = node.GetTransformFromParent()
            set_grid_transform(node, vectors, affine)

    def _poll_loading(self) -> None:
        if self._steps is None:
            if self._thread.is_alive():
                return
            loaded: LoadedResult = self._take_thread()
            self._refuse_when_cancelled()
            self._steps = fill_nodes(loaded, self.nodes, self._style, self._name)
        deadline = time.monotonic() + POLL_SECONDS
        while time.monotonic() < deadline:
            self._refuse_when_cancelled()
            try:
                next(self._steps)
            except StopIteration:
                self.nodes.warnings = (*self._study.warnings, *self.nodes.warnings)
                self._end(State.DONE, distrust_error(self.nodes))
                return

    def _refuse_when_cancelled(self) -> None:
        if self._cancelling:
            raise CancelledError(_("The registration was cancelled."))

    def _end(self, state: State, error: PolyPoseError | None) -> None:
        """Leave no process, no file and, without a result, no new node behind."""
        self.state, self.error = state, error
        if self._job is not None and not self._job.finished:
            self._job.close()
        if state is not State.DONE:
            self._take_back_preview()
            self.nodes.remove_made()
        shutil.rmtree(self._folder, ignore_errors=True)

    def _take_back_preview(self) -> None:
        """Give a transform node that was not ours the transform that it had."""
        node = self.nodes.transform
        if self._before_preview is not None and node.GetScene() is not None:
            node.SetAndObserveTransformFromParent(self._before_preview)


def distrust_error(nodes: OutputNodes) -> UntrustedResultError | None:
    """The error of a result that must not be trusted; its nodes exist nevertheless."""
    if nodes.trusted:
        return None
    return UntrustedResultError(
        _("The result must not be trusted: {reasons}.").format(reasons="; ".join(nodes.distrust))
    )


def error_of(status: int | None, log: list[str]) -> PolyPoseError:
    """The child's own sentence as an exception of the kind that its exit status means."""
    sentence = child_sentence(log)
    if status == InputError.exit_status:
        return InputError(sentence or _("The registration refused its input without saying why."))
    if status == CancelledError.exit_status:
        return CancelledError(_("The registration was interrupted from outside."))
    if (status is not None and status < 0) or status in (137, 139):
        return RunError(
            _(
                "The registration's process was ended by the system (signal {number}), most often because memory "
                "ran out: use the fast preset, or crop the CT."
            ).format(number=abs(status) if status < 0 else status - 128)
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
        _("The registration ended without a result (exit status {status}).").format(status=status)
    )


def child_sentence(log: list[str]) -> str:
    """The sentence in which the child says why it ended: its last line with its name, else the last at all."""
    for line in reversed(log):
        if _PREFIX.match(line):
            return _PREFIX.sub("", line)
    last = next((line for line in reversed(log) if line.strip() and not _LOG_LINE.match(line)), "")
    return last.strip()


def leftover_folders() -> list[str]:
    """Temporary folders of registrations that exist now, for tests and the log."""
    root = slicer.app.temporaryPath
    return [name for name in os.listdir(root) if name.startswith(TEMPORARY_PREFIX)]
