"""The logic's calls for sequences: nodes in, a running tracking out, and its track in the scene."""

from __future__ import annotations

from pathlib import Path

from PolyPoseLib.errors import InputError

from .process import environment
from .process.track_folder import TRACKS
from .process.track_run import Continuation, TrackRun
from .process.track_saving import remember_folder
from .study.track_inputs import inputs_of
from .study.track_plan import TrackPlan, plan_of
from .study.track_request import TrackRequest
from .study.track_scene import TrackNodes, show_track
from .study.track_writer import read_track
from .study.xray_reading import XrayReader


def planned(request: TrackRequest, reader: XrayReader | None = None) -> TrackPlan:
    """What a request comes to; reader: has read the X-rays before, so that it costs nothing."""
    return plan_of(request, reader or XrayReader())


def start_tracking(
    request: TrackRequest,
    output: str | Path | None = None,
    resume: bool = False,
    continuation: Continuation | None = None,
    plan: TrackPlan | None = None,
) -> TrackRun:
    """Start to track, or to go on; the arguments are described at PolyPoseLogic.startTracking. Raises InputError."""
    problem = environment.version_problem()
    if problem:
        raise InputError(problem)
    data = read_track(request, plan or planned(request))
    return TrackRun(data, Path(output) if output else TRACKS.new(), resume, continuation)


def show(
    request: TrackRequest, folder: Path, replaced: TrackNodes | None = None, plan: TrackPlan | None = None
) -> TrackNodes:
    """Put the folder of a track into the scene, on the nodes of its request; replaced: those of an earlier one."""
    nodes = show_track(folder, inputs_of(request, plan or planned(request)), replaced)
    remember_folder(nodes, folder)
    return nodes
