"""What Slicer's Python console calls to follow bones through X-ray sequences."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from PolyPoseLib.data.progress import Progress

    from .process.track_run import Continuation, TrackRun
    from .study.parameters import PolyPoseParameterNode
    from .study.track_plan import TrackPlan
    from .study.track_request import TrackRequest
    from .study.track_scene import TrackNodes


class TrackLogic:
    """The part of PolyPoseLogic that tracks."""

    if TYPE_CHECKING:

        def getParameterNode(self) -> PolyPoseParameterNode:
            """The scene's parameter node."""
            ...

    def track(
        self,
        request: TrackRequest | None = None,
        outputFolder: str | Path | None = None,
        progress: Callable[[Progress], None] | None = None,
    ) -> TrackNodes:
        """Follow bones through X-ray sequences, wait, and put the track into the scene.

        Parameters
        ----------
        request : PolyPoseSlicer.study.track_request.TrackRequest, optional
            What to track; None: what the scene's parameter node asks for.
        outputFolder : path, optional
            New folder for the track; None: a temporary one, which is gone when the scene is closed.
        progress : callable, optional
            Called with each PolyPoseLib.data.progress.Progress; an exception in it stops the tracking.

        Returns
        -------
        PolyPoseSlicer.study.track_scene.TrackNodes
            The sequences of the bones' transforms, their browser, models and plots.

        Raises
        ------
        InputError
            Something is missing or wrong.
        UntrustedResultError
            The track is in the scene, but must not be trusted.
        PolyPoseError
            Any other failure; the text is one sentence.

        """
        from PolyPoseLib.errors import UntrustedResultError

        from .track_calls import planned

        request = request or self.trackRequest()
        plan = planned(request)
        run = self.startTracking(request, outputFolder, plan=plan)
        try:
            run.wait_for_end(progress)
        except UntrustedResultError:
            self.showTrack(run.output, request, plan)
            raise
        return self.showTrack(run.output, request, plan)

    def startTracking(
        self,
        request: TrackRequest | None = None,
        outputFolder: str | Path | None = None,
        resume: bool = False,
        continuation: Continuation | None = None,
        plan: TrackPlan | None = None,
    ) -> TrackRun:
        """Start to follow bones through X-ray sequences and return at once.

        Parameters
        ----------
        request, outputFolder
            As in `track`.
        resume : bool
            Go on with the frames that an interrupted run towards outputFolder has left beside it.
        continuation : PolyPoseSlicer.process.track_run.Continuation, optional
            The earlier track and the corrected frame that this one goes on from.
        plan : PolyPoseSlicer.study.track_plan.TrackPlan, optional
            What the request comes to, where that is known already.

        Returns
        -------
        PolyPoseSlicer.process.track_run.TrackRun
            Call its `poll` on the main thread until `state.ended`; `showTrack` then puts its `output` into the scene.

        Raises
        ------
        InputError
            Something is missing or wrong.

        """
        from .track_calls import start_tracking

        return start_tracking(request or self.trackRequest(), outputFolder, resume, continuation, plan)

    def showTrack(
        self, folder: str | Path, request: TrackRequest | None = None, plan: TrackPlan | None = None
    ) -> TrackNodes:
        """Put the folder of a track into the scene, in the place of the one that is there.

        Parameters
        ----------
        folder : path
            As a tracking wrote it.
        request, plan
            What was tracked, as in `startTracking`.

        Raises
        ------
        InputError
            The folder holds no track, or one of other structures.

        """
        from .study.track_scene import TrackNodes
        from .track_calls import show

        return show(request or self.trackRequest(), Path(folder), TrackNodes.of_scene(), plan)

    def trackRequest(self, parameterNode: PolyPoseParameterNode | None = None) -> TrackRequest:
        """What a parameter node asks to track; the scene's own when it is None."""
        from .study.track_request import TrackRequest

        return TrackRequest.of(parameterNode or self.getParameterNode())
