"""One registration from start to end: write the study, run the child, read the result, fill the nodes."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import slicer
from slicer.i18n import tr as _

from PolyPoseLib.data.progress import ProgressCallback
from PolyPoseLib.errors import UntrustedResultError

from ..scene.drawing import drawn_once
from ..scene.grid_transform import read_field, set_grid_transform
from ..scene.names import free_name
from ..study.loading import LoadedResult, load_folder
from ..study.results import InputStyle, OutputNodes, fill_nodes
from ..study.writer import StudyData
from .environment import python_executable
from .job import Job, Step
from .study_run import POLL_SECONDS, RunError, State, StudyRun, error_of, leftover_folders


class Registration(StudyRun):
    """A running registration: call `poll` from time to time, on the main thread, until `state.ended`.

    Attributes
    ----------
    progress : Progress or None
        The last step.
    similarities : list of float
        Of all steps so far.
    error : PolyPoseError or None
        Why it failed; a result that must not be trusted is an error too, but its nodes exist.
    nodes : OutputNodes
        What it made.

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
        """Start it.

        Parameters
        ----------
        study : StudyData
            The inputs, copied from the scene.
        nodes : OutputNodes
            To be filled; those that are None are made.
        style : InputStyle
            How the inputs are shown; the outputs take it over.
        name : str
            Begins the names of new nodes.
        output_folder : path, optional
            Where to keep the result folder; None: it is read into nodes and removed.
        preview : bool
            Refresh nodes.transform while the registration runs; it is made when it is None.
        command : list of str, optional
            Another program than PolyPoseLib, for tests.

        """
        self.nodes = nodes
        self.similarities: list[float] = []
        self._style, self._name = style, name
        self._steps: Iterator[None] | None = None
        self._before_preview: Any = None
        super().__init__(study, command or [python_executable(), "-m", "PolyPoseLib"], _("registration"))
        self._output = Path(output_folder) if output_folder else self._folder / "result"
        self._preview = self._folder / "preview.h5" if preview else None

    def wait(self, progress: ProgressCallback | None = None) -> OutputNodes:
        """Block until it has ended.

        Parameters
        ----------
        progress : callable, optional
            Called with each new Progress; an exception in it, KeyboardInterrupt included, stops the registration.

        Returns
        -------
        OutputNodes

        Raises
        ------
        PolyPoseError
            `error`, when there is one.

        """
        self.wait_for_end(progress)
        return self.nodes

    def _arguments(self, study_file: Path) -> list[str]:
        arguments = ["register", str(study_file), "--output", str(self._output)]
        arguments += ["--progress", "json", "--allow-outside", "--overwrite"]
        return arguments if self._preview is None else [*arguments, "--preview", str(self._preview)]

    def _load_preview(self, path: str) -> Any:
        """The displacement field of a preview; only a file in the run's own folder is read."""
        if Path(path).resolve().parent != self._folder.resolve():
            return None
        return read_field(path)

    def _took(self, steps: list[Step]) -> None:
        similarities = [each.progress.similarity for each in steps]
        self.similarities.extend(each for each in similarities if each is not None)
        fields = [each.preview for each in steps if each.preview is not None]
        if fields and not self._cancelling:
            self._show_preview(*fields[-1])

    def _child_ended(self, job: Job) -> None:
        untrusted = UntrustedResultError.exit_status
        if job.exit_status not in (0, untrusted) or not (self._output / "result.json").is_file():
            raise error_of(job.exit_status, job.log)
        self.state = State.LOADING
        study_file = self._folder / "STUDY.json"
        self._thread = self._start_thread(lambda: load_folder(self._output, self._study, study_file))

    @drawn_once
    def _show_preview(self, vectors: Any, affine: Any) -> None:
        """Refresh the transform node, so that what is under it moves in the views."""
        node = self.nodes.transform
        if node is None:
            name = free_name(_("{name} transform").format(name=self._name))
            node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLGridTransformNode", name)
            self.nodes.transform = node
            self.nodes.made.append(node)
        if node.GetScene() is not None:
            if self._before_preview is None:
                self._before_preview = node.GetTransformFromParent()
            set_grid_transform(node, vectors, affine)

    @drawn_once
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

    def _take_back(self) -> None:
        """Remove new nodes, and restore the transform of a node that existed before."""
        node = self.nodes.transform
        if node is not None and self._before_preview is not None and node.GetScene() is not None:
            node.SetAndObserveTransformFromParent(self._before_preview)
        self.nodes.remove_made()


def distrust_error(nodes: OutputNodes) -> UntrustedResultError | None:
    """The error of a result that must not be trusted; its nodes exist nevertheless."""
    if nodes.trusted:
        return None
    return UntrustedResultError(
        _("The result must not be trusted: {reasons}.").format(reasons="; ".join(nodes.distrust))
    )


__all__ = ["Registration", "RunError", "State", "distrust_error", "leftover_folders"]
