"""What every step of a tracking leaves behind, in the order of the steps: an interrupted run goes on by it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import replace

from PolyPoseLib.data.tracking.track import TrackedFrame
from PolyPoseLib.errors import InputError

Keep = Callable[[TrackedFrame], None]
"""Called with every frame as soon as a pass is through with it; once for every pass that comes by it."""


class Kept:
    """The steps of a tracking: those that an interrupted run made are taken over, every further one is kept.

    Steps follow each other in an order that depends on the sequence alone, and each depends on those before it alone.

    Parameters
    ----------
    structures : int
        How many are tracked.
    done : iterable of TrackedFrame
        What an interrupted run gave to its ``keep``, in that order.
    keep : callable, optional
        Takes every further frame.

    """

    def __init__(self, structures: int, done: Iterable[TrackedFrame] = (), keep: Keep | None = None) -> None:
        self._structures, self._keep = structures, keep
        self._done = list(done)[::-1]

    def frame(self, number: int, found: Callable[[], TrackedFrame]) -> TrackedFrame:
        """The next step's frame, of this number: taken over, or found now with the CPU seconds that it takes.

        Raises InputError where what was kept is of another sequence.
        """
        if self._done:
            frame = self._done.pop()
            if frame.frame != number or frame.poses.shape != (self._structures, 4, 4):
                raise InputError(
                    "The frames that were kept belong to another sequence or to other options: remove them, and start "
                    "anew."
                )
            return frame
        before = time.process_time()
        frame = found()
        frame = replace(frame, cpu_seconds=frame.cpu_seconds + time.process_time() - before)
        if self._keep is not None:
            self._keep(frame)
        return frame
