"""Bones followed through sequences: the core's subcommand `track` as a child process on a snapshot of the scene."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from slicer.i18n import tr as _

from PolyPoseLib.data.progress import Progress
from PolyPoseLib.errors import UntrustedResultError

from ..study.track_writer import TrackData, write_track
from .environment import python_executable
from .job import Job, Step
from .study_run import State, StudyRun, child_sentence, error_of

if TYPE_CHECKING:
    from PolyPoseLib.data.tracking.track import Track

PASSES = ("tracking", "tracking back")
"""Stages of the core in which frames are fitted one by one."""


@dataclass(frozen=True)
class Continuation:
    """Where an earlier track goes on from.

    track: the text of its track.json. frame: to go on from. poses: of the bones that were corrected in it, (4, 4) from
    the rig's world to the CT, LPS mm. direction: forward, backward or both.
    """

    track: str
    frame: int
    poses: Mapping[str, np.ndarray]
    direction: str

    def write(self, folder: Path) -> list[str]:
        """Write what the child reads into a folder, and return the command line's arguments."""
        from PolyPoseLib.io.tracking.corrected_poses import write_corrected_poses
        from PolyPoseLib.io.tracking.tracks import TRACK

        earlier, poses = folder / "earlier", folder / "poses.json"
        earlier.mkdir()
        (earlier / TRACK).write_text(self.track, encoding="utf-8")
        arguments = ["--continue", str(earlier), "--at", str(self.frame), "--direction", self.direction]
        if not self.poses:
            return arguments
        write_corrected_poses(poses, self.poses)
        return [*arguments, "--poses", str(poses)]


class TrackRun(StudyRun):
    """A running tracking: call `poll` from time to time, on the main thread, until `state.ended`.

    Attributes
    ----------
    output : Path
        The track's folder, complete when the state is DONE; until then frames are kept beside it.
    track : Track or None
        What it found, once it is DONE.
    error : PolyPoseError or None
        Why it failed; a track that must not be trusted is an error too, but it exists.

    """

    def __init__(
        self,
        data: TrackData,
        output: Path,
        resume: bool = False,
        continuation: Continuation | None = None,
        command: list[str] | None = None,
    ) -> None:
        """Start it.

        Parameters
        ----------
        data : TrackData
            Taken from the scene.
        output : Path
            The folder to make; frames of an interrupted run towards it lie beside it.
        resume : bool
            Whether these frames are gone on with; otherwise they are discarded.
        continuation : Continuation, optional
            The earlier track that this one goes on from.
        command : list of str, optional
            Another program than PolyPoseLib, for tests.

        """
        self.output = output
        self.track: Track | None = None
        self._earlier = self._written()
        self._data, self._resume, self._continuation = data, resume, continuation
        self._more_arguments: list[str] = []
        self._untrusted: UntrustedResultError | None = None
        self._pace = Pace()
        super().__init__(data.study, command or [python_executable(), "-m", "PolyPoseLib"], _("tracking"))

    @property
    def seconds_left(self) -> float | None:
        """About how long the present pass over the frames still takes; None while that is not known."""
        return self._pace.left

    def _write(self) -> Path:
        if self._continuation is not None:
            self._more_arguments = self._continuation.write(self._folder)
        return write_track(self._data, self._folder, lambda: self._cancelling)

    def _arguments(self, study_file: Path) -> list[str]:
        arguments = ["track", str(study_file), "--output", str(self.output)]
        arguments += ["--progress", "json", "--allow-outside"]
        return [*arguments, *self._more_arguments, "--resume" if self._resume else "--overwrite"]

    def _took(self, steps: list[Step]) -> None:
        for each in steps:
            self._pace.took(each.progress)

    def _child_ended(self, job: Job) -> None:
        untrusted = job.exit_status == UntrustedResultError.exit_status
        ended_well = job.exit_status == 0 or untrusted or (self._cancelling and self._is_finished())
        if not ended_well or self._written() is None:
            raise error_of(job.exit_status, job.log, self._what)
        self._untrusted = UntrustedResultError(child_sentence(job.log)) if untrusted else None
        self.state = State.LOADING
        self._thread = self._start_thread(self._load)

    def _is_finished(self) -> bool:
        """The track is there, and the frames beside it are gone: it would be lost if it were not taken."""
        return self._written() not in (None, self._earlier)

    def _written(self) -> tuple[int, int] | None:
        """Changes whenever a track is written to the output; None where there is none."""
        try:
            found = (self.output / "track.json").stat()
        except OSError:
            return None
        return found.st_mtime_ns, found.st_ino

    def _load(self) -> Track:
        from PolyPoseLib.io.tracking.tracks import load_track

        return load_track(self.output)

    def _poll_loading(self) -> None:
        if not self._thread.is_alive():
            track: Track = self._take_thread()
            self.track = track
            if track.distrust and self._untrusted is None:  # cancelled before the child could say so
                self._untrusted = UntrustedResultError(_distrust_text(track))
            self._end(State.DONE, self._untrusted)


def _distrust_text(track: Track) -> str:
    return _("The track must not be trusted: {reasons}.").format(reasons=track.distrust_clauses)


class Pace:
    """How fast frames go by in one pass, and how long the rest of it takes."""

    def __init__(self) -> None:
        """Nothing was seen yet."""
        self._stage = ""
        self._times: list[tuple[int, float]] = []
        self._of = 0
        self._seen = 0.0

    def took(self, progress: Progress) -> None:
        """A step of the run."""
        # Two passes of one name may follow each other; a pass never goes back, nor changes its length.
        behind = bool(self._times) and progress.iteration < self._times[-1][0]
        if progress.stage != self._stage or progress.of != self._of or behind:
            self._stage, self._of, self._times = progress.stage, progress.of, []
        if progress.stage in PASSES:
            # The first frame takes longer than any other: it does not count once there are others.
            self._times.append((progress.iteration, progress.seconds))
            self._seen = time.monotonic()

    @property
    def left(self) -> float | None:
        """Seconds; None outside of a pass and before two frames of it are done."""
        if self._stage not in PASSES or len(self._times) < 2:
            return None
        begin = 1 if len(self._times) > 2 else 0
        (done_then, then), (done, now) = self._times[begin], self._times[-1]
        if done <= done_then or now <= then:
            return None
        a_frame = (now - then) / (done - done_then)
        return max(0.0, a_frame * (self._of - done) - (time.monotonic() - self._seen))
