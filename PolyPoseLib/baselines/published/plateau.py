"""A step size that falls while a similarity stays level, and when to stop: the schedule of the camera stage."""

from __future__ import annotations

PATIENCE, THRESHOLD, FACTOR, PLATEAUS = 10, 1e-4, 0.1, 3


class Plateaus:
    """Tracks a similarity that is to rise.

    After more than PATIENCE iterations in a row without a rise of the best value by the share THRESHOLD, the step size
    is multiplied by FACTOR. As in the published program the first step size counts as the first of PLATEAUS, so that
    the second fall ends the level.

    Attributes
    ----------
    factor : float
        Of the step size, at first 1.
    over : bool
        Whether the level has ended.

    References
    ----------
    torch.optim.lr_scheduler.ReduceLROnPlateau (mode "max"), and the loop around it in github.com/eigenvivek/xvr,
    src/xvr/registrar/base.py.

    """

    def __init__(self) -> None:
        self.factor, self.over = 1.0, False
        self._best: float | None = None
        self._bad, self._seen = 0, 1

    def after(self, similarity: float) -> None:
        """Take note of one iteration's similarity."""
        # Torch's rule, best * (1 + THRESHOLD), would call a small fall below 0 a rise.
        if self._best is None or similarity > self._best + THRESHOLD * abs(self._best):
            self._best, self._bad = similarity, 0
        else:
            self._bad += 1
        if self._bad > PATIENCE:
            self._bad = 0
            self.factor *= FACTOR
            self._seen += 1
            self.over = self._seen == PLATEAUS
